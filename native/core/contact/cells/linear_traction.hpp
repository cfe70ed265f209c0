// Tractions that vary linearly over an area, and their exact nodal forces, for law "uniform".
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/face.hpp"
#include "influence/surface_grid.hpp"

namespace mjtactile {

// An area in the pad frame, given by its edges [m]. The area is on the left of each edge. It owns its memory, which is
// kept between calls.
class LinearTraction {
 public:
  // Set the area to that of a face at a placement.
  void cover(const Face& face, const Placement& placement);
  // Set the area by its edges alone; without a hull, `carry` is not for it.
  void cover(std::vector<Segment> edges);
  const AreaIntegrals& integrals() const { return integrals_; }
  const std::vector<Segment>& edges() const { return edges_; }
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
  void add_piece(const SurfaceGrid& grid, const double* start, const double* end, std::size_t column, std::size_t row);

  AreaIntegrals integrals_ = {};
  std::vector<Segment> edges_;
  std::vector<Point> hull_;
  std::vector<Segment> cut_;
  std::vector<Point> meets_;
  // Moments per element of the edges in it, and of those right of it, as in SurfaceGrid.
  std::vector<double> own_, passing_;
};

// Integrals over an area, about the pad's origin. They are summed about the point `near`, which should be close to the
// area, because cancellation is least there.
AreaIntegrals integrals_of(const std::vector<Segment>& edges, const Point& near);
// Set `part` to the edges of the part of an area where a linear function is positive. `meets` is scratch memory.
void cut_where(const std::vector<Segment>& edges, const double* function, std::vector<Point>& meets,
               std::vector<Segment>& part);

}  // namespace mjtactile
