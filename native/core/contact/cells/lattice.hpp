// Lattices of rectangular contact cells, and the rectangles they cover.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "geometry/polygon.hpp"

namespace mjtactile {

// Grids and regions are smaller than what they cover by this factor. Rounding would decide whether there is a body over
// points exactly on an edge.
constexpr double kWithin = 1.0 - 1e-9;

// Equal rectangles in rows and columns about a centre, turned by an angle, in the pad frame.
struct Lattice {
  // Points closer than this to a line of a grid, in cells, are on it. Rounding would choose its side.
  static constexpr double kOnLine = 1e-6;

  Point centre;                 // [m]
  double size, stretch;         // length of a cell along the rows [m]; length over width [-]
  std::size_t columns, rows;
  double cosine, sine;          // of the direction of the rows

  std::size_t cells() const { return columns * rows; }
  double width() const { return size / stretch; }
  // Whether cells half as wide are not narrower than `narrowest` [m].
  bool splits(double narrowest) const { return width() >= 2.0 * narrowest; }
  // The point with given lattice coordinates, which count cells from the lattice's first corner [m].
  Point at(double column, double row) const {
    const double x = (column - static_cast<double>(columns) / 2) * size;
    const double y = (row - static_cast<double>(rows) / 2) * width();
    return {cosine * x - sine * y + centre.x, sine * x + cosine * y + centre.y};
  }
  // The middle of a cell, counted row by row [m].
  Point middle(std::size_t cell) const {
    return at(static_cast<double>(cell % columns) + 0.5, static_cast<double>(cell / columns) + 0.5);
  }
  // Visit the cells that have a point, counted row by row. They are several if it is on a line between
  // cells.
  template <typename Visit>
  void each_at(const Point& point, Visit visit) const {
    const double x = point.x - centre.x, y = point.y - centre.y;
    const Range in_row = beside((cosine * x + sine * y) / size + static_cast<double>(columns) / 2, columns);
    const Range in_column = beside((cosine * y - sine * x) / width() + static_cast<double>(rows) / 2, rows);
    for (std::size_t row = in_column.first; row < in_column.end; ++row) {
      for (std::size_t column = in_row.first; column < in_row.end; ++column) visit(row * columns + column);
    }
  }

 private:
  struct Range {
    std::size_t first, end;
  };
  // Of `count` cells in a line, those that have a point with the given coordinate.
  static Range beside(double coordinate, std::size_t count) {
    const double first = std::max(std::floor(coordinate - kOnLine), 0.0);
    const double end = std::min(std::floor(coordinate + kOnLine) + 1.0, static_cast<double>(count));
    return {static_cast<std::size_t>(first), static_cast<std::size_t>(std::max(end, first))};
  }
};

// A rectangle in the pad frame, turned by an angle, that estimates where a body presses. The width is along the angle.
struct Region {
  Point centre;                  // [m]
  double angle, width, height;   // [rad, m, m]

  double area() const { return width * height; }
  bool holds(const Point& at) const;
  // Grow until the region holds a point.
  void include(const Point& at);
  // Distance of a point from the middle [m].
  double away(const Point& at) const;
  // The same rectangle with the longer side as its width.
  Region lengthwise() const;
  // Length of cells of about the given area [m^2] over their width, a power of two. Long contacts get long cells.
  double stretch(double cell_area) const;
  // Equal cells that cover the region, with about the given area [m^2]. None is narrower than `narrowest` [m].
  Lattice lattice(double cell_area, double narrowest) const;
};

}  // namespace mjtactile
