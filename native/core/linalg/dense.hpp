// Small dense linear algebra in double precision, on top of the kernels.
#pragma once

#include <cstddef>
#include <vector>

#include "linalg/aligned.hpp"

namespace mjtactile {

// A matrix stored row by row. Rows are padded to whole SIMD vectors; the padding is undefined. It owns its memory.
class Matrix {
 public:
  static constexpr std::size_t kPadding = 8;

  // Number of columns rounded up to whole vectors.
  static std::size_t padded(std::size_t columns) { return (columns + kPadding - 1) / kPadding * kPadding; }

  Matrix() = default;
  Matrix(std::size_t rows, std::size_t columns) { resize(rows, columns); }

  // Set the shape. Entries are undefined afterwards. Memory only grows.
  void resize(std::size_t rows, std::size_t columns) {
    rows_ = rows;
    columns_ = columns;
    stride_ = padded(columns);
    if (entries_.size() < rows * stride_) entries_.resize(rows * stride_);
  }
  std::size_t rows() const { return rows_; }
  std::size_t columns() const { return columns_; }
  std::size_t stride() const { return stride_; }
  double* operator[](std::size_t row) { return entries_.data() + row * stride_; }
  const double* operator[](std::size_t row) const { return entries_.data() + row * stride_; }
  double* data() { return entries_.data(); }
  const double* data() const { return entries_.data(); }

 private:
  std::size_t rows_ = 0, columns_ = 0, stride_ = 0;
  AlignedVector<double> entries_;
};

// Whether all of `count` consecutive numbers are zero.
bool is_zero(const double* run, std::size_t count);
// sums += symmetric x. Both triangles of the matrix must be filled.
void add_product(const Matrix& symmetric, const double* x, double* sums);
// Copy the block of rows [row, row_end) and columns [column, column_end) of a matrix to the transposed place of `to`.
void transpose_part(const Matrix& from, std::size_t row, std::size_t row_end, std::size_t column,
                    std::size_t column_end, Matrix& to);
// Copy the upper triangle to the lower one.
void mirror_upper(Matrix& matrix);
// The same for a matrix (size, size) whose rows are `stride` apart.
void mirror_upper(double* matrix, std::size_t stride, std::size_t size);

// Cholesky factorisation U^T U of a symmetric positive definite matrix. Only the upper triangle is read, and U replaces
// it. False if the matrix is not positive definite.
bool factor(Matrix& matrix);

// The two substitutions that solve U^T U x = b. The forward one solves U^T y = b for several b, each a row of `right`,
// which y replaces. The backward one solves U x = y for one y. Since y1 . y2 = b1 . x2, scalar products of right sides
// with solutions need the forward substitution only.
void solve_forward(const Matrix& upper, Matrix& right);
void solve_backward(const Matrix& upper, double* x);

// Cholesky factor of a principal submatrix: some rows and the same columns of a symmetric matrix. If the next list of
// rows begins like the last one, that part of the factor is kept. So rows that change often belong at the end of the
// list.
class SubmatrixFactor {
 public:
  // Drop the factor. Call this before factor() is given another matrix.
  void forget() { places_.clear(); }
  // Factor the rows and columns `places` of a matrix, in that order. False if the submatrix is not positive definite.
  bool factor(const Matrix& matrix, const std::vector<std::size_t>& places);
  // Number of first rows of `places` whose factor is known already, in whole blocks.
  std::size_t known(const std::vector<std::size_t>& places) const;
  // Whether `places` were factored last.
  bool is_of(const std::vector<std::size_t>& places) const { return !places.empty() && places == places_; }

  // As the functions of the same names above, with the factor of the last factor().
  void solve_forward(Matrix& right) const;
  void solve_backward(double* x) const;

 private:
  std::vector<std::size_t> places_;
  Matrix upper_;
};

}  // namespace mjtactile
