// Points that lie on a regular grid.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {

// A regular grid, not necessarily along x and y, on which points lie row by row.
struct PointGrid {
  std::size_t counts[2] = {};   // points in a row, and rows
  Point first = {0.0, 0.0};
  double per[2][2] = {};         // places along rows and across them per length along x and y [1/m]

  // Fit the grid to points. False if they do not form one, or are too few.
  bool fit(const std::vector<Point>& points);
  // Ranges of columns and rows that contain all grid points in a rectangle, from `from` to before `end`.
  void find(const Rectangle& over, std::size_t from[2], std::size_t end[2]) const {
    const double x = (over.west + over.east) / 2 - first.x, y = (over.south + over.north) / 2 - first.y;
    const double width = over.east - over.west, height = over.north - over.south;
    for (int axis = 0; axis < 2; ++axis) {
      const double middle = per[axis][0] * x + per[axis][1] * y;
      const double half = (std::abs(per[axis][0]) * width + std::abs(per[axis][1]) * height) / 2 + kMargin;
      const auto most = static_cast<double>(counts[axis]);
      from[axis] = static_cast<std::size_t>(std::min(std::max(middle - half, -1.0) + 1.0, most));
      end[axis] = static_cast<std::size_t>(std::min(std::max(middle + half, -1.0) + 1.0, most));
    }
  }

 private:
  static constexpr double kMargin = 1e-2;   // around rectangles, in spacings
};

}  // namespace mjtactile
