// Height maps of bodies over a curved pad, in the frame of a tangent plane (see tangent_plane.hpp).
#pragma once

#include <vector>

#include "geometry/height_map.hpp"
#include "geometry/tangent_plane.hpp"

namespace mjtactile {

// Distance of a body from the pad's surface along the plane's normal.
class SurfaceMap : public HeightMap {
 public:
  // `body`: heights of the body over the plane. Distances below `floor` or above `ceiling` [m] do not count.
  void place(const HeightMap& body, const TangentPlane& plane, double floor, double ceiling);

  double height(double u, double v) const override;
  void heights(const std::vector<Point>& points, std::vector<double>& to) const override;
  Rectangle bounds() const override { return bounds_; }
  const std::vector<Point>& candidates() const override { return candidates_; }

 private:
  double over_surface(double height, double surface) const;

  const HeightMap* body_ = nullptr;
  const TangentPlane* plane_ = nullptr;
  double floor_ = 0.0, ceiling_ = 0.0;
  Rectangle bounds_ = {};
  std::vector<Point> candidates_;
  mutable std::vector<double> surface_;   // kept between calls so that a step allocates nothing
};

// Heights over a tangent plane of a body that is given by its heights z(x, y) in the pad frame.
class TurnedMap : public HeightMap {
 public:
  void place(const HeightMap& upright, const TangentPlane& plane);

  double height(double u, double v) const override;
  void heights(const std::vector<Point>& points, std::vector<double>& to) const override;
  Rectangle bounds() const override { return bounds_; }

 private:
  struct Line {           // the search for the body along the normal over a point of the plane
    std::size_t place;    // index of that point among those that were asked for
    double rises;         // rate at which the line rises over the pad's surface [-]
    double w;             // height of the present trial [m]
    double last, missed;  // height of the last trial, and how far it lay below the body's lower side [m]
    // Highest trial below the body's lower side and lowest one above it [m]; infinite if there was none.
    double below = -kNowhere, above = kNowhere;

    // Go on from a trial that lies below the body's lower side by so much [m]; infinite if no body is above it.
    enum class Outcome { goes_on, found, none };
    Outcome step(double misses, int number, double near);
  };
  void look(const std::vector<Point>& points) const;

  const HeightMap* upright_ = nullptr;
  const TangentPlane* plane_ = nullptr;
  Rectangle bounds_ = {};
  mutable std::vector<Line> lines_;
  mutable std::vector<Point> asked_, one_;   // points of the pad's plane below the trial points
  mutable std::vector<double> found_;
};

}  // namespace mjtactile
