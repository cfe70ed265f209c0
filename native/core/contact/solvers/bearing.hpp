// Which loads cells can bear that break under a pressure of their own.
#pragma once

#include <cstddef>
#include <vector>

namespace mjtactile {

// Moves a load to the nearest that cells bear: (cells) `most` [N] each, with `modes` (cells, motions) and `resultants`
// (motions) as in RigidContact. `nearer`: the load's resultants then. Loads within a hundredth of what can be borne, from
// the one that presses cells evenly, are moved as well. Returns whether it was moved. `order` is room to sort cells in.
bool bring_within_bearing(std::size_t cells, const double* most, const double* modes, std::size_t motions,
                          const double* resultants, std::vector<std::size_t>& order, double* nearer);

}  // namespace mjtactile
