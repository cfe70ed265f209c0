// Integrals of 1/r over pairs of polygons in one plane, from their edges.
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/face.hpp"

namespace mjtactile {

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
