// Contact cells of a flat outline at any placement. Outlines that differ by a rigid motion only, such as those of one
// moving punch, share their cells. The squares lie along the outline's own direction.
#pragma once

#include <memory>

#include "contact/cells/face.hpp"
#include "contact/cells/face_cells.hpp"
#include "geometry/outline.hpp"

namespace mjtactile {

struct PlacedCells {
  std::shared_ptr<const Face> face;   // shared with other placements; null if the outline is too narrow for cells
  Point at;                           // position of the face's origin in the outline's frame [m]
  double angle;                       // of the face in the outline's frame [rad]
};

// Cells for an outline with at least one corner. The cells of recent outlines are kept. It may be called
// from several threads.
PlacedCells placed_cells(const Outline& outline, const CellCount& wanted);

}  // namespace mjtactile
