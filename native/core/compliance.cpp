#include "compliance.hpp"

#include <algorithm>
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

void SurfaceCompliance::normal(const double* centroids, const double* areas, std::size_t cells,
                               const double* inverse_distance, double scale, Workspace& workspace,
                               Matrix& compliance) const {
  const std::size_t columns = x_.patches(), patches = columns * y_.patches();
  workspace.weights.resize(cells, patches);
  workspace.transposed.resize(patches, cells);
  workspace.through.resize(1, patches);
  workspace.x.resize(columns);
  workspace.y.resize(y_.patches());
  for (std::size_t i = 0; i < cells; ++i) {
    x_.weights(centroids[2 * i], workspace.x.data());
    y_.weights(centroids[2 * i + 1], workspace.y.data());
    double* weights = workspace.weights[i];
    for (std::size_t p = 0; p < patches; ++p) {
      weights[p] = workspace.y[p / columns] * workspace.x[p % columns];
      workspace.transposed[p][i] = weights[p];
    }
  }
  compliance.resize(cells, cells);
  const double cube = factor_ * scale * scale * scale;
  workspace.rows.resize(patches);
  double* through = workspace.through[0];
  for (std::size_t i = 0; i < cells; ++i) {
    std::fill(through, through + patches, 0.0);
    add_rows(remainder_, workspace.weights[i], patches, through);
    double* row = compliance[i];
    const double* near = inverse_distance + i * cells;
    const double own = cube / areas[i];
    for (std::size_t j = i; j < cells; ++j) row[j] = own * near[j] / areas[j];
    for (std::size_t p = 0; p < patches; ++p) workspace.rows[p] = workspace.transposed[p] + i;
    kernels().add_double(workspace.rows.data(), through, patches, cells - i, row + i);
  }
}

}  // namespace mjtactile
