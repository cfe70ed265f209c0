#include "plugin/outer_surface.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile::mujoco {
namespace {

// Where a coordinate lies between samples: the one before it, and the share of the way to the next.
struct Between {
  std::size_t before;
  double share;
};

Between between(double at, double half, std::size_t count) {
  const double cells = static_cast<double>(count - 1);
  const double place = std::clamp((at / half + 1.0) / 2.0 * cells, 0.0, cells);
  const std::size_t before = std::min(static_cast<std::size_t>(place), count - 2);
  return {before, place - static_cast<double>(before)};
}

}  // namespace

OuterSurface::OuterSurface(const double* samples, std::size_t rows, std::size_t columns, const double* half_size)
    : rows_(rows), columns_(columns), half_{half_size[0], half_size[1]} {
  if (samples != nullptr && rows > 1 && columns > 1) samples_.assign(samples, samples + 4 * rows * columns);
}

OuterSurface::Point OuterSurface::at(double x, double y) const {
  if (flat()) return {0.0, {0.0, 0.0, 1.0}};
  const Between along = between(x, half_[0], columns_), across = between(y, half_[1], rows_);
  double mean[4] = {};
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      const double share = (i == 0 ? 1.0 - across.share : across.share) * (j == 0 ? 1.0 - along.share : along.share);
      const double* sample = samples_.data() + 4 * ((across.before + i) * columns_ + along.before + j);
      for (int k = 0; k < 4; ++k) mean[k] += share * sample[k];
    }
  }
  const double length = std::sqrt(mean[1] * mean[1] + mean[2] * mean[2] + mean[3] * mean[3]);
  return {mean[0], {mean[1] / length, mean[2] / length, mean[3] / length}};
}

}  // namespace mjtactile::mujoco
