// The sensing surface as a grid of quadratic elements, and the exact nodal forces of tractions on polygons.
#pragma once

#include <cstddef>
#include <vector>

namespace mjtactile {

// An edge of a polygon, with the area on its left [m], and the step of the traction across it [Pa].
struct TractionEdge {
  double start[2], end[2];
  double traction[3];
};

// Quadratic elements on the sheet's surface; nodes are the elements' ends and middles.
class SurfaceGrid {
 public:
  // Ends of the elements along x and along y, ascending [m].
  SurfaceGrid(std::vector<double> x, std::vector<double> y);

  const std::vector<double>& x() const { return x_; }
  const std::vector<double>& y() const { return y_; }
  std::size_t nodes_x() const { return 2 * x_.size() - 1; }
  std::size_t nodes_y() const { return 2 * y_.size() - 1; }
  double low_x() const { return x_.front(); }
  double high_x() const { return x_.back(); }
  double low_y() const { return y_.front(); }
  double high_y() const { return y_.back(); }

  // Numbers the caller keeps between calls, so that none of them allocates.
  struct Workspace {
    std::vector<double> moments;           // per element, of what runs in it and of what passes it on its right
    std::vector<std::size_t> first, last;  // per row: elements with anything in them, first > last for none
    std::size_t middle = 0;                // column of the first edge
    double reference[3] = {};              // powers of xi there from which its areas are counted
  };

  // Consistent nodal forces [N] of tractions that are constant on polygons, given by their edges, into
  // (nodes y, nodes x, 3). Green's theorem along x turns the integrals into sums over edges, split at the grid lines:
  // an edge feeds the element it runs in, and fills all elements of its row further left.
  void traction_forces(const TractionEdge* edges, std::size_t count, Workspace& workspace, double* forces) const;

 private:
  void add_edge(const TractionEdge& edge, Workspace& workspace) const;
  // A piece of an edge in one element, to the left or right of the sheet's in the outermost.
  void add_piece(const double* start, const double* end, const double* traction, std::size_t column, std::size_t row,
                 Workspace& workspace) const;
  void gather(Workspace& workspace, double* forces) const;

  void set_reference(double x, Workspace& workspace) const;
  void reach(std::size_t row, std::size_t column, Workspace& workspace) const;

  std::vector<double> x_, y_;
};

}  // namespace mjtactile
