// Symmetric systems of a few unknowns, of which some motions may be open.
#pragma once

#include <cstddef>

namespace mjtactile {

constexpr std::size_t kMostSmall = 6;

// Scalar product of two vectors.
double dot(const double* a, const double* b, std::size_t count);

// Solve a symmetric positive definite system (size, size), at most kMostSmall, for several right sides, each a column of
// `right` (size, sides), which the solutions replace. False where a pivot is less than `least` of the largest diagonal
// entry; `right` means nothing then.
bool solve_small(std::size_t size, const double* matrix, double* right, std::size_t sides, double least);

// Eigenvalues (in no order) and unit eigenvectors, as columns, of a symmetric matrix (size, size), at most kMostSmall.
void symmetric_eigen(std::size_t size, const double* matrix, double* values, double* vectors);

// Which motions of a body count as open: those that resist it at most so much. An open motion stays as it is, unless more
// than `loaded` of a load acts along it: then the body goes far along it.
struct Openness {
  double open, loaded;
};

// A body's stiffness against its motions, a positive semidefinite matrix (size, size), at most kMostSmall.
class MotionStiffness {
 public:
  MotionStiffness(std::size_t size, const double* matrix);
  double largest() const;   // eigenvalue
  // Add how a load moves the body (size,).
  void add_motion(const double* load, const Openness& openness, double* motion) const;
  // The matrix (size, size) that gives motions for loads, where a given load decides which motions stay.
  void invert(const double* load, const Openness& openness, double* inverse) const;

 private:
  double give_along(std::size_t vector, const double* load, const Openness& openness) const;
  double load_along(std::size_t vector, const double* load) const;

  std::size_t size_;
  double values_[kMostSmall], vectors_[kMostSmall * kMostSmall];   // eigenvalues, and eigenvectors as columns
};

// The inverse of a positive semidefinite matrix on the directions whose eigenvalues are more than `least` of the
// largest, and zero on the others.
void pseudo_inverse(std::size_t size, const double* matrix, double least, double* inverse);

}  // namespace mjtactile
