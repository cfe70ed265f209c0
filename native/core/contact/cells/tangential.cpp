#include "contact/cells/tangential.hpp"

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "contact/cells/edge_integrals.hpp"

namespace mjtactile {
namespace {

struct Edge {
  Point middle, unit;
  double length;
};

// Integrals over a pair of edges: of the distance r [m^3], and of x (2 ln r - 1) / 4 and y (2 ln r - 1) / 4 [m^3],
// whose Laplacians are x/r^2 and y/r^2. (x, y) points from the second edge to the first.
struct EdgePair {
  double distance = 0.0;
  Point coupling = {0.0, 0.0};
};

// Integral of (x, y) (2 ln r - 1) / 4 along a line. (x, y) points from the line to the point from which it is seen; the
// result has its components along the line and to its left. With the coordinate s along the line and its distance d,
// the antiderivative of s (ln r^2 - 1) is r^2 ln r^2 / 2 - s^2. That of ln r^2 - 1 is s ln r^2 - 3 s + 2 d atan(s / d).
Point line_coupling(const SeenLine& line) {
  const auto [low, high, beside] = line;
  const double square = beside * beside, length = high - low;
  const double to_low = std::max(low * low + square, DBL_MIN), to_high = std::max(high * high + square, DBL_MIN);
  const double log_low = std::log(to_low), log_high = std::log(to_high);
  const double angle = std::atan2(std::abs(beside) * length, square + low * high);
  const double along = 0.5 * (to_high * log_high - to_low * log_low) - length * (low + high);
  const double across = beside * (high * log_high - low * log_low - 3.0 * length + 2.0 * std::abs(beside) * angle);
  return {-along / 4, -across / 4};
}

// Near edges: Gauss points on the first edge, closed form along the second one.
EdgePair near_pair(const Edge& first, const Edge& second) {
  EdgePair sum;
  const double u = second.unit.x, v = second.unit.y;
  for (int k = 0; k < 3; ++k) {
    const double place = kGaussPoints[k] / 2 * first.length, weight = kGaussWeights[k] / 2 * first.length;
    const double x = second.middle.x - first.middle.x - place * first.unit.x;
    const double y = second.middle.y - first.middle.y - place * first.unit.y;
    const double middle = x * u + y * v;
    const SeenLine line = {middle - second.length / 2, middle + second.length / 2, y * u - x * v};
    const Point coupling = line_coupling(line);
    sum.distance += weight * line.distance();
    sum.coupling.x += weight * (coupling.x * u - coupling.y * v);
    sum.coupling.y += weight * (coupling.x * v + coupling.y * u);
  }
  return sum;
}

// Far edges: a Taylor series of second order about the middles for the distance, Gauss points for the coupling.
EdgePair far_pair(const Edge& first, const Edge& second, double distance) {
  EdgePair pair;
  const double x = first.middle.x - second.middle.x, y = first.middle.y - second.middle.y;
  const double inverse = 1.0 / distance;
  const double of_first = (first.unit.x * x + first.unit.y * y) * inverse;
  const double of_second = (second.unit.x * x + second.unit.y * y) * inverse;
  const double bend = (first.length * first.length * (1.0 - of_first * of_first) +
                       second.length * second.length * (1.0 - of_second * of_second)) * inverse;
  const double lengths = first.length * second.length;
  pair.distance = (distance + bend / 24) * lengths;
  for (int i = 0; i < 3; ++i) {
    const double one = kGaussPoints[i] / 2 * first.length;
    for (int j = 0; j < 3; ++j) {
      const double other = kGaussPoints[j] / 2 * second.length;
      const double dx = x + one * first.unit.x - other * second.unit.x;
      const double dy = y + one * first.unit.y - other * second.unit.y;
      const double weight = lengths * kGaussWeights[i] * kGaussWeights[j] / 16 * (std::log(dx * dx + dy * dy) - 1.0);
      pair.coupling.x += weight * dx;
      pair.coupling.y += weight * dy;
    }
  }
  return pair;
}

EdgePair reversed(const EdgePair& pair) { return {pair.distance, {-pair.coupling.x, -pair.coupling.y}}; }

EdgePair pair_of(const Edge& first, const Edge& second) {
  const double x = first.middle.x - second.middle.x, y = first.middle.y - second.middle.y;
  const double distance = std::sqrt(x * x + y * y), lengths = first.length + second.length;
  if (!(distance < kNearEdges * lengths)) return far_pair(first, second, distance);
  const double longer = first.length - second.length;
  if (std::abs(longer) > kSameLength * lengths) {
    return longer > 0.0 ? reversed(near_pair(second, first)) : near_pair(first, second);
  }
  // For equally long edges the mean of both orders is used, so that the result does not depend on their order.
  const EdgePair one = near_pair(first, second), other = reversed(near_pair(second, first));
  return {(one.distance + other.distance) / 2,
          {(one.coupling.x + other.coupling.x) / 2, (one.coupling.y + other.coupling.y) / 2}};
}

}  // namespace

void integrate_edges(const Face& face, ShearIntegrals& integrals) {
  const std::size_t cells = face.cells(), edges = face.edges.size();
  integrals.clear(cells);
  const auto edge_at = [&](std::size_t i) {
    const CellEdge& at = face.edges[i];
    // Coordinates are relative to the first corner, because rounding errors grow with the distance from the origin.
    const Point& origin = face.edges.front().start;
    const double x = at.end.x - at.start.x, y = at.end.y - at.start.y, length = std::sqrt(x * x + y * y);
    return Edge{{(at.start.x + at.end.x) / 2 - origin.x, (at.start.y + at.end.y) / 2 - origin.y},
                {x / length, y / length}, length};
  };
  for (std::size_t e = 0; e < edges; ++e) {
    const Edge first = edge_at(e);
    if (!(first.length > 0.0)) continue;
    const std::int32_t own[2] = {face.edges[e].left, face.edges[e].right};
    for (std::size_t f = e; f < edges; ++f) {
      const Edge second = edge_at(f);
      if (!(second.length > 0.0)) continue;
      const auto [distance, coupling] = pair_of(first, second);
      // Outward normals of the cells on the left. Those of the cells on the right are the opposite.
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
