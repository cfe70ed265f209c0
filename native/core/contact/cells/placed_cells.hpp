// Contact cells of a flat outline at any placement. Outlines that differ by a rigid motion only, such as those of one
// moving punch, share their cells. The squares lie along the outline's own direction.
#pragma once

#include <cstddef>
#include <memory>

#include "contact/cells/face.hpp"
#include "geometry/outline.hpp"

namespace mjtactile {

struct PlacedCells {
  std::shared_ptr<const Face> face;   // shared with other placements; null if the outline is too narrow for cells
  Point at;                           // position of the face's origin in the outline's frame [m]
  double angle;                       // of the face in the outline's frame [rad]
};

// About `count` cells for an outline with at least one corner. The cells of recent outlines are kept. It may be called
// from several threads.
PlacedCells placed_cells(const Outline& outline, std::size_t count);

// Angle of an outline's own axes, from -pi/4 to pi/4 [rad]. They are the axes along which sides of the outline and of
// its convex hull have the largest total length. A round outline has its principal axes of inertia. If several
// directions are equal, the one nearest to the x axis is used.
double own_direction(const Outline& outline);

}  // namespace mjtactile
