#include "compliance.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kernels.hpp"

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

void SurfaceCompliance::normal(const double* centroids, const double* areas, std::size_t cells,
                               const double* inverse_distance, double scale, Workspace& workspace,
                               Matrix& compliance) const {
  constexpr std::size_t kBlock = 16;
  const std::size_t columns = x_.patches(), patches = columns * y_.patches();
  workspace.weights.resize(cells, patches);
  workspace.transposed.resize(patches, cells);
  workspace.through.resize(cells, patches);
  workspace.x.resize(columns);
  workspace.y.resize(y_.patches());
  for (std::size_t i = 0; i < cells; ++i) {
    x_.weights(centroids[2 * i], workspace.x.data());
    y_.weights(centroids[2 * i + 1], workspace.y.data());
    double* weights = workspace.weights[i];
    for (std::size_t row = 0; row < y_.patches(); ++row) {
      for (std::size_t column = 0; column < columns; ++column) {
        *weights++ = workspace.y[row] * workspace.x[column];
      }
    }
  }
  for (std::size_t p = 0; p < patches; ++p) {
    double* to = workspace.transposed[p];
    for (std::size_t i = 0; i < cells; ++i) to[i] = workspace.weights[i][p];
  }
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
}

}  // namespace mjtactile
