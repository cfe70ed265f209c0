// Compliance of a half space under shear on polygonal cells: integrals over pairs of them in closed form.
//
// A point force on a half space moves its surface by terms in 1/r, x^2/r^3, x y/r^3 and x/r^2 (Johnson, Contact
// Mechanics, 1985, section 3.2). Each is a sum of second derivatives of a smoother kernel, so the divergence theorem
// turns integrals over two polygons into integrals over their edges, as in tests/reference/half_space.py.
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/face.hpp"

namespace mjtactile {

// Integrals over pairs of cells (cells, cells) [m^3] of the kernels of shear. (x, y) points from the second cell to the
// first, along the axes of the cells' own frame, and r is its length. For the integrals of 1/r, see Face.
struct ShearIntegrals {
  std::vector<double> xx, xy, yy;     // of y^2/r^3, -x y/r^3 and x^2/r^3
  std::vector<double> along, across;  // of x/r^2 and y/r^2

  void clear(std::size_t cells) {
    for (auto* one : {&xx, &xy, &yy, &along, &across}) one->assign(cells * cells, 0.0);
  }
};

// Compute the integrals over the cells of a face from its edges. The time grows with the square of the number of edges,
// so this is for faces that are made once.
void integrate_edges(const Face& face, ShearIntegrals& integrals);

}  // namespace mjtactile
