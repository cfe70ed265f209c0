// Poses of rigid bodies in the pad frame, and placements of flat sides on the pad.
#pragma once

#include <cmath>

#include "geometry/polygon.hpp"

namespace mjtactile {

// Pose of a body in the pad frame. The columns of `rotation`, which is row-major, are the body's axes.
struct Pose {
  double position[3];   // [m]
  double rotation[9];
};

// Placement of a flat side on the pad: a rotation about the pad's normal, then a shift [m].
struct Placement {
  double cosine, sine, shift[2];

  // From the side's frame to the pad frame.
  Point operator()(const Point& point) const {
    return {cosine * point.x - sine * point.y + shift[0], sine * point.x + cosine * point.y + shift[1]};
  }
  double angle() const { return std::atan2(sine, cosine); }
  // From the pad frame to the side's frame.
  Point back(double x, double y) const {
    return {cosine * (x - shift[0]) + sine * (y - shift[1]), -sine * (x - shift[0]) + cosine * (y - shift[1])};
  }
};

// An inclined plane over the pad: slopes along x and y [-], and height over the origin [m].
struct InclinedPlane {
  double slopes[2], height;

  double over(double x, double y) const { return height + slopes[0] * x + slopes[1] * y; }
};

// The placement that moves nothing.
constexpr Placement kUnmoved = {1.0, 0.0, {0.0, 0.0}};

}  // namespace mjtactile
