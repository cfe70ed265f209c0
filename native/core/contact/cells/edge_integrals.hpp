// Integrals of 1/r over pairs of polygons in one plane, from their edges.
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/face.hpp"

namespace mjtactile {

// Two edges are near if the distance of their middles is below this, over the sum of their lengths. Near edges are
// integrated in closed form along the longer one. The constants are those of tests/reference/half_space.py. The value
// is not 1.5, because many edges of a lattice are exactly that far apart, and rounding must not decide.
constexpr double kNearEdges = 1.4999;
// Lengths that agree to this fraction of their sum count as equal, so that rounding does not decide which edge is
// longer.
constexpr double kSameLength = 1e-9;
// Three Gauss points on (-1, 1).
constexpr double kGaussPoints[3] = {-0.7745966692414834, 0.0, 0.7745966692414834};
constexpr double kGaussWeights[3] = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};

// A segment relative to a point: coordinates of its ends along the segment, and its distance to the left of the point
// [m].
struct SeenLine {
  double low, high, beside;

  // Integral of the distance from the point, along the segment [m^2].
  double distance() const;
};

// The Laplacian of r in the plane is 1/r. So the divergence theorem turns the integrals over both areas into integrals
// of r over pairs of edges, as in tests/reference/half_space.py. It keeps its memory between calls.
class EdgeIntegrals {
 public:
  // Integrals over pairs of cells (cells, cells) [m^3]. `edges`: all edges of the cells, each once, none of length 0.
  void inverse_distance(const std::vector<CellEdge>& edges, std::size_t cells, std::vector<double>& integrals);

 private:
  void far(std::size_t edge);
  void near(std::size_t edge);

  std::vector<double> start_x_, start_y_, unit_x_, unit_y_, middle_x_, middle_y_, length_;
  // Of one edge with all edges before it: distance of the middles [m], cosine of the angle, integral of r [m^3].
  std::vector<double> distance_, aligned_, value_;
  std::vector<std::size_t> left_, right_;           // cells beside each edge; the number of cells stands for none
  std::vector<double> sums_;                        // over the edges of each cell
};

}  // namespace mjtactile
