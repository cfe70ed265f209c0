#include "contact/cells/tangential.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// As in edge_integrals.cpp: edges nearer than this, over the sum of their lengths, are integrated in closed form, and
// lengths that agree to the second one are equal.
constexpr double kNear = 1.4999;
constexpr double kSameLength = 1e-9;
// Three Gauss points on (-1, 1).
constexpr double kNodes[3] = {-0.7745966692414834, 0.0, 0.7745966692414834};
constexpr double kWeights[3] = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};

struct Edge {
  Point middle, unit;
  double length;
};

// Integral of the distance from a point along an edge: 1/2 [s r + d^2 asinh(s / d)] between its ends.
double line_integral(const Point& point, const Edge& edge) {
  const double x = edge.middle.x - edge.length / 2 * edge.unit.x - point.x;
  const double y = edge.middle.y - edge.length / 2 * edge.unit.y - point.y;
  double low = x * edge.unit.x + y * edge.unit.y, high = low + edge.length;
  const double square = std::max(x * x + y * y - low * low, 0.0);
  // The larger end first: the logarithm of the other cancels only where its factor, the square, vanishes.
  if (low + high < 0.0) {
    const double kept = low;
    low = -high, high = -kept;
  }
  const double to_low = std::sqrt(low * low + square), to_high = std::sqrt(high * high + square);
  const double ratio = (high + to_high) / std::max(low + to_low, 1e-12 * edge.length);
  return 0.5 * (high * to_high - low * to_low + square * std::log(ratio));
}

// Double integral of the distance, Gauss points on the first edge.
double near_integral(const Edge& first, const Edge& second) {
  double sum = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double along = kNodes[k] / 2 * first.length;
    const Point point = {first.middle.x + along * first.unit.x, first.middle.y + along * first.unit.y};
    sum += kWeights[k] / 2 * first.length * line_integral(point, second);
  }
  return sum;
}

// Double integral of the distance between two edges [m^3].
double distance_integral(const Edge& first, const Edge& second) {
  const double x = first.middle.x - second.middle.x, y = first.middle.y - second.middle.y;
  const double distance = std::sqrt(x * x + y * y);
  if (distance < kNear * (first.length + second.length)) {
    // Gauss points on the shorter edge; on both in turn where they are equal, so that no order is preferred.
    const double apart = first.length - second.length;
    if (std::abs(apart) <= kSameLength * (first.length + second.length)) {
      return (near_integral(first, second) + near_integral(second, first)) / 2;
    }
    return apart < 0.0 ? near_integral(first, second) : near_integral(second, first);
  }
  // A Taylor series to second order about the middles.
  const double inverse = 1.0 / distance;
  const double of_first = (first.unit.x * x + first.unit.y * y) * inverse;
  const double of_second = (second.unit.x * x + second.unit.y * y) * inverse;
  const double bend = (first.length * first.length * (1.0 - of_first * of_first) +
                       second.length * second.length * (1.0 - of_second * of_second)) * inverse;
  return (distance + bend / 24) * first.length * second.length;
}

// Double integrals of x (2 ln r - 1) / 4 and y (2 ln r - 1) / 4, whose Laplacians are x/r^2 and y/r^2.
Point coupling_integral(const Edge& first, const Edge& second) {
  Point sum = {0.0, 0.0};
  for (int i = 0; i < 3; ++i) {
    const double one = kNodes[i] / 2 * first.length;
    for (int j = 0; j < 3; ++j) {
      const double other = kNodes[j] / 2 * second.length;
      const double x = first.middle.x + one * first.unit.x - second.middle.x - other * second.unit.x;
      const double y = first.middle.y + one * first.unit.y - second.middle.y - other * second.unit.y;
      const double square = x * x + y * y;
      if (!(square > 0.0)) continue;
      const double weight = kWeights[i] * kWeights[j] / 16 * (std::log(square) - 1.0);
      sum.x += weight * x;
      sum.y += weight * y;
    }
  }
  const double lengths = first.length * second.length;
  return {lengths * sum.x, lengths * sum.y};
}

void resize(ShearIntegrals& integrals, std::size_t cells) {
  for (auto* one : {&integrals.xx, &integrals.xy, &integrals.yy, &integrals.along, &integrals.across}) {
    one->assign(cells * cells, 0.0);
  }
}

}  // namespace

void integrate_edges(const Face& face, ShearIntegrals& integrals) {
  const std::size_t cells = face.cells(), edges = face.edges.size();
  resize(integrals, cells);
  const auto edge_at = [&](std::size_t i) {
    const CellEdge& at = face.edges[i];
    // About the first corner: coordinates far from their origin have fewer digits.
    const double* origin = face.edges.front().start;
    const double x = at.end[0] - at.start[0], y = at.end[1] - at.start[1], length = std::sqrt(x * x + y * y);
    return Edge{{(at.start[0] + at.end[0]) / 2 - origin[0], (at.start[1] + at.end[1]) / 2 - origin[1]},
                {x / length, y / length}, length};
  };
  for (std::size_t e = 0; e < edges; ++e) {
    const Edge first = edge_at(e);
    if (!(first.length > 0.0)) continue;
    const std::int32_t own[2] = {face.edges[e].left, face.edges[e].right};
    for (std::size_t f = e; f < edges; ++f) {
      const Edge second = edge_at(f);
      if (!(second.length > 0.0)) continue;
      const double distance = distance_integral(first, second);
      const Point coupling = e == f ? Point{0.0, 0.0} : coupling_integral(first, second);
      // Outward normals of the cells on the left; those on the right have the opposite ones.
      const double a[2] = {first.unit.y, -first.unit.x}, b[2] = {second.unit.y, -second.unit.x};
      const double both = a[0] * b[0] + a[1] * b[1];
      const double xx = a[0] * b[0] * distance, yy = a[1] * b[1] * distance;
      const double xy = (a[0] * b[1] + a[1] * b[0]) / 2 * distance;
      const std::int32_t other[2] = {face.edges[f].left, face.edges[f].right};
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 2; ++j) {
          if (own[i] < 0 || other[j] < 0) continue;
          const double sign = i == j ? -1.0 : 1.0;
          const std::size_t here = static_cast<std::size_t>(own[i]) * cells + static_cast<std::size_t>(other[j]);
          const std::size_t there = static_cast<std::size_t>(other[j]) * cells + static_cast<std::size_t>(own[i]);
          integrals.xx[here] += sign * xx;
          integrals.xy[here] += sign * xy;
          integrals.yy[here] += sign * yy;
          if (e == f) continue;
          integrals.xx[there] += sign * xx;
          integrals.xy[there] += sign * xy;
          integrals.yy[there] += sign * yy;
          integrals.along[here] += sign * both * coupling.x;
          integrals.across[here] += sign * both * coupling.y;
          integrals.along[there] -= sign * both * coupling.x;
          integrals.across[there] -= sign * both * coupling.y;
        }
      }
    }
  }
}

}  // namespace mjtactile
