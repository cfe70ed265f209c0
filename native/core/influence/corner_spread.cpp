#include "influence/corner_spread.hpp"

#include <algorithm>

namespace mjtactile {

CornerSpread::CornerSpread(const std::vector<double>& ends_x, const std::vector<double>& ends_y)
    : x_(axis(ends_x)), y_(axis(ends_y)) {}

CornerSpread::Axis CornerSpread::axis(const std::vector<double>& ends) {
  Axis made = {ends.size(), 2 * ends.size() - 1, {}};
  const std::size_t count = std::min(kMost, ends.size());
  for (std::size_t e = 0; e + 1 < ends.size(); ++e) {
    Middle middle = {std::min(e > 0 ? e - 1 : 0, ends.size() - count), count, {}};
    const double at = (ends[e] + ends[e + 1]) / 2;
    for (std::size_t a = 0; a < count; ++a) {
      middle.weights[a] = 1.0;
      for (std::size_t b = 0; b < count; ++b) {
        const double other = ends[middle.first + b];
        if (b != a) middle.weights[a] *= (at - other) / (ends[middle.first + a] - other);
      }
    }
    made.middles.push_back(middle);
  }
  return made;
}

void CornerSpread::spread(const double* nodal, std::vector<double>& rows, std::vector<double>& corners) const {
  // Across rows first, so that all arithmetic is on runs of memory; most rows are empty and cost a look.
  const std::size_t width = 3 * x_.nodes;
  rows.assign(y_.corners * width, 0.0);
  corners.assign(3 * y_.corners * x_.corners, 0.0);
  std::size_t first_used = y_.corners, last_used = 0;
  const auto add = [&](std::size_t corner, double weight, const double* from) {
    double* to = rows.data() + corner * width;
    for (std::size_t i = 0; i < width; ++i) to[i] += weight * from[i];
    first_used = std::min(first_used, corner);
    last_used = std::max(last_used, corner + 1);
  };
  for (std::size_t y = 0; y < y_.nodes; ++y) {
    const double* from = nodal + y * width;
    if (std::all_of(from, from + width, [](double force) { return force == 0.0; })) continue;
    if (y % 2 == 0) {
      add(y / 2, 1.0, from);
    } else {
      const Middle& middle = y_.middles[y / 2];
      for (std::size_t a = 0; a < middle.count; ++a) add(middle.first + a, middle.weights[a], from);
    }
  }
  for (std::size_t y = first_used; y < last_used; ++y) {
    const double* from = rows.data() + y * width;
    double* to = corners.data() + 3 * y * x_.corners;
    for (std::size_t x = 0; x < x_.corners; ++x) {
      for (std::size_t i = 0; i < 3; ++i) to[3 * x + i] += from[6 * x + i];
    }
    for (std::size_t e = 0; e < x_.middles.size(); ++e) {
      const Middle& middle = x_.middles[e];
      const double* force = from + 6 * e + 3;
      if (force[0] == 0.0 && force[1] == 0.0 && force[2] == 0.0) continue;
      for (std::size_t a = 0; a < middle.count; ++a) {
        for (std::size_t i = 0; i < 3; ++i) to[3 * (middle.first + a) + i] += middle.weights[a] * force[i];
      }
    }
  }
}

}  // namespace mjtactile
