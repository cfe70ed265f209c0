// A rigid body in a bed of springs that do not pull: law "foundation", and a quick guess at which cells of an elastic
// surface it presses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mjtactile {

class SpringBed {
 public:
  // Press a body into springs of a stiffness each (cells) [N/m]; the rest as in RigidContact, the first mode moves every
  // cell by 1. False where no motion was found that carries the resultants; what was found last is there all the same.
  // `most`: forces above which springs yield (cells) [N]; null for none.
  bool solve(const std::vector<double>& stiffness, const double* modes, std::size_t motions, const double* heights,
             const double* resultants, const double* most = nullptr);

  const std::vector<std::uint8_t>& pressed() const { return pressed_; }
  const std::vector<double>& forces() const { return forces_; }  // (cells) [N]
  const double* motion() const { return motion_; }               // of the body into the springs, by mode

 private:
  struct Turn {         // of the energy's slope along a step: how far, and what is added to how the slope grows
    double at, bend;
  };
  double lowest(const double* motion, const double* step, double slope);
  double overlap(std::size_t cell, const double* motion) const;
  bool yields(std::size_t cell, double depth) const { return most_ != nullptr && (*stiffness_)[cell] * depth > most_[cell]; }
  double force(std::size_t cell, double depth) const {
    return !(depth > 0.0) ? 0.0 : yields(cell, depth) ? most_[cell] : (*stiffness_)[cell] * depth;
  }

  const std::vector<double>* stiffness_ = nullptr;
  const double *modes_ = nullptr, *heights_ = nullptr, *resultants_ = nullptr, *most_ = nullptr;
  std::size_t motions_ = 0;
  double motion_[3] = {};
  std::vector<std::uint8_t> pressed_;
  std::vector<double> forces_, rates_;
  std::vector<Turn> turns_;
};

}  // namespace mjtactile
