// The directions in which the cells of a body of any shape press.
//
// A surface that is pressed lies against the body. So the body presses along its own normal, as the master surface of a
// finite-element contact does (Wriggers, Computational Contact Mechanics, 2006, chapter 4). The lean of a cell is the
// gradient g of the body's height above the undeformed surface [-]. A force f that presses along the surface's normal
// comes with the force f g along the surface.
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {

// Forces on cells.
struct CellForces {
  const double* forces;           // shear along the surface, and minus the force along its normal (cells, 3) [N]
  const Point* leans = nullptr;   // see balance_lean() (cells) [-]; null if no cell leans

  // The force on a cell with its lean (3) [N].
  void at(std::size_t cell, double* force) const {
    const double* own = forces + 3 * cell;
    const Point lean = leans == nullptr ? Point{0.0, 0.0} : leans[cell];
    force[0] = own[0] - lean.x * own[2], force[1] = own[1] - lean.y * own[2], force[2] = own[2];
  }
};

// Compute leans from the gradients of the body's height above the cells [-]. Long gradients are shortened. Then a
// translation and a rotation are subtracted, so that the forces f g have neither a resultant nor a torsion: the body's
// wrench already holds both, and shear carries them. `points`: positions of the cells [m]; `pressing`: forces f [N]. If
// all forces are 0, no cell leans.
void balance_lean(const std::vector<Point>& gradients, const Point* points, const double* pressing,
                  std::vector<Point>& leans);

}  // namespace mjtactile
