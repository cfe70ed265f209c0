#include "geometry/outer_surface.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Hermite cubic between two grid lines: coefficients by powers of the position over the spacing, from values and
// slopes.
void cubic(const double values[2], const double slopes[2], double distance, double out[4]) {
  const double rise = values[1] - values[0], first = slopes[0] * distance, second = slopes[1] * distance;
  out[0] = values[0], out[1] = first, out[2] = 3.0 * rise - 2.0 * first - second, out[3] = first + second - 2.0 * rise;
}

}  // namespace

OuterSurface::Lines::Lines(double first_one, double last_one, std::size_t lines)
    : first(first_one), distance((last_one - first_one) / static_cast<double>(lines - 1)), per_distance(1.0 / distance),
      last(lines - 2) {}

inline std::size_t OuterSurface::Lines::before(double place, double& beyond) const {
  const double even = (place - first) * per_distance;
  const auto found = static_cast<std::size_t>(std::min(std::max(even, 0.0), static_cast<double>(last)));
  beyond = even - static_cast<double>(found);
  return found;
}

OuterSurface OuterSurface::quadric(const Rectangle& sheet, double p, double q, double c) {
  OuterSurface made;
  made.kind_ = Kind::quadric;
  made.sheet_ = sheet;
  made.numbers_[0] = p, made.numbers_[1] = q, made.numbers_[2] = c;
  return made;
}

OuterSurface OuterSurface::patch(const Rectangle& sheet, std::size_t count_x, std::size_t count_y, const double* jets) {
  OuterSurface made;
  made.kind_ = Kind::patch;
  made.sheet_ = sheet;
  made.x_ = Lines(sheet.west, sheet.east, count_x), made.y_ = Lines(sheet.south, sheet.north, count_y);
  made.cells_.resize((count_x - 1) * (count_y - 1));
  auto* cell = made.cells_.data();
  for (std::size_t row = 0; row + 1 < count_y; ++row) {
    for (std::size_t column = 0; column + 1 < count_x; ++column, ++cell) {
      // First along x on both lines, for the surface and its slope along y; then along y, for each coefficient.
      double heights[2][4], slopes[2][4];
      for (std::size_t j = 0; j < 2; ++j) {
        const double *west = jets + 4 * ((row + j) * count_x + column), *east = west + 4;
        const double of[4][2] = {{west[0], east[0]}, {west[1], east[1]}, {west[2], east[2]}, {west[3], east[3]}};
        cubic(of[0], of[1], made.x_.distance, heights[j]);
        cubic(of[2], of[3], made.x_.distance, slopes[j]);
      }
      for (std::size_t i = 0; i < 4; ++i) {
        const double values[2] = {heights[0][i], heights[1][i]}, rises[2] = {slopes[0][i], slopes[1][i]};
        double powers[4];
        cubic(values, rises, made.y_.distance, powers);
        for (std::size_t j = 0; j < 4; ++j) cell->powers[j][i] = powers[j];
      }
    }
  }
  return made;
}

inline SurfacePoint OuterSurface::within(double x, double y) const {
  if (is_quadric()) {
    const double p = numbers_[0], q = numbers_[1], c = numbers_[2];
    const double away = p * x * x + q * y * y, root = std::sqrt(1.0 - away);
    // The form c (root - 1) would lose digits if the surface is nearly flat.
    return {-c * away / (1.0 + root), {-c * p * x / root, -c * q * y / root}};
  }
  double s = 0.0, t = 0.0;
  const std::size_t column = x_.before(x, s), row = y_.before(y, t);
  const auto& powers = cells_[row * (x_.last + 1) + column].powers;
  double values[4], slopes[4];   // along x, of each power along y
  for (std::size_t j = 0; j < 4; ++j) {
    const double* c = powers[j];
    values[j] = c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    slopes[j] = c[1] + s * (2.0 * c[2] + s * (3.0 * c[3]));
  }
  return {values[0] + t * (values[1] + t * (values[2] + t * values[3])),
          {(slopes[0] + t * (slopes[1] + t * (slopes[2] + t * slopes[3]))) * x_.per_distance,
           (values[1] + t * (2.0 * values[2] + t * (3.0 * values[3]))) * y_.per_distance}};
}

SurfacePoint OuterSurface::at(double x, double y) const {
  if (is_flat()) return {0.0, {0.0, 0.0}};
  const Point near = sheet_.nearest({x, y});
  SurfacePoint found = within(near.x, near.y);
  found.z += found.slopes[0] * (x - near.x) + found.slopes[1] * (y - near.y);
  return found;
}

}  // namespace mjtactile
