// Law "uniform": a linear pressure on a flat face that is zero where it would pull, and shear that friction bears.
//
// The pressure max(0, c0 + c1 x + c2 y) with a given force and first moments is the minimum of a convex function, the
// integral of p^2 / 2 minus the work of the given moments: a face on springs that cannot pull. Newton's method with
// damping finds it; each step needs the moments of the part of the face where the pressure is positive.
#pragma once

#include <vector>

#include "contact/cells/linear_traction.hpp"
#include "contact/solvers/limit_surface.hpp"

namespace mjtactile {

class UniformPress {
 public:
  // Nodal forces (nodes y, nodes x, 3) [N] under a wrench that presses, or the nearest to it that the face carries;
  // `friction`: coefficient, negative: no bound. False where no pressure was found.
  bool solve(const Face& face, const Placement& placement, const SurfaceGrid& grid, const double* wrench,
             double friction, double* forces);

  // What is under pressure.
  const LinearTraction& traction() const { return traction_; }
  const double* carried() const { return carried_; }   // the wrench, (6)
  double peak() const { return peak_; }                 // largest pressure [Pa]

 private:
  bool find_part(const double* moments);
  double energy(const double* coefficients, const double* wanted, double moments[3][3]);
  bool hold(const SurfaceGrid& grid, double friction, double* wrench, const double* forces);

  LinearTraction traction_;
  std::vector<LinearTraction::Edge> whole_, part_;
  std::vector<Point> crossings_;
  Point centre_ = {0.0, 0.0};
  double scale_ = 1.0, carried_[6] = {}, peak_ = 0.0;
  ShearGrip grip_;
  std::vector<Point> points_;
  std::vector<double> normal_, shear_;
  std::vector<std::size_t> places_;
};

}  // namespace mjtactile
