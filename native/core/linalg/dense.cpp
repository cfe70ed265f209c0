#include "linalg/dense.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/kernels.hpp"

namespace mjtactile {

bool factor(Matrix& matrix) {
  // Row blocks: what lies above a block is taken off it in one product, then it is factored by itself.
  constexpr std::size_t kBlock = 16;
  const std::size_t size = matrix.rows(), stride = matrix.stride();
  double* u = matrix.data();
  static thread_local std::vector<double> above;  // kept between calls: nothing is allocated in a step
  for (std::size_t first = 0; first < size; first += kBlock) {
    const std::size_t last = std::min(first + kBlock, size);
    if (first > 0) {
      above.resize(first * (last - first));
      for (std::size_t k = 0; k < first; ++k) {
        for (std::size_t i = first; i < last; ++i) above[k * (last - first) + i - first] = -u[k * stride + i];
      }
      kernels().multiply_add(above.data(), 1, last - first, u + first, stride, u + first * stride + first,
                             stride, last - first, stride - first, first);
    }
    for (std::size_t i = first; i < last; ++i) {
      double* row = u + i * stride;
      if (!(row[i] > 0.0) || !std::isfinite(row[i])) return false;
      const double pivot = std::sqrt(row[i]), inverse = 1.0 / pivot;
      row[i] = pivot;
      for (std::size_t j = i + 1; j < size; ++j) row[j] *= inverse;
      for (std::size_t below = i + 1; below < last; ++below) {
        const double share = row[below];
        double* to = u + below * stride;
        for (std::size_t j = below; j < size; ++j) to[j] -= share * row[j];
      }
    }
  }
  return true;
}

void solve_forward(const Matrix& upper, Matrix& right) {
  constexpr std::size_t kBlock = 16;
  const std::size_t size = upper.rows(), sides = right.rows();
  static thread_local std::vector<double> known;  // kept between calls: nothing is allocated in a step
  known.resize(sides * kBlock);
  for (std::size_t first = 0; first < size; first += kBlock) {
    const std::size_t last = std::min(first + kBlock, size);
    for (std::size_t s = 0; s < sides; ++s) {
      double* x = right[s];
      for (std::size_t i = first; i < last; ++i) {
        x[i] /= upper[i][i];
        known[s * kBlock + i - first] = -x[i];
        for (std::size_t j = i + 1; j < last; ++j) x[j] -= upper[i][j] * x[i];
      }
    }
    // What the block takes off all that follows, in one product.
    kernels().multiply_add(known.data(), kBlock, 1, upper[first] + last, upper.stride(), right.data() + last,
                           right.stride(), sides, right.stride() - last, last - first);
  }
}

void solve_backward(const Matrix& upper, double* x) {
  const std::size_t size = upper.rows();
  for (std::size_t i = size; i-- > 0;) {
    const double* row = upper[i];
    // Eight sums side by side: one would wait for itself.
    double sums[8] = {};
    std::size_t j = i + 1;
    for (; j + 8 <= size; j += 8) {
      for (std::size_t k = 0; k < 8; ++k) sums[k] += row[j + k] * x[j + k];
    }
    for (; j < size; ++j) sums[0] += row[j] * x[j];
    for (std::size_t k = 1; k < 8; ++k) sums[0] += sums[k];
    x[i] = (x[i] - sums[0]) / row[i];
  }
}

}  // namespace mjtactile
