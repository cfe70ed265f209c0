// The sensing surface as a grid of quadratic elements, and the exact nodal forces of tractions on polygons.
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {

// An edge of a polygon [m], and the traction on its left minus the traction on its right [Pa].
struct TractionEdge {
  Point start, end;
  double traction[3];
};

// Quadratic elements on the sheet's surface, in the pad frame. Nodes are at the elements' boundaries and middles.
class SurfaceGrid {
 public:
  // Coordinates of the element boundaries along x and along y, ascending [m].
  SurfaceGrid(std::vector<double> x, std::vector<double> y);

  const std::vector<double>& x() const { return x_; }
  const std::vector<double>& y() const { return y_; }
  std::size_t nodes_x() const { return 2 * x_.size() - 1; }
  std::size_t nodes_y() const { return 2 * y_.size() - 1; }
  // Coordinate of a column or a row of nodes [m].
  double node_x(std::size_t column) const { return node(x_, column); }
  double node_y(std::size_t row) const { return node(y_, row); }
  Rectangle sheet() const { return {x_.front(), y_.front(), x_.back(), y_.back()}; }   // [m]

  // Memory that the caller keeps between calls, so that they do not allocate.
  struct Workspace {
    std::vector<double> moments;           // per element: integrals over the edges in it and over those right of it
    std::vector<std::size_t> first, last;  // per row: range of elements that contain edges, first > last for none
    std::size_t reference_column = 0;      // column of elements that contains the start of the first edge
    double reference[3] = {};              // powers 1 to 3 of xi from which areas in that column are counted
  };

  // Compute the consistent nodal forces (nodes y, nodes x, 3) [N] of tractions that are constant on polygons. Polygons
  // are given by their edges. Green's theorem turns area integrals into sums over the edges, split at the grid lines.
  // An edge contributes to the element that contains it and to all elements of the same row on its left.
  void traction_forces(const TractionEdge* edges, std::size_t count, Workspace& workspace, double* forces) const;

 private:
  static double node(const std::vector<double>& ends, std::size_t number) {
    return number % 2 == 0 ? ends[number / 2] : (ends[number / 2] + ends[number / 2 + 1]) / 2;
  }
  // Add a piece of an edge that lies in one element. Pieces beside the sheet count for the nearest element.
  void add_piece(const double* start, const double* end, const double* traction, std::size_t column, std::size_t row,
                 Workspace& workspace) const;
  void sum_elements(Workspace& workspace, double* forces) const;

  void set_reference(double x, Workspace& workspace) const;
  void include(std::size_t row, std::size_t column, Workspace& workspace) const;

  std::vector<double> x_, y_;
};

}  // namespace mjtactile
