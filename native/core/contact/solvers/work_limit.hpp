// A bound on the time of one contact.
#pragma once

#include <cstddef>

namespace mjtactile {

// A limit on the multiplications of all factorisations for one contact. It bounds the time of a step in the same way on
// every machine. What is factored already counts as well: how much of a factor is kept depends on the order of the
// cells, which must not decide whether a contact is found.
class WorkLimit {
 public:
  void allow(double multiplications) { left_ = multiplications; }
  // Subtract the work of factoring a symmetric matrix. Returns whether it was still allowed.
  bool factorisation(std::size_t size) {
    left_ -= work(size);
    return left_ >= 0.0;
  }
  // Whether `count` such factorisations are still allowed.
  bool leaves(std::size_t size, double count) const { return left_ >= count * work(size); }

 private:
  static double work(std::size_t size) {
    const auto n = static_cast<double>(size);
    // Including the gathering and the products that go with a factorisation.
    return n * n * n / 6.0 + 10.0 * n * n;
  }

  double left_ = 0.0;
};

}  // namespace mjtactile
