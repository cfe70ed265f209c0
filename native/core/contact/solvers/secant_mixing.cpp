#include "contact/solvers/secant_mixing.hpp"

#include <algorithm>

#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Combinations of the residuals' changes that are smaller than the others by this factor are rounding and are not used.
constexpr double kOpen = 1e-14;

}  // namespace

void SecantMixing::next(const std::vector<double>& image, std::vector<double>& point) {
  const std::size_t size = point.size();
  if (residual_.size() != size) forget();
  if (known_) {
    newest_ = (newest_ + 1) % kDepth;
    kept_ = std::min(kept_ + 1, kDepth);
    std::vector<double>&changes = residual_changes_[newest_], &images = image_changes_[newest_];
    changes.resize(size);
    images.resize(size);
    for (std::size_t i = 0; i < size; ++i) {
      changes[i] = image[i] - point[i] - residual_[i];
      images[i] = image[i] - image_[i];
    }
  }
  residual_.resize(size);
  for (std::size_t i = 0; i < size; ++i) residual_[i] = image[i] - point[i];
  image_ = image;
  point = image;
  known_ = true;
  if (kept_ == 0) return;
  double gram[kDepth * kDepth], along[kDepth], shares[kDepth];
  for (std::size_t a = 0; a < kept_; ++a) {
    along[a] = dot(residual_changes_[a].data(), residual_.data(), size);
    for (std::size_t b = 0; b < kept_; ++b) {
      gram[a * kept_ + b] = dot(residual_changes_[a].data(), residual_changes_[b].data(), size);
    }
  }
  solve_semidefinite(kept_, gram, kOpen, along, shares);
  for (std::size_t a = 0; a < kept_; ++a) {
    for (std::size_t i = 0; i < size; ++i) point[i] -= shares[a] * image_changes_[a][i];
  }
}

}  // namespace mjtactile
