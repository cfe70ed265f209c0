// Fixed points x = g(x) of maps that hardly bend, in fewer rounds than by putting g(x) in again.
#pragma once

#include <cstddef>
#include <vector>

namespace mjtactile {

// Anderson's mixing (J. ACM 12, 1965; Walker, Ni, SIAM J. Numer. Anal. 49, 2011): the combination of the last points
// whose residuals g(x) - x nearly cancel, were the map linear.
class SecantMixing {
 public:
  // The map is another.
  void forget() { kept_ = 0, newest_ = kDepth - 1, known_ = false; }
  // `point` is the last one tried, and becomes the next to try; `image` is what the map made of it.
  void next(const std::vector<double>& image, std::vector<double>& point);

 private:
  static constexpr std::size_t kDepth = 3;

  std::size_t kept_ = 0, newest_ = kDepth - 1;
  bool known_ = false;
  // Of the last round, and how both changed in those before.
  std::vector<double> residual_, image_, residual_changes_[kDepth], image_changes_[kDepth];
};

}  // namespace mjtactile
