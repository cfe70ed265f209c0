// Outlines of flat faces: rings of corners that may be anything but convex.
#pragma once

#include <vector>

#include "geometry/pose.hpp"

namespace mjtactile {

// Outer rings run counter-clockwise, holes clockwise; a face may have several pieces.
struct Outline {
  std::vector<std::vector<Point>> rings;
};

// An outline where it stands on the pad, cut at the sheet's rectangle, in the pad frame [m]. False where nothing is left.
bool clip_outline(const Outline& outline, const Placement& placement, double west, double south, double east,
                  double north, Outline& result);

// The area that a ring encloses, negative where it runs clockwise.
double signed_area(const std::vector<Point>& ring);

}  // namespace mjtactile
