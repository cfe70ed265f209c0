#include "contact/cells/lattice.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/angles.hpp"

namespace mjtactile {
namespace {

// Length of cells over their width: up to kLong, or more where they would form more than kMoreColumns times as many
// columns as rows, or fewer than kFewestRows rows, of which about half press; at most kLongest. In a narrow contact,
// the pressure's course along it tells more than that across.
constexpr double kLong = 8.0, kLongest = 32.0, kMoreColumns = 4.0, kFewestRows = 3.5;
// Largest rounding error of a number of cells that should be whole.
constexpr double kMostRounding = 1e-9;

}  // namespace

bool Region::holds(const Point& at) const {
  const double c = std::cos(angle), s = std::sin(angle);
  const double x = at.x - centre.x, y = at.y - centre.y;
  return std::abs(c * x + s * y) <= width / 2 && std::abs(c * y - s * x) <= height / 2;
}

void Region::include(const Point& at) {
  const double c = std::cos(angle), s = std::sin(angle);
  const double along = c * (at.x - centre.x) + s * (at.y - centre.y);
  const double across = c * (at.y - centre.y) - s * (at.x - centre.x);
  const double longer = std::max(std::abs(along) - width / 2, 0.0);
  const double wider = std::max(std::abs(across) - height / 2, 0.0);
  const double x = std::copysign(longer / 2, along), y = std::copysign(wider / 2, across);
  centre = {centre.x + c * x - s * y, centre.y + s * x + c * y};
  width += longer, height += wider;
}

double Region::away(const Point& at) const { return std::hypot(at.x - centre.x, at.y - centre.y); }

Region Region::lengthwise() const {
  return width >= height ? *this : Region{centre, angle + kRightAngle, height, width};
}

double Region::stretch(double cell_area) const {
  const double shape = std::exp2(std::max(std::floor(std::log2(width / height) + kMostRounding), 0.0));
  const double square = height / kFewestRows;   // side of a square cell of which as many rows lie across
  const double needed = std::exp2(std::ceil(std::log2(cell_area / (square * square)) - kMostRounding));
  return std::min({shape, std::max({kLong, shape / kMoreColumns, needed}), kLongest});
}

Lattice Region::lattice(double cell_area, double narrowest) const {
  // A point or a line becomes one narrowest cell wide, because no extent may be zero below.
  if (!(width > 0.0) || !(height > 0.0)) {
    return Region{centre, angle, width > 0.0 ? width : narrowest, height > 0.0 ? height : narrowest}.lattice(cell_area,
                                                                                                             narrowest);
  }
  const double c = std::cos(angle), s = std::sin(angle);
  const auto cells = [](double extent, double step) {
    return std::max(std::size_t{1}, static_cast<std::size_t>(std::ceil(extent / step - kMostRounding)));
  };
  if (height < narrowest) {
    // Taxels cannot resolve the pressure across such a narrow region, so one row of cells is enough.
    const std::size_t columns = cells(width, std::max(cell_area / height, narrowest));
    const double size = width / static_cast<double>(columns);
    return {centre, size, size / height, columns, 1, c, s};
  }
  // If cells with the preferred ratio of sides would be too narrow, the ratio is reduced.
  const double longer = std::min(stretch(cell_area), std::max(cell_area / (narrowest * narrowest), 1.0));
  const double size = std::max(std::sqrt(cell_area * longer), narrowest * longer);
  const std::size_t columns = cells(width, size), rows = cells(height, size / longer);
  const double fitting = std::max({width / static_cast<double>(columns), longer * height / static_cast<double>(rows),
                                   narrowest * longer});
  return {centre, fitting, longer, columns, rows, c, s};
}

}  // namespace mjtactile
