// Height maps: the heights of a rigid body's lower surface over the points of a pad, and what an inclined plane sees of
// them.
#pragma once

#include <limits>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {

// Height over points where there is no body.
constexpr double kNowhere = std::numeric_limits<double>::infinity();

// Lower surface of one body over the sheet of one pad, in the pad frame. Only differences of height matter.
class HeightMap {
 public:
  virtual ~HeightMap() = default;
  // Height over (x, y) [m]; infinite off the sheet and where no part of the body faces the pad.
  virtual double height(double x, double y) const = 0;
  // Heights over many points at once, which some maps compute faster.
  virtual void heights(const std::vector<Point>& points, std::vector<double>& to) const {
    to.clear();
    for (const Point& at : points) to.push_back(height(at.x, at.y));
  }
  // The part of a segment from the first to the last point over which the body is no higher than a plane, given the
  // plane's heights at the segment's ends [m]. False if the map cannot tell this exactly; `part` is then undefined.
  virtual bool part_below(const Segment&, const double (&)[2], SegmentPart&) const { return false; }
  // The direction [rad] of a long part of the body, given an estimate: that of a straight side if the estimate is close
  // to one, else the estimate.
  virtual double straightened(double angle) const { return angle; }
  // A part of the sheet that contains all points with a finite height.
  virtual Rectangle bounds() const = 0;
  // The same rectangle before it is cut at the sheet's rim: larger where the body goes on beyond the rim.
  virtual Rectangle whole() const { return bounds(); }
  // Points where the body may stand lowest, besides those that a grid over the bounds finds; empty if none are known.
  virtual const std::vector<Point>& candidates() const { return none(); }
  // Corners of a flat face, toward which pressure rises; empty for other bodies.
  virtual const std::vector<Point>& corners() const { return none(); }

 private:
  static const std::vector<Point>& none() {
    static const std::vector<Point> empty;
    return empty;
  }
};

// The heights of a body up to `highest`, measured from an inclined plane.
struct HeightWindow {
  const HeightMap* map;
  double slopes[2];         // of the plane along x and y [-]
  Point middle;             // where the plane is at height 0
  double lowest, highest;   // origin of the measured heights, and their limit above it [m]

  // A height over a point, as measured from the plane [m].
  double measured(const Point& at, double height) const {
    return height - slopes[0] * (at.x - middle.x) - slopes[1] * (at.y - middle.y) - lowest;
  }
  // The height that was measured as this one [m].
  double unmeasured(const Point& at, double height) const {
    return height + lowest + slopes[0] * (at.x - middle.x) + slopes[1] * (at.y - middle.y);
  }
  // The measured height of the body over a point [m]; infinite where there is none.
  double height(const Point& at) const { return measured(at, map->height(at.x, at.y)); }
};

}  // namespace mjtactile
