// Loads that cells can bear when the force on each cell is limited by the pad's strength.
#pragma once

#include "contact/solvers/rigid_contact.hpp"

namespace mjtactile {

// Move a problem's load to the nearest one that the cells can bear. `most` (cells): largest force on each cell [N].
// `nearer` (motions): resultants of the moved load [N]. A load within a hundredth of the limit is moved as well. This
// hundredth is measured from the load that gives all cells the same share of their largest force. Returns whether the
// load was moved.
bool bring_within_bearing(const RigidProblem& problem, const double* most, double* nearer);

// A quick test in one direction. True if bring_within_bearing() will certainly move the problem's load; false decides
// nothing.
bool lies_beyond_bearing(const RigidProblem& problem, const double* most);

}  // namespace mjtactile
