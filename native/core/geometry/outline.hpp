// Outlines of flat faces: rings of corners, convex or not.
#pragma once

#include <vector>

#include "geometry/pose.hpp"

namespace mjtactile {

// Rings of corners [m]. Outer rings run counter-clockwise, holes clockwise. A face may have several pieces.
struct Outline {
  std::vector<std::vector<Point>> rings;
};

// Place an outline on the pad and clip it at the sheet's rectangle; `result` is in the pad frame [m]. False if nothing
// is left.
bool clip_outline(const Outline& outline, const Placement& placement, const Rectangle& sheet, Outline& result);

// The outline of what several pieces cover together. Pieces may overlap, lie side by side, and touch. Points within
// `same` of each other are one [m]. Empty if that leaves no area, or no closed rings.
Outline united(const Outline& pieces, double same);

// The share of an outline's length, after it was clipped, that lies on the sheet's rim [-].
double share_on_rim(const Outline& clipped, const Rectangle& sheet);

// The area that a ring encloses [m^2], negative if the ring runs clockwise; and that of an outline.
double signed_area(const std::vector<Point>& ring);
double signed_area(const Outline& outline);

// The least rectangle that contains an outline.
Rectangle around(const Outline& outline);

}  // namespace mjtactile
