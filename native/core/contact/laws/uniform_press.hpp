// Contact law "uniform": pressure on a flat face varies linearly and is zero where it would pull.
//
// The pressure p = max(0, c0 + c1 x + c2 y) with a given force and moments is that of a face on springs that cannot
// pull. Its coefficients minimise a convex function: the integral of p^2 / 2, minus the work of the given force and
// moments. Newton's method with damping finds them. Each step needs the moments of the part of the face where p is
// positive.
#pragma once

#include <vector>

#include "contact/cells/linear_traction.hpp"
#include "contact/solvers/limit_surface.hpp"

namespace mjtactile {

class UniformPress {
 public:
  // Find the nodal forces (nodes y, nodes x, 3) [N] under a wrench (6) [N, N m] that presses, or under the nearest
  // wrench that the face carries. `friction`: coefficient; negative: no bound. False if no pressure was found.
  bool solve(const Face& face, const Placement& placement, const SurfaceGrid& grid, const double* wrench,
             double friction, double* forces);

  // Traction on the part of the face under pressure.
  const LinearTraction& traction() const { return traction_; }
  const double* carried() const { return carried_; }   // wrench (6) that the face carries [N, N m]
  double peak() const { return peak_; }                 // largest pressure [Pa]

 private:
  bool find_part(const double* moments);
  double energy(const double* coefficients, const double* wanted, double moments[3][3]);
  bool hold(const SurfaceGrid& grid, double friction, double* wrench, const double* forces);

  LinearTraction traction_;
  std::vector<Segment> whole_, part_;
  std::vector<Point> crossings_;
  Point centre_ = {0.0, 0.0};
  double scale_ = 1.0, carried_[6] = {}, peak_ = 0.0;
  ShearGrip grip_;
  std::vector<Point> points_;
  std::vector<double> normal_, shear_;
  std::vector<std::size_t> places_;
};

}  // namespace mjtactile
