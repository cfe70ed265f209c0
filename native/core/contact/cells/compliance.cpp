#include "contact/cells/compliance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "linalg/kernels.hpp"

namespace mjtactile {

AveragingSpline::AveragingSpline(std::vector<double> ends, std::vector<double> coefficients)
    : ends_(std::move(ends)), coefficients_(std::move(coefficients)) {}

void AveragingSpline::weights(double at, double* weights) const {
  const auto after = std::upper_bound(ends_.begin() + 1, ends_.end() - 1, at);
  const std::size_t interval = static_cast<std::size_t>(after - ends_.begin()) - 1, count = patches();
  const double local = at - ends_[interval];
  const double* square = coefficients_.data() + interval * count;
  const double* linear = square + count * count;
  const double* constant = linear + count * count;
  for (std::size_t i = 0; i < count; ++i) weights[i] = (square[i] * local + linear[i]) * local + constant[i];
}

SurfaceCompliance::SurfaceCompliance(double factor, AveragingSpline x, AveragingSpline y, Matrix remainder)
    : factor_(factor), x_(std::move(x)), y_(std::move(y)), remainder_(std::move(remainder)) {}

void SurfaceCompliance::set_foundation(std::vector<double> areas, std::vector<double> stiffnesses) {
  areas_ = std::move(areas);
  stiffnesses_ = std::move(stiffnesses);
}

double SurfaceCompliance::foundation_stiffness(double area) const {
  const double at = std::log(area);
  // Small contacts feel a half space, on which stiffness per area falls with the radius.
  if (at <= areas_.front()) return std::exp(stiffnesses_.front() + 0.5 * (areas_.front() - at));
  if (at >= areas_.back()) return std::exp(stiffnesses_.back());
  const auto i = static_cast<std::size_t>(std::upper_bound(areas_.begin(), areas_.end(), at) - areas_.begin());
  const double part = (at - areas_[i - 1]) / (areas_[i] - areas_[i - 1]);
  return std::exp(stiffnesses_[i - 1] + part * (stiffnesses_[i] - stiffnesses_[i - 1]));
}

void SurfaceCompliance::set_tangential(double poisson, Matrix remainder) {
  poisson_ = poisson;
  full_remainder_ = std::move(remainder);
}

void SurfaceCompliance::weigh(const double* points, std::size_t per_cell, std::size_t cells,
                              Workspace& workspace) const {
  const std::size_t columns = x_.patches(), patches = columns * y_.patches();
  workspace.weights.resize(cells, patches);
  workspace.transposed.resize(patches, cells);
  workspace.x.resize(columns);
  workspace.y.resize(y_.patches());
  for (std::size_t i = 0; i < cells; ++i) {
    std::fill(workspace.weights[i], workspace.weights[i] + patches, 0.0);
    for (std::size_t k = 0; k < per_cell; ++k) {
      const double* point = points + 2 * (per_cell * i + k);
      x_.weights(point[0], workspace.x.data());
      y_.weights(point[1], workspace.y.data());
      double* weights = workspace.weights[i];
      for (std::size_t row = 0; row < y_.patches(); ++row) {
        const double share = workspace.y[row] / static_cast<double>(per_cell);
        for (std::size_t column = 0; column < columns; ++column) *weights++ += share * workspace.x[column];
      }
    }
  }
  for (std::size_t p = 0; p < patches; ++p) {
    double* to = workspace.transposed[p];
    for (std::size_t i = 0; i < cells; ++i) to[i] = workspace.weights[i][p];
  }
}

void SurfaceCompliance::normal(const double* points, std::size_t per_cell, const double* areas, std::size_t cells,
                               const double* inverse_distance, double scale, Workspace& workspace,
                               Matrix& compliance) const {
  constexpr std::size_t kBlock = 16;
  const std::size_t patches = x_.patches() * y_.patches();
  weigh(points, per_cell, cells, workspace);
  workspace.through.resize(cells, patches);
  Matrix& through = workspace.through;
  std::fill(through.data(), through.data() + cells * through.stride(), 0.0);
  kernels().multiply_add(workspace.weights.data(), workspace.weights.stride(), 1, remainder_.data(),
                         remainder_.stride(), through.data(), through.stride(), cells, through.stride(), patches);
  compliance.resize(cells, cells);
  const double cube = factor_ * scale * scale * scale;
  for (std::size_t first = 0; first < cells; first += kBlock) {
    const std::size_t last = std::min(first + kBlock, cells);
    for (std::size_t i = first; i < last; ++i) {
      const double own = cube / areas[i];
      const double* near = inverse_distance + i * cells;
      double* row = compliance[i];
      for (std::size_t j = first; j < cells; ++j) row[j] = own * near[j] / areas[j];
    }
    kernels().multiply_add(through[first], through.stride(), 1, workspace.transposed.data() + first,
                           workspace.transposed.stride(), compliance[first] + first, compliance.stride(),
                           last - first, compliance.stride() - first, patches);
  }
  for (std::size_t i = 0; i < cells; ++i) {
    for (std::size_t j = 0; j < i; ++j) compliance[i][j] = compliance[j][i];
  }
}

void SurfaceCompliance::full(const double* centroids, const double* areas, std::size_t cells,
                             const double* inverse_distance, const ShearIntegrals& integrals, double cosine,
                             double sine, Workspace& workspace, Matrix& compliance) const {
  const std::size_t patches = x_.patches() * y_.patches();
  weigh(centroids, 1, cells, workspace);
  compliance.resize(3 * cells, 3 * cells);
  // Surface response to a point force (Johnson 1985, eqs. 3.18 and 3.75 to 3.77), z out of the pad.
  const double share = poisson_ / (1.0 - poisson_), slope = (1.0 - 2.0 * poisson_) / (2.0 * (1.0 - poisson_));
  const double cc = cosine * cosine, cs = cosine * sine, ss = sine * sine;
  for (std::size_t i = 0; i < cells; ++i) {
    double *x = compliance[i], *y = compliance[cells + i], *z = compliance[2 * cells + i];
    for (std::size_t j = 0; j < cells; ++j) {
      const std::size_t at = i * cells + j;
      const double per_area = factor_ / (areas[i] * areas[j]), distance = inverse_distance[at];
      const double xx = cc * integrals.xx[at] - 2.0 * cs * integrals.xy[at] + ss * integrals.yy[at];
      const double yy = ss * integrals.xx[at] + 2.0 * cs * integrals.xy[at] + cc * integrals.yy[at];
      const double xy = cs * (integrals.xx[at] - integrals.yy[at]) + (cc - ss) * integrals.xy[at];
      const double along = cosine * integrals.along[at] - sine * integrals.across[at];
      const double across = sine * integrals.along[at] + cosine * integrals.across[at];
      x[j] = per_area * (distance + share * yy);
      y[cells + j] = per_area * (distance + share * xx);
      x[cells + j] = -per_area * share * xy;
      z[2 * cells + j] = per_area * distance;
      x[2 * cells + j] = per_area * slope * along;
      y[2 * cells + j] = per_area * slope * across;
    }
  }
  Matrix &through = workspace.through, &block = workspace.block;
  block.resize(cells, cells);
  for (std::size_t a = 0; a < 3; ++a) {
    // Blocks right of the diagonal, and the one on it.
    through.resize(cells, (3 - a) * patches);
    std::fill(through.data(), through.data() + cells * through.stride(), 0.0);
    kernels().multiply_add(workspace.weights.data(), workspace.weights.stride(), 1,
                           full_remainder_[a * patches] + a * patches, full_remainder_.stride(), through.data(),
                           through.stride(), cells, through.columns(), patches);
    for (std::size_t b = a; b < 3; ++b) {
      std::fill(block.data(), block.data() + cells * block.stride(), 0.0);
      kernels().multiply_add(through.data() + (b - a) * patches, through.stride(), 1, workspace.transposed.data(),
                             workspace.transposed.stride(), block.data(), block.stride(), cells, block.stride(),
                             patches);
      for (std::size_t i = 0; i < cells; ++i) {
        double* row = compliance[a * cells + i] + b * cells;
        for (std::size_t j = 0; j < cells; ++j) row[j] += block[i][j];
      }
    }
  }
  for (std::size_t i = 0; i < 3 * cells; ++i) {
    for (std::size_t j = 0; j < i; ++j) compliance[i][j] = compliance[j][i];
  }
}

void SurfaceCompliance::add_sinking(const double* points, std::size_t count, const double* centroids,
                                    const double* areas, const double* forces, std::size_t cells, Workspace& workspace,
                                    double* sunk) const {
  // The mean of 1/r over a square of side s from its middle is 4 ln(1 + sqrt 2) / s.
  const double own = 4.0 * std::log(1.0 + std::sqrt(2.0));
  const std::size_t columns = x_.patches(), patches = columns * y_.patches();
  workspace.x.resize(columns);
  workspace.y.resize(y_.patches());
  workspace.patches.assign(patches, 0.0);
  workspace.smooth.assign(patches, 0.0);
  const auto over_patches = [&](const double* at, auto&& visit) {
    x_.weights(at[0], workspace.x.data());
    y_.weights(at[1], workspace.y.data());
    for (std::size_t row = 0; row < y_.patches(); ++row) {
      for (std::size_t column = 0; column < columns; ++column) {
        visit(row * columns + column, workspace.y[row] * workspace.x[column]);
      }
    }
  };
  for (std::size_t j = 0; j < cells; ++j) {
    over_patches(centroids + 2 * j, [&](std::size_t p, double weight) { workspace.patches[p] += weight * forces[j]; });
  }
  for (std::size_t p = 0; p < patches; ++p) {
    for (std::size_t q = 0; q < patches; ++q) workspace.smooth[p] += remainder_[p][q] * workspace.patches[q];
  }
  for (std::size_t i = 0; i < count; ++i) {
    double sum = 0.0;
    for (std::size_t j = 0; j < cells; ++j) {
      const double x = points[2 * i] - centroids[2 * j], y = points[2 * i + 1] - centroids[2 * j + 1];
      sum += forces[j] / std::sqrt(x * x + y * y + areas[j] / (own * own));
    }
    sunk[i] += factor_ * sum;
    over_patches(points + 2 * i, [&](std::size_t p, double weight) { sunk[i] += weight * workspace.smooth[p]; });
  }
}

}  // namespace mjtactile
