// Symmetric systems of a few unknowns, such as the rigid motions of a body. They may be singular: a contact can leave a
// motion without resistance, which is called open here.
#pragma once

#include <cstddef>

namespace mjtactile {

constexpr std::size_t kMostSmall = 6;   // largest number of unknowns

// Scalar product of two vectors.
double dot(const double* a, const double* b, std::size_t count);

// Solve a symmetric positive definite system (size, size), at most kMostSmall, for several right sides. Each is a
// column of `right` (size, sides) and is replaced by its solution. False if a pivot is less than `least` times the
// largest diagonal entry; `right` is then undefined.
bool solve_small(std::size_t size, const double* matrix, double* right, std::size_t sides, double least);

// When a motion of a body counts as open: if its stiffness is at most `open`. The body does not move along an open
// motion unless the load along it exceeds `loaded`. It then moves as if its stiffness were `open`, which is far.
struct Openness {
  double open, loaded;
};

// Stiffness of a contact against the body's rigid motions, a positive semidefinite matrix (size, size), at most
// kMostSmall. Units are those of the matrix; the matrix is copied.
class MotionStiffness {
 public:
  MotionStiffness(std::size_t size, const double* matrix);
  double largest() const;   // largest eigenvalue
  // Add the body's motion (size) under a load (size) to `motion`.
  void add_motion(const double* load, const Openness& openness, double* motion) const;
  // The matrix (size, size) that maps loads to motions. `load` decides which open motions the body moves along.
  void invert(const double* load, const Openness& openness, double* inverse) const;

 private:
  double compliance_along(std::size_t vector, const double* load, const Openness& openness) const;
  double load_along(std::size_t vector, const double* load) const;

  std::size_t size_;
  double values_[kMostSmall], vectors_[kMostSmall * kMostSmall];   // eigenvalues, and eigenvectors as columns
};

// Solve a positive semidefinite system (size, size) on the directions whose eigenvalues are more than `least` of the
// largest. The solution has no part along the others.
void solve_semidefinite(std::size_t size, const double* matrix, double least, const double* right, double* solution);

}  // namespace mjtactile
