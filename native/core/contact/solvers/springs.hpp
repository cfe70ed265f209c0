// A rigid body on a bed of independent springs that do not pull (Winkler's foundation). It is contact law "foundation",
// and a quick first guess of the cells that are pressed on an elastic surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "linalg/dense.hpp"

namespace mjtactile {

class SpringBed {
 public:
  // Press a body into springs. `stiffness` (cells) [N/m]; `modes`, `motions`, `heights` and `resultants` as in
  // RigidProblem; `most` (cells): forces at which the springs yield [N], null for none. False if no motion was found
  // that carries the resultants; the functions below then give the last approximation.
  bool solve(const std::vector<double>& stiffness, const double* modes, std::size_t motions, const double* heights,
             const double* resultants, const double* most = nullptr);

  const std::vector<std::uint8_t>& pressed() const { return pressed_; }
  const std::vector<double>& forces() const { return forces_; }  // (cells) [N]
  const double* motion() const { return motion_; }               // of the body into the springs (motions) [m]

 private:
  static constexpr std::size_t kMost = 3;   // motions
  void set_rows(const double* modes, const double* heights, const double* most);
  void begin();
  bool settle();
  void press(const double* motion);
  double residual();
  bool step_with(const std::vector<double>& stiffnesses);
  void step_with_open_tilt(const double* curvature, double* along) const;
  double line_search(const double* step, double slope);

  const std::vector<double>* stiffness_ = nullptr;
  const double* resultants_ = nullptr;
  std::size_t motions_ = 0;
  double total_ = 0.0, motion_[kMost] = {}, gradient_[kMost] = {};
  double damping_ = 0.0;                            // fraction of all stiffness that resists a step
  Matrix modes_;                                    // (kMost, cells), 0 for rows beyond motions_
  std::vector<double> heights_, most_, softened_;
  std::vector<double> depths_, forces_, elastic_;   // of each spring: depth [m], force [N], present stiffness [N/m]
  std::vector<double> rates_, weighted_;            // change of the depths along a step; scratch
  std::vector<std::uint8_t> pressed_;
};

}  // namespace mjtactile
