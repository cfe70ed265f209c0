#include "linalg/dense.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "linalg/kernels.hpp"

namespace mjtactile {

namespace {

constexpr std::size_t kBlock = 16;         // rows and columns of the blocks that are transposed at once
constexpr std::size_t kZerosAtOnce = 32;   // numbers that are tested for zero at once

// Cholesky factorisation of the leading `size` rows of `u` in place, by blocks of rows. In the first `known` rows, a
// whole number of blocks, the first `known` columns hold their factor already and the other columns the matrix. The
// contribution of all rows above a block is subtracted in one product, then the block is factored.
bool factor_from(double* u, std::size_t stride, std::size_t size, std::size_t known) {
  static thread_local std::vector<double> above;  // kept between calls so that a step allocates nothing
  const std::size_t end = Matrix::padded(size);
  for (std::size_t first = 0; first < size; first += kFactorRows) {
    const std::size_t last = std::min(first + kFactorRows, size), begin = std::max(first, known);
    if (first > 0) {
      above.resize(first * (last - first));
      for (std::size_t k = 0; k < first; ++k) {
        for (std::size_t i = first; i < last; ++i) above[k * (last - first) + i - first] = -u[k * stride + i];
      }
      kernels().multiply_add(above.data(), 1, last - first, u + begin, stride, u + first * stride + begin, stride,
                             last - first, end - begin, first);
    }
    double* own = u + first * stride + first;
    if (first >= known && !kernels().factor_small(own, stride, last - first)) return false;
    const std::size_t right = std::max(last, known);
    if (right < size) kernels().eliminate(own, stride, u + first * stride + right, stride, end - right);
  }
  return true;
}

void solve_lower(const double* upper, std::size_t stride, std::size_t size, Matrix& right) {
  const std::size_t sides = right.rows();
  static thread_local std::vector<double> known;  // kept between calls so that a step allocates nothing
  known.resize(sides * kFactorRows);
  for (std::size_t first = 0; first < size; first += kFactorRows) {
    const std::size_t last = std::min(first + kFactorRows, size);
    for (std::size_t i = first; i < last; ++i) {
      const double* row = upper + i * stride;
      const double inverse = 1.0 / row[i];
      for (std::size_t s = 0; s < sides; ++s) {
        double* x = right[s];
        const double value = x[i] *= inverse;
        known[s * kFactorRows + i - first] = -value;
        for (std::size_t j = i + 1; j < last; ++j) x[j] -= row[j] * value;
      }
    }
    // Subtract the block's contribution from all later rows in one product.
    kernels().multiply_add(known.data(), kFactorRows, 1, upper + first * stride + last, stride, right.data() + last,
                           right.stride(), sides, Matrix::padded(size) - last, last - first);
  }
}

}  // namespace

bool is_zero(const double* run, std::size_t count) {
  for (std::size_t first = 0; first < count; first += kZerosAtOnce) {
    std::uint64_t any = 0;
    for (std::size_t i = first; i < std::min(first + kZerosAtOnce, count); ++i) {
      std::uint64_t bits;
      std::memcpy(&bits, run + i, sizeof bits);
      any |= bits << 1;  // drops the sign bit
    }
    if (any != 0) return false;
  }
  return true;
}

void add_product(const Matrix& symmetric, const double* x, double* sums) {
  const std::size_t size = symmetric.rows();
  kernels().add_window(symmetric.data(), 1, 0, size, symmetric.stride(), x, size, false, sums);
}

void transpose_part(const Matrix& from, std::size_t row, std::size_t row_end, std::size_t column,
                    std::size_t column_end, Matrix& to) {
  // By blocks: source and target of one block fit into the first-level cache.
  for (std::size_t first = row; first < row_end; first += kBlock) {
    const std::size_t last = std::min(first + kBlock, row_end);
    for (std::size_t begin = column; begin < column_end; begin += kBlock) {
      const std::size_t end = std::min(begin + kBlock, column_end);
      kernels().transpose(from[first] + begin, from.stride(), last - first, end - begin, to[begin] + first,
                          to.stride());
    }
  }
}

void mirror_upper(double* matrix, std::size_t stride, std::size_t size) {
  for (std::size_t first = 0; first < size; first += kBlock) {
    const std::size_t last = std::min(first + kBlock, size);
    for (std::size_t begin = 0; begin < first; begin += kBlock) {
      kernels().transpose(matrix + begin * stride + first, stride, kBlock, last - first,
                          matrix + first * stride + begin, stride);
    }
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t j = first; j < i; ++j) matrix[i * stride + j] = matrix[j * stride + i];
    }
  }
}

void mirror_upper(Matrix& matrix) { mirror_upper(matrix.data(), matrix.stride(), matrix.rows()); }

bool factor(Matrix& matrix) { return factor_from(matrix.data(), matrix.stride(), matrix.rows(), 0); }

void solve_forward(const Matrix& upper, Matrix& right) {
  solve_lower(upper.data(), upper.stride(), upper.rows(), right);
}

void solve_backward(const Matrix& upper, double* x) {
  kernels().solve_upper(upper.data(), upper.stride(), upper.rows(), x);
}

std::size_t SubmatrixFactor::known(const std::vector<std::size_t>& places) const {
  const auto differ = std::mismatch(places.begin(), places.end(), places_.begin(), places_.end()).first;
  return static_cast<std::size_t>(differ - places.begin()) / kFactorRows * kFactorRows;
}

bool SubmatrixFactor::factor(const Matrix& matrix, const std::vector<std::size_t>& places) {
  if (is_of(places)) return true;
  const std::size_t known_rows = known(places), size = places.size();
  // The stride must not depend on the number of places, because known rows of the factor stay where they are.
  upper_.resize(matrix.rows(), matrix.rows());
  for (std::size_t a = 0; a < size; ++a) {
    const double* from = matrix[places[a]];
    double* to = upper_[a];
    for (std::size_t b = std::max(a, known_rows); b < size; ++b) to[b] = from[places[b]];
  }
  places_ = places;
  if (factor_from(upper_.data(), upper_.stride(), size, known_rows)) return true;
  forget();
  return false;
}

void SubmatrixFactor::solve_forward(Matrix& right) const {
  solve_lower(upper_.data(), upper_.stride(), places_.size(), right);
}

void SubmatrixFactor::solve_backward(double* x) const {
  kernels().solve_upper(upper_.data(), upper_.stride(), places_.size(), x);
}

}  // namespace mjtactile
