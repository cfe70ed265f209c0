// Loads that cells can bear when the force on each cell is limited by the pad's strength.
#pragma once

#include "contact/solvers/rigid_contact.hpp"

namespace mjtactile {

// Move a problem's load to the nearest one that the cells can bear. `most` (cells): largest force on each cell [N];
// `nearer` (motions): resultants of the moved load [N]. A load within a hundredth of the limit is moved as well;
// distance is measured from the load that presses all cells evenly. Returns whether the load was moved.
bool bring_within_bearing(const RigidProblem& problem, const double* most, double* nearer);

// Whether bring_within_bearing() is sure to move a problem's load. It looks in one direction alone, in little time
// where the load is one that cells can bear; false says nothing.
bool lies_beyond_bearing(const RigidProblem& problem, const double* most);

}  // namespace mjtactile
