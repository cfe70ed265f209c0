// A rigid body pressed into an elastic surface that sticks to it where they touch. Pressure and shear are solved
// together. At the rim of the contact some cells would pull if they stuck, but overlap if they were free. These cells
// press without shear.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/solvers/partial_slip.hpp"
#include "contact/solvers/seen_cells.hpp"
#include "geometry/polygon.hpp"
#include "linalg/dense.hpp"
#include "linalg/small.hpp"

namespace mjtactile {

struct BondedProblem {
  const Matrix& compliance;   // of all cells, (3 cells, 3 cells) by component and cell, both triangles, pad frame [m/N]
  std::size_t cells;
  const std::vector<std::size_t>& places;   // numbers of the cells on which the body may press
  const Point* levers;        // positions of the places relative to a point, divided by a length [-]
  const double* heights;      // of the body above the places [m]; null for a flat face
  const double* wanted;       // pressing force; if `tilting`, its two moments (force times lever); shear x and y;
                              // torsion over the length [N]
  bool tilting;               // whether the body may tilt
};

class BondedContact {
 public:
  // Find the cells that press, and the forces on them. `start` (places): those that are likely pressed. False if no set
  // of cells that press was found.
  bool solve(const BondedProblem& problem, const std::uint8_t* start, WorkLimit& limit);

  // Forces on the places (3, places) [N]: shear x, shear y, pressing.
  const std::vector<double>& forces() const { return forces_; }

 private:
  static constexpr std::size_t kMotions = 6;
  // A component of the force on a place, an unknown of the linear system.
  struct Held {
    std::size_t place, component;
  };
  bool solve_on_pressed(const BondedProblem& problem, WorkLimit& limit);
  std::size_t violations(const BondedProblem& problem);
  void let_slip();
  void exchange(std::size_t place);
  std::size_t kept_unknowns() const;
  void hold_pressed(const BondedProblem& problem);
  void set_modes();
  void set_right_sides();
  MotionStiffness stiffness_on_held() const;
  void set_held_forces();
  bool scatter_forces(const BondedProblem& problem);
  bool balances() const;

  std::size_t count_ = 0;
  const Point* levers_ = nullptr;
  bool tilting_ = true;
  double force_unit_ = 1.0;   // forces are divided by it in the linear system [N]
  double wanted_[kMotions] = {}, motion_[kMotions] = {};
  double unchanged_ = 0.0;    // height below which no cell has changed since the last factorisation [m/N]
  double worst_ = 0.0;        // largest violation, over the largest force or separation [-]
  std::vector<double> heights_, forces_, held_forces_, separation_, all_forces_;
  std::vector<std::uint8_t> pressed_, slips_, violated_;
  std::vector<Held> held_;
  std::vector<std::size_t> order_, unknowns_;
  SeenCells seen_;
  SubmatrixFactor factor_;
  Matrix right_sides_, modes_;
};

}  // namespace mjtactile
