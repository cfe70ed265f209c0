// A rigid body on a bed of independent springs that do not pull (Winkler's foundation). It is contact law "foundation",
// and a quick first guess of the cells that are pressed on an elastic surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

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
  struct Turn {         // a kink of the energy's slope along a step: its place, and the change of the second derivative
    double at, bend;
  };
  static constexpr std::size_t kMost = 3;   // motions
  void begin();
  double left_over();
  bool step();
  void leave_open(const double* curvature, double* along) const;
  double lowest(const double* motion, const double* step, double slope);
  double overlap(std::size_t cell, const double* motion) const;
  bool yields(std::size_t cell, double depth) const { return most_ != nullptr && (*stiffness_)[cell] * depth > most_[cell]; }
  double force(std::size_t cell, double depth) const {
    return !(depth > 0.0) ? 0.0 : yields(cell, depth) ? most_[cell] : (*stiffness_)[cell] * depth;
  }

  const std::vector<double>* stiffness_ = nullptr;
  const double *modes_ = nullptr, *heights_ = nullptr, *resultants_ = nullptr, *most_ = nullptr;
  std::size_t motions_ = 0;
  double total_ = 0.0, motion_[kMost] = {}, gradient_[kMost] = {};
  std::vector<std::uint8_t> pressed_;
  std::vector<double> forces_, rates_;
  std::vector<Turn> turns_;
};

}  // namespace mjtactile
