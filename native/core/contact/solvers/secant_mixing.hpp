// Fixed points x = g(x) of nearly linear maps, in fewer rounds than by plain iteration.
#pragma once

#include <cstddef>
#include <vector>

namespace mjtactile {

// Anderson's mixing (J. ACM 12, 1965; Walker, Ni, SIAM J. Numer. Anal. 49, 2011). The next point is the combination of
// the last ones whose residual g(x) - x would be least if the map were linear.
class SecantMixing {
 public:
  // Forget all points. Call this before another map.
  void forget() { kept_ = 0, newest_ = kDepth - 1, known_ = false; }
  // Replace `point`, the last one tried, by the next one to try; `image` is g(point).
  void next(const std::vector<double>& image, std::vector<double>& point);

 private:
  static constexpr std::size_t kDepth = 3;

  std::size_t kept_ = 0, newest_ = kDepth - 1;
  bool known_ = false;
  // Residual and image of the last round, and their changes in the rounds before.
  std::vector<double> residual_, image_, residual_changes_[kDepth], image_changes_[kDepth];
};

}  // namespace mjtactile
