// Shear of a contact under a known pressure. Cells stick where friction can bear the shear, and slip elsewhere.
//
// The shear forces t minimise 1/2 t.C t + slip.t under given resultants and |t| <= mu F on each cell, where C is the
// compliance. This is the law of a surface that is loaded once, without history. A semismooth Newton method finds the
// cells that slip (Hueber, Stadler, Wohlmuth, SIAM J. Sci. Comput. 30, 2008). If it does not converge, an
// interior-point method is used (Nocedal, Wright, Numerical Optimization, 2006, chapter 19).
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/solvers/limit_surface.hpp"
#include "contact/solvers/work_limit.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

// Cells of a grip that carry shear.
struct SlipProblem {
  const Matrix& compliance;   // (2 cells, 2 cells), both triangles [m/N]
  const ShearGrip& grip;
  const double* slip;         // (2, cells): displacement by the pressure alone [m]
  const double* wanted;       // resultants, which friction can carry [N]
};

class PartialSlip {
 public:
  // Find the shear (2, cells) [N]. If `known`, `shear` holds the result of the last call on the same cells, near which
  // the solution lies. False if neither method converges within the limit of work.
  bool solve(const SlipProblem& problem, double friction, bool known, WorkLimit& limit, double* shear);
  // Find the shear if no cell slips, whatever friction bears. False if the compliance is not positive definite.
  bool bonded(const SlipProblem& problem, WorkLimit& limit, double* shear);

 private:
  void scale(const SlipProblem& problem, double unit, bool same);
  bool newton(bool known, WorkLimit& limit);
  bool newton_step(bool sticks, bool again, WorkLimit& limit);
  bool linearise(bool sticks, std::size_t stuck, WorkLimit& limit);
  // Where the interior-point method stands: the mean of multiplier times slack, the largest error of the equations, the
  // least slack, and what the resultants miss.
  struct OnPath {
    double gap = INFINITY, error = INFINITY, tightest = INFINITY, missing[3] = {};
  };
  bool interior(WorkLimit& limit);
  void measure_slack();
  OnPath interior_residual();
  bool interior_step(const OnPath& here);
  double share_inside();
  void displace();
  double residual();
  void missing(double* missing) const;
  bool balance();
  void nearly_slide(const double* direction);

  std::size_t cells_ = 0;
  double give_ = 1.0, unit_ = 1.0, turn_ = 1.0;  // units: compliance [m/N], force [N], lever arm over the length [-]
  double wanted_[3] = {}, motion_[3] = {};
  Matrix own_, factor_, right_;
  std::vector<double> modes_;  // displacement per motion, (3, 2 cells)
  std::vector<double> shear_, load_, radius_, moved_, pushed_, bend_, known_;
  std::vector<double> multiplier_, slack_, change_, slide_, axis_;
  std::vector<std::uint8_t> slips_;
  bool all_stick_ = false;  // whether `factor_` holds the system of these cells when all of them stick
  bool slid_ = false;       // whether all cells slid in the last solution
  std::vector<std::uint32_t> cell_of_;
};

}  // namespace mjtactile
