// Shear of a contact that sticks where it can and slips where it reaches what friction bears, under a known pressure.
//
// It minimises 1/2 t.C t + slip.t under given resultants and |t| <= mu F on each cell: the law of a surface loaded
// once, without history. A semismooth Newton method finds which cells slip (Hueber, Stadler, Wohlmuth, SIAM J. Sci.
// Comput. 30, 2008); where it does not settle, an interior-point method does (Nocedal, Wright, Numerical Optimization,
// 2006, chapter 19).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/solvers/limit_surface.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

// Multiplications that the factorisations of one contact may take together: what bounds its time.
class WorkLimit {
 public:
  void allow(double multiplications) { left_ = multiplications; }
  // Whether a symmetric matrix of this size may be factored.
  bool factorisation(std::size_t size) {
    left_ -= work(size);
    return left_ >= 0.0;
  }
  // Whether so many such factorisations are left.
  bool leaves(std::size_t size, double count) const { return left_ >= count * work(size); }

 private:
  static double work(std::size_t size) {
    const auto n = static_cast<double>(size);
    return n * n * n / 6.0 + 10.0 * n * n;  // with what is multiplied and gathered about it
  }

  double left_ = 0.0;
};

class PartialSlip {
 public:
  // Shear (2, cells) [N] of the cells of a grip. `compliance`: (2 cells, 2 cells) [m/N], whole; `slip`: displacement
  // that the pressure alone brings, (2, cells) [m]; `wanted`: resultants within the limit [N]. With `known`, `shear` is
  // near the solution on entry, which is that of the last call on these cells. False where neither method converges within
  // the limit of work.
  bool solve(const Matrix& compliance, const ShearGrip& grip, const double* slip, const double* wanted, double friction,
             bool known, WorkLimit& limit, double* shear);
  // Shear where no cell slips at all; false where the compliance is not positive definite.
  bool bonded(const Matrix& compliance, const ShearGrip& grip, const double* slip, const double* wanted,
              WorkLimit& limit, double* shear);

 private:
  void scale(const Matrix& compliance, const ShearGrip& grip, const double* slip, const double* wanted, double unit,
             bool same);
  bool newton(bool known, WorkLimit& limit);
  bool newton_step(bool sticks, bool again, WorkLimit& limit);
  bool linearise(bool sticks, std::size_t stuck, WorkLimit& limit);
  bool interior(WorkLimit& limit);
  void displace();
  double residual();
  void missing(double* missing) const;
  bool balance();
  void nearly_slide(const double* direction);

  std::size_t cells_ = 0;
  double give_ = 1.0, unit_ = 1.0, turn_ = 1.0;  // units: compliance [m/N], force [N], lever arm over the length
  double wanted_[3] = {}, motion_[3] = {};
  Matrix own_, factor_, right_;
  std::vector<double> modes_;  // displacement per motion, (3, 2 cells)
  std::vector<double> shear_, load_, radius_, moved_, pushed_, bend_, known_;
  std::vector<double> multiplier_, slack_, change_, slide_, axis_;
  std::vector<std::uint8_t> slips_;
  bool all_stick_ = false;  // whether `factor_` holds the system of these cells when all of them stick
  bool slid_ = false;       // whether the last shear was that of a whole that slides
  std::vector<std::uint32_t> cell_of_;
};

}  // namespace mjtactile
