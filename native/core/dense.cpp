#include "dense.hpp"

#include <algorithm>
#include <cmath>

#include "kernels.hpp"

namespace mjtactile {

void add_rows(const Matrix& matrix, const double* weights, std::size_t count, double* sum) {
  constexpr std::size_t kChunk = 64;
  const double* rows[kChunk];
  for (std::size_t first = 0; first < matrix.rows(); first += kChunk) {
    const std::size_t taken = std::min(kChunk, matrix.rows() - first);
    for (std::size_t i = 0; i < taken; ++i) rows[i] = matrix[first + i];
    kernels().add_double(rows, weights + first, taken, count, sum);
  }
}

bool factor(Matrix& matrix) {
  constexpr std::size_t kChunk = 64;
  const std::size_t size = matrix.rows();
  const double* above[kChunk];
  double weights[kChunk];
  for (std::size_t i = 0; i < size; ++i) {
    double* row = matrix[i] + i;
    for (std::size_t first = 0; first < i; first += kChunk) {
      const std::size_t taken = std::min(kChunk, i - first);
      for (std::size_t k = 0; k < taken; ++k) {
        above[k] = matrix[first + k] + i;
        weights[k] = -above[k][0];
      }
      kernels().add_double(above, weights, taken, size - i, row);
    }
    if (!(row[0] > 0.0) || !std::isfinite(row[0])) return false;
    const double pivot = std::sqrt(row[0]);
    row[0] = pivot;
    const double inverse = 1.0 / pivot;
    for (std::size_t j = 1; j < size - i; ++j) row[j] *= inverse;
  }
  return true;
}

void solve_factored(const Matrix& upper, Matrix& right) {
  const std::size_t size = upper.rows(), sides = right.columns();
  for (std::size_t i = 0; i < size; ++i) {
    const double* row = upper[i];
    double* x = right[i];
    for (std::size_t s = 0; s < sides; ++s) x[s] /= row[i];
    for (std::size_t j = i + 1; j < size; ++j) {
      double* y = right[j];
      for (std::size_t s = 0; s < sides; ++s) y[s] -= row[j] * x[s];
    }
  }
  for (std::size_t i = size; i-- > 0;) {
    const double* row = upper[i];
    double* x = right[i];
    for (std::size_t j = i + 1; j < size; ++j) {
      const double* y = right[j];
      for (std::size_t s = 0; s < sides; ++s) x[s] -= row[j] * y[s];
    }
    for (std::size_t s = 0; s < sides; ++s) x[s] /= row[i];
  }
}

bool solve_small(const Matrix& matrix, Matrix& right, double least) {
  const std::size_t size = matrix.rows(), sides = right.columns();
  double a[3][3], largest = 0.0;
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t j = 0; j < size; ++j) a[i][j] = matrix[i][j];
    largest = std::max(largest, a[i][i]);
  }
  for (std::size_t k = 0; k < size; ++k) {
    if (!(a[k][k] > least * largest)) return false;
    for (std::size_t i = k + 1; i < size; ++i) {
      const double ratio = a[i][k] / a[k][k];
      for (std::size_t j = k; j < size; ++j) a[i][j] -= ratio * a[k][j];
      for (std::size_t s = 0; s < sides; ++s) right[i][s] -= ratio * right[k][s];
    }
  }
  for (std::size_t i = size; i-- > 0;) {
    for (std::size_t j = i + 1; j < size; ++j) {
      for (std::size_t s = 0; s < sides; ++s) right[i][s] -= a[i][j] * right[j][s];
    }
    for (std::size_t s = 0; s < sides; ++s) right[i][s] /= a[i][i];
  }
  return true;
}

}  // namespace mjtactile
