// A rigid body pressed into an elastic surface that sticks to it wherever they touch: pressure and shear at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/solvers/partial_slip.hpp"
#include "contact/solvers/seen_cells.hpp"
#include "geometry/polygon.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

class BondedContact {
 public:
  // Find the cells that press. `compliance`: (component, cell) by (component, cell) [m/N], whole, pad frame; `places`:
  // the cells the body may press on, `levers`: their places about a point, over a length; `heights`: of the body above
  // them [m], null where flat; `wanted`: pressing force, its two moments (force times lever) where `tilting`, shear x
  // and y, torsion over the length [N]; `start`: cells likely pressed. All by place. False where no cells were found
  // that press and stick.
  bool solve(const Matrix& compliance, std::size_t cells, const std::vector<std::size_t>& places, const Point* levers,
             const double* heights, const double* wanted, bool tilting, const std::uint8_t* start, WorkLimit& limit);

  // Of each place: shear x, shear y, pressing [N], in three blocks.
  const std::vector<double>& forces() const { return forces_; }

 private:
  bool on(const Matrix& compliance, std::size_t cells, const std::vector<std::size_t>& places, WorkLimit& limit);
  std::size_t violations(const Matrix& compliance, std::size_t cells, const std::vector<std::size_t>& places);
  void set_modes();
  bool balances() const;

  std::size_t count_ = 0;
  const Point* levers_ = nullptr;
  bool tilting_ = true;
  double unit_ = 1.0, wanted_[6] = {}, motion_[6] = {}, worst_ = 0.0;
  std::vector<double> heights_, forces_, plain_, separation_, spread_;
  std::vector<std::uint8_t> pressed_, violated_;
  std::vector<std::size_t> order_, held_, unknowns_;
  SeenCells seen_;
  SubmatrixFactor factor_;
  Matrix right_, modes_;
};

}  // namespace mjtactile
