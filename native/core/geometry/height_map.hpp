// How high the lower surface of a rigid body stands over the points of a pad.
#pragma once

#include <limits>
#include <vector>

#include "geometry/polygon.hpp"
#include "geometry/triangles.hpp"

namespace mjtactile {

constexpr double kNowhere = std::numeric_limits<double>::infinity();

// Lower surface of one body over one pad's sheet, in the pad frame. Only differences of height matter.
class HeightMap {
 public:
  virtual ~HeightMap() = default;
  // Height over (x, y) [m]; infinite where nothing of the body faces the pad, and off the sheet.
  virtual double height(double x, double y) const = 0;
  // The same over many points at once, which is cheaper where each question has its price.
  virtual void heights(const std::vector<Point>& points, std::vector<double>& to) const {
    to.clear();
    for (const Point& at : points) to.push_back(height(at.x, at.y));
  }
  // The part of the sheet outside of which nothing faces the pad.
  virtual Rectangle bounds() const = 0;
  // Points where it may stand lowest, besides those that a grid over the bounds finds: none where nothing is known.
  virtual const std::vector<Point>& candidates() const {
    static const std::vector<Point> none;
    return none;
  }
};

}  // namespace mjtactile
