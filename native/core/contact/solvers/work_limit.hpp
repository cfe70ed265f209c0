// A bound on the time of one contact.
#pragma once

#include <cstddef>

namespace mjtactile {

// A limit on the multiplications of all factorisations for one contact. It bounds the time of a step in the same way on
// every machine.
class WorkLimit {
 public:
  void allow(double multiplications) { left_ = multiplications; }
  // Subtract the work of factoring a symmetric matrix whose first `known` rows are factored already. Returns whether it
  // was still allowed. How many rows are kept may depend on the order of equal cells, which must not decide whether a
  // contact is found: `known` must not.
  bool factorisation(std::size_t size, std::size_t known = 0) {
    left_ -= work(size, known);
    return left_ >= 0.0;
  }
  // Whether `count` such factorisations are still allowed.
  bool leaves(std::size_t size, double count) const { return left_ >= count * work(size, 0); }

 private:
  static double work(std::size_t size, std::size_t known) {
    const auto n = static_cast<double>(size), k = static_cast<double>(known);
    // Including the gathering and the products that go with a factorisation.
    return n * n * n / 6.0 - k * k * (n / 2.0 - k / 3.0) + 10.0 * n * n;
  }

  double left_ = 0.0;
};

}  // namespace mjtactile
