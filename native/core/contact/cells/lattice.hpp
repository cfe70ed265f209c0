// Lattices of rectangular contact cells, and the rectangles they cover.
#pragma once

#include <cstddef>
#include <cstdint>

#include "geometry/polygon.hpp"

namespace mjtactile {

// Equal rectangles in rows and columns about a centre, turned by an angle.
struct Lattice {
  Point centre;
  double angle, size, stretch;  // of the rows [rad]; cells are `size` [m] long, along the rows, and size / stretch wide
  std::size_t columns, rows;
  double cosine, sine;          // of the angle

  std::size_t cells() const { return columns * rows; }
  double width() const { return size / stretch; }
  // Where lattice coordinates, counted in cells from its first corner, lie in the plane.
  Point at(double column, double row) const {
    const double x = (column - static_cast<double>(columns) / 2) * size;
    const double y = (row - static_cast<double>(rows) / 2) * width();
    return {cosine * x - sine * y + centre.x, sine * x + cosine * y + centre.y};
  }
};

// A rectangle in the plane, turned by an angle: where a body presses, as far as that is known.
struct Region {
  Point centre;
  double angle, width, height;

  double area() const { return width * height; }
  bool holds(const Point& at) const;
  // Turned by a quarter where it is wider than long, so that the longer side comes first.
  Region lengthwise() const;
  // Length of cells over their width, a power of two: long contacts take long cells.
  double stretch() const;
  // Equal cells of about an area that cover it, none narrower than a width.
  Lattice lattice(double cell_area, double narrowest) const;
};

}  // namespace mjtactile
