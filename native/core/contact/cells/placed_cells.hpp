// Contact cells of a flat outline wherever it stands. Outlines that differ by a shift and a turn only, as those of one
// moving punch do, share their cells, with squares along the outline's own direction.
#pragma once

#include <cstddef>
#include <memory>

#include "contact/cells/face.hpp"
#include "geometry/outline.hpp"

namespace mjtactile {

struct PlacedCells {
  std::shared_ptr<const Face> face;   // null where the outline is too narrow for cells
  Point at;                           // where the face's origin stands [m]
  double angle;                       // of the face [rad]
};

// About `count` cells; those of outlines asked for lately are kept. `outline`: with one corner at least.
PlacedCells placed_cells(const Outline& outline, std::size_t count);

// Angle of an outline's own axes, within a quarter turn [rad]: the direction along and across which the most of its sides
// and of its hull's run; of round outlines that of their length. Where several are alike, that nearest to the x axis.
double own_direction(const Outline& outline);

}  // namespace mjtactile
