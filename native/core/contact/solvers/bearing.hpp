// Loads that cells can bear when the force on each cell is limited by the pad's strength.
#pragma once

#include <cstddef>
#include <vector>

namespace mjtactile {

// Move a load to the nearest one that the cells can bear. `most` (cells): largest force on each cell [N]; `modes`
// (cells, motions) and `resultants` (motions) as in RigidContact; `nearer`: resultants of the moved load [N]. A load
// within a hundredth of the limit is moved as well; distance is measured from the load that presses all cells evenly.
// `order` is scratch memory. Returns whether the load was moved.
bool bring_within_bearing(std::size_t cells, const double* most, const double* modes, std::size_t motions,
                          const double* resultants, std::vector<std::size_t>& order, double* nearer);

}  // namespace mjtactile
