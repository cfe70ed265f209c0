#include "contact/cells/edge_integrals.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

constexpr double kLeastDistance = 1e-12;

}  // namespace

// The antiderivative is 1/2 [s r + d^2 asinh(s / d)], with the distance d of the line and r^2 = s^2 + d^2.
double SeenLine::distance() const {
  const double square = beside * beside;
  // Use the end with the larger coordinate in the numerator. The denominator then suffers from cancellation only where
  // the factor d^2 makes the term vanish.
  const bool turned = low + high < 0.0;
  const double near = turned ? -high : low, far = turned ? -low : high;
  const double to_near = std::sqrt(near * near + square), to_far = std::sqrt(far * far + square);
  const double bend = square * std::log((far + to_far) / std::max(near + to_near, kLeastDistance * (far - near)));
  return 0.5 * (far * to_far - near * to_near + bend);
}

void EdgeIntegrals::inverse_distance(const std::vector<CellEdge>& edges, std::size_t cells,
                                     std::vector<double>& integrals) {
  const std::size_t count = edges.size(), width = cells + 1;
  for (std::vector<double>* one : {&start_x_, &start_y_, &unit_x_, &unit_y_, &middle_x_, &middle_y_, &length_,
                                   &distance_, &aligned_, &value_}) {
    one->resize(count);
  }
  left_.resize(count), right_.resize(count);
  for (std::size_t e = 0; e < count; ++e) {
    const CellEdge& edge = edges[e];
    const double x = edge.end.x - edge.start.x, y = edge.end.y - edge.start.y, length = std::sqrt(x * x + y * y);
    start_x_[e] = edge.start.x, start_y_[e] = edge.start.y;
    middle_x_[e] = (edge.start.x + edge.end.x) / 2, middle_y_[e] = (edge.start.y + edge.end.y) / 2;
    unit_x_[e] = x / length, unit_y_[e] = y / length, length_[e] = length;
    left_[e] = edge.left < 0 ? cells : static_cast<std::size_t>(edge.left);
    right_[e] = edge.right < 0 ? cells : static_cast<std::size_t>(edge.right);
  }
  // Sum over pairs of edges, each pair once. The other order is added at the end.
  integrals.assign(cells * cells, 0.0);
  sums_.assign(width, 0.0);
  for (std::size_t e = 0; e < count; ++e) {
    far(e);
    near(e);
    for (std::size_t f = 0; f <= e; ++f) {
      const double value = value_[f] * aligned_[f];
      sums_[left_[f]] += value;
      sums_[right_[f]] -= value;
    }
    double* left = left_[e] < cells ? integrals.data() + left_[e] * cells : nullptr;
    double* right = right_[e] < cells ? integrals.data() + right_[e] * cells : nullptr;
    for (std::size_t cell = 0; cell < cells; ++cell) {
      const double sum = sums_[cell];
      if (left != nullptr) left[cell] -= sum;
      if (right != nullptr) right[cell] += sum;
      sums_[cell] = 0.0;
    }
    sums_[cells] = 0.0;
  }
  for (std::size_t i = 0; i < cells; ++i) {
    integrals[i * cells + i] *= 2.0;
    for (std::size_t j = 0; j < i; ++j) {
      integrals[i * cells + j] = integrals[j * cells + i] = integrals[i * cells + j] + integrals[j * cells + i];
    }
  }
}

// Integrals of r with all edges before this one, by a Taylor series of second order about the middles.
void EdgeIntegrals::far(std::size_t edge) {
  const double x = middle_x_[edge], y = middle_y_[edge], u = unit_x_[edge], v = unit_y_[edge];
  const double length = length_[edge], own_square = length * length / 24;
  const double *__restrict to_x = middle_x_.data(), *__restrict to_y = middle_y_.data();
  const double *__restrict to_u = unit_x_.data(), *__restrict to_v = unit_y_.data(), *__restrict to = length_.data();
  double *__restrict distance = distance_.data(), *__restrict aligned = aligned_.data();
  double *__restrict value = value_.data();
  for (std::size_t f = 0; f < edge; ++f) {
    const double dx = x - to_x[f], dy = y - to_y[f];
    const double r = std::sqrt(dx * dx + dy * dy), inverse = 1.0 / (r + 1e-300);
    const double own = (u * dx + v * dy) * inverse, other = (to_u[f] * dx + to_v[f] * dy) * inverse;
    const double bend = own_square * (1.0 - own * own) + to[f] * to[f] / 24 * (1.0 - other * other);
    distance[f] = r;
    aligned[f] = u * to_u[f] + v * to_v[f];
    value[f] = (r + bend * inverse) * (length * to[f]);
  }
  // The edge with itself, in closed form. It is halved, because both orders are added at the end.
  distance_[edge] = INFINITY;
  aligned_[edge] = 1.0;
  value_[edge] = length * length * length / 6;
}

// Replace the integrals with near edges: Gauss points on the shorter edge, closed form along the longer one.
void EdgeIntegrals::near(std::size_t edge) {
  const auto integral = [this](std::size_t shorter, std::size_t longer) {
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double along = kGaussPoints[k] / 2 * length_[shorter], u = unit_x_[longer], v = unit_y_[longer];
      const double x = start_x_[longer] - middle_x_[shorter] - along * unit_x_[shorter];
      const double y = start_y_[longer] - middle_y_[shorter] - along * unit_y_[shorter];
      const double low = x * u + y * v;
      sum += kGaussWeights[k] * SeenLine{low, low + length_[longer], y * u - x * v}.distance();
    }
    return sum / 2 * length_[shorter];
  };
  const double length = length_[edge];
  for (std::size_t f = 0; f < edge; ++f) {
    if (!(distance_[f] < kNearEdges * (length + length_[f]))) continue;
    const double longer = length - length_[f];
    if (std::abs(longer) > kSameLength * (length + length_[f])) {
      value_[f] = longer > 0.0 ? integral(f, edge) : integral(edge, f);
    } else {
      value_[f] = (integral(f, edge) + integral(edge, f)) / 2;
    }
  }
}

}  // namespace mjtactile
