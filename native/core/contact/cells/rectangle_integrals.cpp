#include "contact/cells/rectangle_integrals.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

constexpr double kFar = 16.0, kFarFromCut = 6.0;

// a b^2 asinh(a / |b|), and its limit 0 where b vanishes.
double half(double a, double b) {
  b = std::abs(b);
  return b > 0.0 ? a * b * b * std::asinh(a / b) : 0.0;
}

// 1/r integrated twice along each axis.
double antiderivative(double x, double y) {
  const double r = std::hypot(x, y);
  return 0.5 * (half(x, y) + half(y, x)) - r * r * r / 6.0;
}

// Taylor series about the distance of the middles, for rectangles that lie far apart.
double far_integral(double x, double y, const double* a, const double* b) {
  const double square = x * x + y * y;
  const double bend = ((a[0] * a[0] + a[1] * a[1]) * (3.0 * x * x - square) +
                       (b[0] * b[0] + b[1] * b[1]) * (3.0 * y * y - square)) /
                      (24.0 * square * square);
  return a[0] * a[1] * b[0] * b[1] / std::sqrt(square) * (1.0 + bend);
}

}  // namespace

double inverse_distance(double x, double y, const double* a, const double* b) {
  const double away = kFarFromCut * std::max({a[0], a[1], b[0], b[1]});
  if (x * x + y * y > away * away) return far_integral(x, y, a, b);
  const double along[4] = {(a[0] + a[1]) / 2, -(a[0] + a[1]) / 2, (a[0] - a[1]) / 2, -(a[0] - a[1]) / 2};
  const double across[4] = {(b[0] + b[1]) / 2, -(b[0] + b[1]) / 2, (b[0] - b[1]) / 2, -(b[0] - b[1]) / 2};
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const double sign = (i < 2) == (j < 2) ? 1.0 : -1.0;
      sum += sign * antiderivative(x + along[i], y + across[j]);
    }
  }
  return sum;
}

void inverse_distance_by_offset(std::size_t columns, std::size_t rows, double width, double height,
                                std::vector<double>& table) {
  constexpr double kSecondDifference[3] = {1.0, -2.0, 1.0};
  const double a[2] = {width, width}, b[2] = {height, height}, away = kFar * std::max(width, height);
  // Neighbours share the points of their differences.
  std::vector<double> values((columns + 2) * (rows + 2));
  for (std::size_t row = 0; row < rows + 2; ++row) {
    for (std::size_t column = 0; column < columns + 2; ++column) {
      values[row * (columns + 2) + column] =
          antiderivative((static_cast<double>(column) - 1.0) * width, (static_cast<double>(row) - 1.0) * height);
    }
  }
  table.resize(columns * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const double x = static_cast<double>(column) * width, y = static_cast<double>(row) * height;
      double& entry = table[row * columns + column];
      if (x * x + y * y > away * away) {
        entry = far_integral(x, y, a, b);
        continue;
      }
      entry = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          entry += kSecondDifference[i] * kSecondDifference[j] * values[(row + j) * (columns + 2) + column + i];
        }
      }
    }
  }
}

}  // namespace mjtactile
