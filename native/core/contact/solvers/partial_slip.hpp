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
  // Whether the load is the largest that friction carries in its direction, so that all cells slide. `shear` (2, cells)
  // [N] is that of sliding, scaled to the load.
  bool slides(const ShearGrip& grip, const double* wanted, double friction, double* shear);
  // Whether all cells slid in the last solution.
  bool slid() const;
  // Find the shear (2, cells) [N]. If `known`, `shear` holds the result of the last call on the same cells, near which
  // the solution lies. Otherwise it holds what slides() answered to this problem. False if neither method converges
  // within the limit of work.
  bool solve(const SlipProblem& problem, double friction, bool known, WorkLimit& limit, double* shear);
  // Find the shear if no cell slips, whatever friction bears. False if the compliance is not positive definite.
  bool bonded(const SlipProblem& problem, WorkLimit& limit, double* shear);

 private:
  void scale(const SlipProblem& problem, double unit, bool same);
  bool newton(bool known, WorkLimit& limit);
  bool newton_step(bool all_stick, bool same_system, WorkLimit& limit);
  void solve_step(const double* left, const double* moved, double* motion);
  std::size_t set_unknowns(bool all_stick);
  bool linearise(std::size_t stuck, WorkLimit& limit);
  // State of the interior-point method: the mean product of multiplier and slack, the largest error of the equations,
  // the least slack, and the missing resultants.
  struct PathState {
    double gap = INFINITY, error = INFINITY, tightest = INFINITY, missing[3] = {};
  };
  bool interior_point(WorkLimit& limit);
  void measure_slack();
  PathState interior_residual();
  bool interior_step(const PathState& here);
  double share_inside(const double* change);
  void displace();
  double residual();
  void missing(double* missing) const;
  bool balance();
  void start_near_sliding(const double* direction);

  std::size_t cells_ = 0;
  // Units in which the problem is scaled: compliance [m/N], force [N], lever arm over the length [-].
  double compliance_unit_ = 1.0, force_unit_ = 1.0, lever_unit_ = 1.0;
  double wanted_[3] = {}, motion_[3] = {};
  Matrix compliance_, factor_, right_;
  std::vector<double> modes_;        // displacement per motion, (3, 2 cells)
  std::vector<double> free_slip_;    // slip by the pressure alone
  std::vector<double> shear_, trial_, displacement_;
  std::vector<double> radius_;       // of the friction circles
  std::vector<double> radial_step_;  // step of slipping cells onto their circles
  std::vector<double> axis_, curvature_;   // per unknown: its direction, and the circle's part of the system's diagonal
  std::vector<double> change_, interior_shear_;
  std::vector<double> multiplier_, slack_, multiplier_change_;
  std::vector<std::uint8_t> slips_;
  std::vector<std::uint8_t> factored_;   // which cells slip in the system whose factor `factor_` holds; empty if none
  // Of the last answer of slides(): the load over the largest that friction carries, and the direction of sliding.
  double share_ = 0.0, direction_[3] = {};
  std::vector<std::uint32_t> cell_of_;   // cell of each unknown
};

}  // namespace mjtactile
