// Small dense linear algebra in double precision, on top of the kernels.
#pragma once

#include <cstddef>
#include <vector>

#include "linalg/aligned.hpp"

namespace mjtactile {

// A matrix stored row by row, each padded to whole vectors; the padding holds numbers that mean nothing.
class Matrix {
 public:
  static constexpr std::size_t kPadding = 8;

  // As many as fill whole vectors.
  static std::size_t padded(std::size_t columns) { return (columns + kPadding - 1) / kPadding * kPadding; }

  Matrix() = default;
  Matrix(std::size_t rows, std::size_t columns) { resize(rows, columns); }

  // Set the shape; entries are unspecified afterwards, memory is kept.
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

// Whether all numbers of a run are zero.
bool is_zero(const double* run, std::size_t count);
// sums += a symmetric matrix, whole, times x.
void add_product(const Matrix& symmetric, const double* x, double* sums);
// Of a matrix the part from a row and a column on up to others, into its transposed.
void transpose_part(const Matrix& from, std::size_t row, std::size_t row_end, std::size_t column, std::size_t column_end,
                    Matrix& to);
// Entries under the diagonal become those above it.
void mirror_upper(Matrix& matrix);
// The same of rows (size) that are `stride` apart.
void mirror_upper(double* matrix, std::size_t stride, std::size_t size);

// Factor a symmetric positive definite matrix, of which the upper triangle is read, into U^T U; U replaces it.
// False where the matrix is not positive definite.
bool factor(Matrix& matrix);

// The two halves of solving U^T U x = b: U^T y = b for several b at once, each a row of `right`, which y replaces, and
// U x = y for one. Products y . y of the first half already are those of b with the solutions.
void solve_forward(const Matrix& upper, Matrix& right);
void solve_backward(const Matrix& upper, double* x);

// The factor of some rows and columns of a symmetric matrix. The next one starts where the list of them first differs
// from the last: those that change often belong at its end.
class SubmatrixFactor {
 public:
  // The matrix is another: nothing stands.
  void forget() { places_.clear(); }
  // Factor the rows and columns `places` of a matrix, in that order. False where they are not positive definite.
  bool factor(const Matrix& matrix, const std::vector<std::size_t>& places);
  // How many of these would be factored already, whole blocks of them.
  std::size_t known(const std::vector<std::size_t>& places) const;
  // Whether these were factored last.
  bool is_of(const std::vector<std::size_t>& places) const { return !places.empty() && places == places_; }

  void solve_forward(Matrix& right) const;
  void solve_backward(double* x) const;

 private:
  std::vector<std::size_t> places_;
  Matrix upper_;
};

}  // namespace mjtactile
