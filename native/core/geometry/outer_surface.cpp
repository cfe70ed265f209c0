#include "geometry/outer_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mjtactile {
namespace {

// Hermite's cubics on a piece of a line, and their derivatives: of values and slopes at its ends.
struct Hermite {
  double values[4], slopes[4];

  Hermite(double at, double length) {
    const double s = at, t = 1.0 - at;
    const double of_values[4] = {t * t * (1.0 + 2.0 * s), s * s * (1.0 + 2.0 * t), s * t * t * length,
                                 -s * s * t * length};
    const double of_slopes[4] = {-6.0 * s * t / length, 6.0 * s * t / length, t * (1.0 - 3.0 * s), s * (3.0 * s - 2.0)};
    std::copy(of_values, of_values + 4, values);
    std::copy(of_slopes, of_slopes + 4, slopes);
  }
};

std::size_t piece(const std::vector<double>& ends, double at) {
  const auto after = std::upper_bound(ends.begin() + 1, ends.end() - 1, at);
  return static_cast<std::size_t>(after - ends.begin()) - 1;
}

}  // namespace

OuterSurface OuterSurface::quadric(const Rectangle& sheet, double p, double q, double c) {
  OuterSurface made;
  made.kind_ = Kind::quadric;
  made.sheet_ = sheet;
  made.numbers_[0] = p, made.numbers_[1] = q, made.numbers_[2] = c;
  return made;
}

OuterSurface OuterSurface::patch(std::vector<double> x, std::vector<double> y, std::vector<double> jets) {
  OuterSurface made;
  made.kind_ = Kind::patch;
  made.sheet_ = {x.front(), y.front(), x.back(), y.back()};
  made.x_ = std::move(x), made.y_ = std::move(y), made.jets_ = std::move(jets);
  return made;
}

SurfacePoint OuterSurface::at(double x, double y) const {
  if (is_flat()) return {0.0, {0.0, 0.0}};
  const double near_x = std::min(std::max(x, sheet_.west), sheet_.east);
  const double near_y = std::min(std::max(y, sheet_.south), sheet_.north);
  SurfacePoint found = within(near_x, near_y);
  found.z += found.slopes[0] * (x - near_x) + found.slopes[1] * (y - near_y);
  return found;
}

SurfacePoint OuterSurface::within(double x, double y) const {
  if (is_quadric()) {
    const double p = numbers_[0], q = numbers_[1], c = numbers_[2];
    const double away = p * x * x + q * y * y, root = std::sqrt(1.0 - away);
    // c (root - 1) loses digits where the surface is nearly flat.
    return {-c * away / (1.0 + root), {-c * p * x / root, -c * q * y / root}};
  }
  const std::size_t column = piece(x_, x), row = piece(y_, y);
  const double width = x_[column + 1] - x_[column], height = y_[row + 1] - y_[row];
  const Hermite along((x - x_[column]) / width, width), across((y - y_[row]) / height, height);
  SurfacePoint found = {0.0, {0.0, 0.0}};
  for (std::size_t j = 0; j < 2; ++j) {
    for (std::size_t i = 0; i < 2; ++i) {
      const double* jet = jets_.data() + 4 * ((row + j) * x_.size() + column + i);
      const double value = jet[0] * along.values[i] + jet[1] * along.values[2 + i];
      const double twist = jet[2] * along.values[i] + jet[3] * along.values[2 + i];
      const double value_x = jet[0] * along.slopes[i] + jet[1] * along.slopes[2 + i];
      const double twist_x = jet[2] * along.slopes[i] + jet[3] * along.slopes[2 + i];
      found.z += value * across.values[j] + twist * across.values[2 + j];
      found.slopes[0] += value_x * across.values[j] + twist_x * across.values[2 + j];
      found.slopes[1] += value * across.slopes[j] + twist * across.slopes[2 + j];
    }
  }
  return found;
}

}  // namespace mjtactile
