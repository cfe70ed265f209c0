#include "geometry/outer_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mjtactile {
namespace {

// Hermite's cubics between two lines, and their derivatives: of values and slopes on them. `at`: in parts of the distance.
struct Hermite {
  double values[4], slopes[4];

  Hermite(double at, double distance, double per_distance) {
    const double s = at, t = 1.0 - at, bent = 6.0 * s * t * per_distance;
    const double of_values[4] = {t * t * (1.0 + 2.0 * s), s * s * (1.0 + 2.0 * t), s * t * t * distance,
                                 -s * s * t * distance};
    const double of_slopes[4] = {-bent, bent, t * (1.0 - 3.0 * s), s * (3.0 * s - 2.0)};
    std::copy(of_values, of_values + 4, values);
    std::copy(of_slopes, of_slopes + 4, slopes);
  }
};

}  // namespace

OuterSurface::Lines::Lines(std::vector<double> places) : at(std::move(places)) {
  for (std::size_t i = 0; i + 1 < at.size(); ++i) per_distance.push_back(1.0 / (at[i + 1] - at[i]));
  per_mean = static_cast<double>(per_distance.size()) / (at.back() - at.front());
}

std::size_t OuterSurface::Lines::before(double place) const {
  // Where evenly spaced lines would have it, and from there on.
  const std::size_t last = per_distance.size() - 1;
  const double even = (place - at.front()) * per_mean;
  auto found = static_cast<std::size_t>(std::min(std::max(even, 0.0), static_cast<double>(last)));
  while (found > 0 && place < at[found]) --found;
  while (found < last && place > at[found + 1]) ++found;
  return found;
}

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
  made.x_ = Lines(std::move(x)), made.y_ = Lines(std::move(y)), made.jets_ = std::move(jets);
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
  const std::size_t column = x_.before(x), row = y_.before(y);
  const double per_width = x_.per_distance[column], per_height = y_.per_distance[row];
  const Hermite along((x - x_.at[column]) * per_width, x_.at[column + 1] - x_.at[column], per_width);
  const Hermite across((y - y_.at[row]) * per_height, y_.at[row + 1] - y_.at[row], per_height);
  SurfacePoint found = {0.0, {0.0, 0.0}};
  for (std::size_t j = 0; j < 2; ++j) {
    for (std::size_t i = 0; i < 2; ++i) {
      const double* jet = jets_.data() + 4 * ((row + j) * x_.at.size() + column + i);
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
