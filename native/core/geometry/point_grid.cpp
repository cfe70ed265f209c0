#include "geometry/point_grid.hpp"

#include <cmath>

namespace mjtactile {
namespace {

// Least number of points; and largest distance of a point from its place on the grid, over the spacing.
constexpr std::size_t kFewPoints = 32;
constexpr double kOffGrid = 1e-4;

}  // namespace

bool PointGrid::fit(const std::vector<Point>& points) {
  if (points.size() < kFewPoints) return false;
  first = points.front();
  const double along[2] = {points[1].x - first.x, points[1].y - first.y};
  const double near = kOffGrid * std::hypot(along[0], along[1]);
  std::size_t columns = 1;
  const auto goes_on = [&](const Point& from, const Point& to) {
    return std::abs(to.x - from.x - along[0]) + std::abs(to.y - from.y - along[1]) <= near;
  };
  while (columns < points.size() && goes_on(points[columns - 1], points[columns])) ++columns;
  const std::size_t rows = points.size() / columns;
  if (columns < 2 || rows < 2 || rows * columns != points.size()) return false;
  const Point &right = points[columns - 1], &top = points[(rows - 1) * columns];
  const double a[2] = {(right.x - first.x) / static_cast<double>(columns - 1),
                       (right.y - first.y) / static_cast<double>(columns - 1)};
  const double b[2] = {(top.x - first.x) / static_cast<double>(rows - 1),
                       (top.y - first.y) / static_cast<double>(rows - 1)};
  bool fits = true;
  for (std::size_t row = 0; row < rows; ++row) {
    const double x = first.x + static_cast<double>(row) * b[0], y = first.y + static_cast<double>(row) * b[1];
    for (std::size_t column = 0; column < columns; ++column) {
      const Point& at = points[row * columns + column];
      const auto step = static_cast<double>(column);
      fits &= std::abs(at.x - x - step * a[0]) + std::abs(at.y - y - step * a[1]) <= near;
    }
  }
  const double turn = a[0] * b[1] - a[1] * b[0];
  if (!fits || !(std::abs(turn) > near * near)) return false;
  counts[0] = columns, counts[1] = rows;
  per[0][0] = b[1] / turn, per[0][1] = -b[0] / turn;
  per[1][0] = -a[1] / turn, per[1][1] = a[0] / turn;
  return true;
}

}  // namespace mjtactile
