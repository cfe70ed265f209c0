// Tractions that vary linearly over an area, and their exact nodal forces, for law "uniform".
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/face.hpp"
#include "influence/surface_grid.hpp"

namespace mjtactile {

// Area of a polygon [m^2], and its integrals of x, y [m^3], x^2, x y and y^2 [m^4].
struct AreaIntegrals {
  double area, x, y, xx, xy, yy;
};

// An area in the pad frame, given by its edges [m]. The area is on the left of each edge. It owns its memory, which is
// kept between calls.
class LinearTraction {
 public:
  struct Edge {
    Point start, end;
  };

  // Set the area to that of a face at a placement.
  void cover(const Face& face, const Placement& placement);
  const AreaIntegrals& integrals() const { return integrals_; }
  const std::vector<Edge>& edges() const { return edges_; }
  const std::vector<Point>& hull() const { return hull_; }   // convex hull of the face, counter-clockwise
  // Clip the area to the half plane where a linear function (constant, slopes along x and y) is positive.
  void keep_where(const double* function);
  // Linear traction with a given wrench (force [N], moment about the pad's origin [N m]): for each component a constant
  // and the gradients along x and y, (3, 3) [Pa, Pa/m]. False if the traction would pull at a corner of the hull.
  bool carry(const double* wrench, double* coefficients) const;
  // The same, even if the traction pulls. False if the force does not press or there is no area.
  bool fit(const double* wrench, double* coefficients) const;
  // Compute the consistent nodal forces (nodes y, nodes x, 3) [N] of the traction with these coefficients.
  void nodal_forces(const SurfaceGrid& grid, const double* coefficients, double* forces);

 private:
  void add_edge(const SurfaceGrid& grid, const Edge& edge);
  void add_piece(const SurfaceGrid& grid, const Point& start, const Point& end);

  AreaIntegrals integrals_ = {};
  std::vector<Edge> edges_;
  std::vector<Point> hull_;
  std::vector<Edge> cut_;
  std::vector<Point> meets_;
  // Moments per element of the edges in it, and of those right of it, as in SurfaceGrid; scratch for add_edge().
  std::vector<double> own_, passing_, crossings_;
};

// Integrals over an area, about the pad's origin. They are summed about the point `near`, which should be close to the
// area, because cancellation is least there.
AreaIntegrals integrals_of(const std::vector<LinearTraction::Edge>& edges, const Point& near);
// Set `part` to the edges of the part of an area where a linear function is positive. `meets` is scratch memory.
void cut_where(const std::vector<LinearTraction::Edge>& edges, const double* function, std::vector<Point>& meets,
               std::vector<LinearTraction::Edge>& part);

}  // namespace mjtactile
