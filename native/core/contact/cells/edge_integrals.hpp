// Integrals of 1/r over pairs of polygons in one plane, from their edges.
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/face.hpp"

namespace mjtactile {

// As tests/reference/half_space.py has them. Edges nearer than this, over the sum of their lengths, are integrated in closed
// form along the longer one. Not 1.5 itself: edges of a lattice lie just that far apart, and rounding must not choose.
constexpr double kNearEdges = 1.4999;
// Lengths that agree to this fraction of their sum count as equal: which edge is the shorter one must not hang on rounding.
constexpr double kSameLength = 1e-9;
// Three Gauss points on (-1, 1).
constexpr double kGaussPoints[3] = {-0.7745966692414834, 0.0, 0.7745966692414834};
constexpr double kGaussWeights[3] = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};

// A line as seen from a point: places of its ends along it, and how far it passes on the left [m].
struct SeenLine {
  double low, high, beside;

  // Integral of the distance along the line [m^2].
  double distance() const;
};

// As tests/reference/half_space.py has it: 1/r is the Laplacian of r, so both area integrals turn into integrals of r over
// edges. Keeps its memory between calls.
class EdgeIntegrals {
 public:
  // Integrals over pairs of cells (cells, cells) [m^3] of the distinct edges between them, none of length 0.
  void inverse_distance(const std::vector<CellEdge>& edges, std::size_t cells, std::vector<double>& integrals);

 private:
  void far(std::size_t edge);
  void near(std::size_t edge);

  std::vector<double> start_x_, start_y_, unit_x_, unit_y_, middle_x_, middle_y_, length_;
  std::vector<double> distance_, aligned_, value_;  // from one edge to those before it
  std::vector<std::size_t> left_, right_;           // cells; that beyond the last stands for none
  std::vector<double> sums_;                        // over the edges of each cell
};

}  // namespace mjtactile
