// Where a body stands low enough: the part of a cell, and the extent of a region.
#pragma once

#include "contact/cells/lattice.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

// A cell of a lattice of which a part may count.
struct CutCell {
  const Lattice& lattice;
  const HeightWindow& view;
  double column, row;
  const double* over;   // heights minus the limit at its 3 x 3 nodes; null if the body is not over all of them
};

// Parts of three lines across a cell in each direction, from -0.5 to 0.5 along the cell: the lines along the rows at
// its lower side, middle and upper side, then those along the columns from left to right. An empty part ends before it
// begins.
struct CellSpans {
  double low[2][3] = {{0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}};
  double high[2][3] = {{-0.5, -0.5, -0.5}, {-0.5, -0.5, -0.5}};
};

// The part of a cell that counts, in the lattice's axes from the cell's middle.
struct CoveredPart {
  double area, x, y, xx, xy, yy;   // its area [m^2], middle [m] and second moments over the area [m^2]
};

// Find the part of a cell below the view's limit. False if it is too small.
bool find_covered(const CutCell& cut, CoveredPart& covered);
// Find the part of a cell of a lattice that has given spans.
bool find_covered(const Lattice& lattice, const CellSpans& spans, CoveredPart& covered);

// Cut off what of a cell's part is beyond the sheet, as if the part were a rectangle. `middle`: of the cell. False if
// nothing is left.
bool clip(const Rectangle& sheet, const Lattice& lattice, const Point& middle, CoveredPart& part);

// Shorten or lengthen a region to where the body ends or stands too high, as measured on some lines along the region.
// Its size becomes between `least` and `most` times the old one; it stays as it is where no end is found.
void trim(const HeightWindow& view, double least, double most, Region& region);

}  // namespace mjtactile
