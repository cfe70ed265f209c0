// Where a rigid body, and a flat side of it, stand on a pad.
#pragma once

#include <cmath>

#include "geometry/polygon.hpp"

namespace mjtactile {

// Pose of a body in the pad frame: columns of `rotation` (row-major) are the body's axes.
struct Pose {
  double position[3];
  double rotation[9];
};

// Where a flat side stands on the pad: turned about the pad's normal, then shifted.
struct Placement {
  double cosine, sine, shift[2];

  Point operator()(const Point& point) const {
    return {cosine * point.x - sine * point.y + shift[0], sine * point.x + cosine * point.y + shift[1]};
  }
  double angle() const { return std::atan2(sine, cosine); }
  // From the pad frame back to the side's.
  Point back(double x, double y) const {
    return {cosine * (x - shift[0]) + sine * (y - shift[1]), -sine * (x - shift[0]) + cosine * (y - shift[1])};
  }
};

constexpr Placement kHere = {1.0, 0.0, {0.0, 0.0}};

}  // namespace mjtactile
