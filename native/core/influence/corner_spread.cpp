#include "influence/corner_spread.hpp"

#include <algorithm>

#include "linalg/dense.hpp"
#include "linalg/kernels.hpp"

namespace mjtactile {

CornerSpread::CornerSpread(const std::vector<double>& ends_x, const std::vector<double>& ends_y)
    : x_(axis(ends_x)), y_(axis(ends_y)) {}

CornerSpread::Axis CornerSpread::axis(const std::vector<double>& ends) {
  Axis made = {ends.size(), 2 * ends.size() - 1, {0}, {}, {}};
  const std::size_t count = std::min(kMost, ends.size());
  for (std::size_t corner = 0; corner < ends.size(); ++corner) {
    const auto add = [&](std::size_t node, double weight) {
      made.places.push_back(static_cast<std::uint32_t>(node));
      made.weights.push_back(weight);
    };
    for (std::size_t e = 0; e + 1 < ends.size(); ++e) {
      if (e == corner) add(2 * corner, 1.0);
      const std::size_t first = std::min(e > 0 ? e - 1 : 0, ends.size() - count);
      if (corner < first || corner >= first + count) continue;
      const double at = (ends[e] + ends[e + 1]) / 2;
      double weight = 1.0;
      for (std::size_t other = first; other < first + count; ++other) {
        if (other != corner) weight *= (at - ends[other]) / (ends[corner] - ends[other]);
      }
      add(2 * e + 1, weight);
    }
    if (corner + 1 == ends.size()) add(2 * corner, 1.0);
    made.starts.push_back(static_cast<std::uint32_t>(made.places.size()));
  }
  return made;
}

void CornerSpread::spread(const double* nodal, std::vector<double>& row, std::vector<double>& corners) const {
  const std::size_t width = 3 * x_.nodes;
  static thread_local std::vector<std::uint8_t> empty;  // kept between calls so that a step allocates nothing
  empty.resize(y_.nodes);
  for (std::size_t y = 0; y < y_.nodes; ++y) empty[y] = is_zero(nodal + y * width, width) ? 1 : 0;
  corners.resize(3 * y_.corners * x_.corners);
  for (std::size_t y = 0; y < y_.corners; ++y) {
    const double* rows[kMostNodes];
    double weights[kMostNodes];
    std::size_t used = 0;
    for (std::uint32_t i = y_.starts[y]; i < y_.starts[y + 1]; ++i) {
      if (!empty[y_.places[i]]) rows[used] = nodal + y_.places[i] * width, weights[used++] = y_.weights[i];
    }
    double* to = corners.data() + 3 * y * x_.corners;
    if (used == 0) {
      std::fill(to, to + 3 * x_.corners, 0.0);
      continue;
    }
    row.assign(width, 0.0);
    kernels().add_double(rows, weights, used, width, row.data());
    kernels().sum_weighted_vectors(row.data(), x_.starts.data(), x_.places.data(), x_.weights.data(), x_.corners, to);
  }
}

}  // namespace mjtactile
