#include "linalg/small.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/kernels.hpp"

namespace mjtactile {
namespace {

// Eigenvalues (in no order) and unit eigenvectors, as columns, of a symmetric matrix (size, size), at most kMostSmall,
// by cyclic Jacobi rotations (Golub, Van Loan, Matrix Computations, section 8.5).
void symmetric_eigen(std::size_t size, const double* matrix, double* values, double* vectors) {
  constexpr int kSweeps = 30;
  double a[kMostSmall][kMostSmall];
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t j = 0; j < size; ++j) {
      a[i][j] = matrix[i * size + j];
      vectors[i * size + j] = i == j ? 1.0 : 0.0;
    }
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    bool turned = false;
    for (std::size_t p = 0; p < size; ++p) {
      for (std::size_t q = p + 1; q < size; ++q) {
        if (!(std::abs(a[p][q]) > 1e-17 * std::sqrt(std::abs(a[p][p] * a[q][q])))) continue;
        if (std::abs(a[p][q]) < 1e-300) continue;
        turned = true;
        const double angle = 0.5 * std::atan2(2.0 * a[p][q], a[q][q] - a[p][p]);
        const double c = std::cos(angle), s = std::sin(angle);
        const auto turn = [c, s](double& first, double& second) {
          const double one = first, other = second;
          first = c * one - s * other, second = s * one + c * other;
        };
        for (std::size_t k = 0; k < size; ++k) turn(a[k][p], a[k][q]);
        for (std::size_t k = 0; k < size; ++k) turn(a[p][k], a[q][k]);
        for (std::size_t k = 0; k < size; ++k) turn(vectors[k * size + p], vectors[k * size + q]);
      }
    }
    if (!turned) break;
  }
  for (std::size_t i = 0; i < size; ++i) values[i] = a[i][i];
}

}  // namespace

double dot(const double* a, const double* b, std::size_t count) {
  return kernels().dot(a, b, count);
}

// Gaussian elimination without pivoting.
bool solve_small(std::size_t size, const double* matrix, double* right, std::size_t sides, double least) {
  double a[kMostSmall][kMostSmall], largest = 0.0;
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t j = 0; j < size; ++j) a[i][j] = matrix[i * size + j];
    largest = std::max(largest, a[i][i]);
  }
  for (std::size_t k = 0; k < size; ++k) {
    if (!(a[k][k] > least * largest)) return false;
    for (std::size_t i = k + 1; i < size; ++i) {
      const double ratio = a[i][k] / a[k][k];
      for (std::size_t j = k; j < size; ++j) a[i][j] -= ratio * a[k][j];
      for (std::size_t s = 0; s < sides; ++s) right[i * sides + s] -= ratio * right[k * sides + s];
    }
  }
  for (std::size_t i = size; i-- > 0;) {
    for (std::size_t s = 0; s < sides; ++s) {
      double* x = right + i * sides + s;
      for (std::size_t j = i + 1; j < size; ++j) *x -= a[i][j] * right[j * sides + s];
      *x /= a[i][i];
    }
  }
  return true;
}

MotionStiffness::MotionStiffness(std::size_t size, const double* matrix) : size_(size) {
  symmetric_eigen(size, matrix, values_, vectors_);
}

double MotionStiffness::largest() const {
  return *std::max_element(values_, values_ + size_);
}

double MotionStiffness::load_along(std::size_t vector, const double* load) const {
  double along = 0.0;
  for (std::size_t m = 0; m < size_; ++m) along += vectors_[m * size_ + vector] * load[m];
  return along;
}

double MotionStiffness::compliance_along(std::size_t vector, const double* load, const Openness& openness) const {
  if (values_[vector] > openness.open) return 1.0 / values_[vector];
  return std::abs(load_along(vector, load)) > openness.loaded ? 1.0 / openness.open : 0.0;
}

void MotionStiffness::add_motion(const double* load, const Openness& openness, double* motion) const {
  for (std::size_t k = 0; k < size_; ++k) {
    const double share = compliance_along(k, load, openness) * load_along(k, load);
    for (std::size_t m = 0; m < size_; ++m) motion[m] += share * vectors_[m * size_ + k];
  }
}

void MotionStiffness::invert(const double* load, const Openness& openness, double* inverse) const {
  std::fill(inverse, inverse + size_ * size_, 0.0);
  for (std::size_t k = 0; k < size_; ++k) {
    const double compliance = compliance_along(k, load, openness);
    for (std::size_t i = 0; i < size_; ++i) {
      for (std::size_t j = 0; j < size_; ++j) {
        inverse[i * size_ + j] += compliance * vectors_[i * size_ + k] * vectors_[j * size_ + k];
      }
    }
  }
}

void solve_semidefinite(std::size_t size, const double* matrix, double least, const double* right, double* solution) {
  const double unloaded[kMostSmall] = {};
  double inverse[kMostSmall * kMostSmall];
  const MotionStiffness stiffness(size, matrix);
  stiffness.invert(unloaded, {std::max(least * stiffness.largest(), 0.0), 0.0}, inverse);
  for (std::size_t i = 0; i < size; ++i) {
    solution[i] = 0.0;
    for (std::size_t j = 0; j < size; ++j) solution[i] += inverse[i * size + j] * right[j];
  }
}

}  // namespace mjtactile
