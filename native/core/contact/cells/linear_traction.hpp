// Tractions that are linear over an area, and their exact nodal forces, for law "uniform".
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/face.hpp"
#include "influence/surface_grid.hpp"

namespace mjtactile {

// Area of a polygon and its integrals of x, y, x^2, x y and y^2.
struct AreaIntegrals {
  double area, x, y, xx, xy, yy;
};

// An area by its edges, each with the area on its left: start (2) and end (2) [m].
class LinearTraction {
 public:
  struct Edge {
    Point start, end;
  };

  // The area a face covers where it stands.
  void cover(const Face& face, const Placement& placement);
  const AreaIntegrals& integrals() const { return integrals_; }
  const std::vector<Edge>& edges() const { return edges_; }
  const std::vector<Point>& hull() const { return hull_; }   // counter-clockwise
  // Clip the area to where a linear function (constant, slopes along x and y) is positive.
  void keep_where(const double* function);
  // Pressure and shear that carry a wrench (force [N], moment about the pad's origin [N m]): a constant and gradients
  // along x and y of each component, (3, 3) [Pa, Pa/m]. False where it would pull somewhere.
  bool carry(const double* wrench, double* coefficients) const;
  // The same wherever it pulls; false where the area is none.
  bool fit(const double* wrench, double* coefficients) const;
  // Nodal forces (nodes y, nodes x, 3) [N] of tractions with such coefficients.
  void nodal_forces(const SurfaceGrid& grid, const double* coefficients, double* forces);

 private:
  void add_edge(const SurfaceGrid& grid, const Edge& edge);
  void add_piece(const SurfaceGrid& grid, const Point& start, const Point& end);

  AreaIntegrals integrals_ = {};
  std::vector<Edge> edges_;
  std::vector<Point> hull_;
  std::vector<Edge> cut_;
  std::vector<Point> meets_;
  std::vector<double> own_, passing_, crossings_;  // as in SurfaceGrid, of the area alone
};

// Integrals over an area by its edges, summed up about a point near it so that no digits are lost.
AreaIntegrals integrals_of(const std::vector<LinearTraction::Edge>& edges, const Point& near);
// Edges of the part of an area where a linear function is positive; `meets` is scratch.
void cut_where(const std::vector<LinearTraction::Edge>& edges, const double* function, std::vector<Point>& meets,
               std::vector<LinearTraction::Edge>& part);

}  // namespace mjtactile
