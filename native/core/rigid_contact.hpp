// A rigid body pressed into an elastic surface without friction, cell by cell.
//
// Cell forces F >= 0 minimise 1/2 F.A F + g.F under given resultants B^T F = q: A the compliance, g the heights of the
// body above the cells, B the cells' displacements per rigid motion of the body. The multipliers of the resultants are
// the body's motion d; the separation A F - (B d - g) is nowhere negative, and zero wherever the surface is pressed.
// While the same cells are pressed all of this is linear in (q, 1).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "dense.hpp"
#include "springs.hpp"

namespace mjtactile {

constexpr std::size_t kMostMotions = 3;

class RigidContact {
 public:
  // Find the cells that press. `compliance`: symmetric, upper triangle (cells, cells) [m/N]; `modes`: (cells, motions),
  // of which the first moves every cell by 1; `heights`: (cells) [m], null where they are all zero; `resultants`:
  // (motions) [N]. `start`: cells likely pressed, (cells), null where nothing is known. False where no contact is found:
  // slower, surer ways remain then.
  bool solve(const Matrix& compliance, const double* modes, std::size_t motions, const double* heights,
             const double* resultants, const std::uint8_t* start);
  // The same, by exchanging cells that violate their conditions only; `start` null for all cells.
  // `flexible`: go on where pressed cells leave a tilt open.
  bool exchange(const Matrix& compliance, const double* modes, std::size_t motions, const double* heights,
                const double* resultants, const std::uint8_t* start, bool flexible = true);

  // The same where no cell bears more than `most` (cells) [N]: those that would bear just that, and others help them.
  // `start`: of the unbounded contact. Forces (cells) [N], the body's motion (motions); false where no contact is found.
  bool solve_bounded(const Matrix& compliance, const double* modes, std::size_t motions, const double* heights,
                     const double* resultants, const double* most, const std::vector<std::uint8_t>& start,
                     std::vector<double>& forces, double* motion);

  std::size_t cells() const { return pressed_.size(); }
  std::size_t motions() const { return motions_; }
  const std::vector<std::uint8_t>& pressed() const { return pressed_; }
  // (q, 1) to forces pressing on each cell [N], to the body's motion into the pad, and to its separation from each
  // cell [m]; (cells or motions, motions + 1).
  const Matrix& map_forces() const { return map_forces_; }
  const Matrix& map_motion() const { return map_motion_; }
  const Matrix& map_separation() const { return map_separation_; }

  // Forces (cells) [N] under other resultants; false where other cells would be pressed.
  bool under(const double* resultants, double* forces) const;

 private:
  bool on(const Matrix& compliance, const double* modes, const double* heights, const double* resultants);
  void to_flexible_motion(const double* resultants);
  bool descend(const Matrix& compliance, const double* modes, const double* heights, const double* resultants);
  bool balances(const double* modes, const double* resultants) const;
  std::size_t violated(const double* resultants, std::vector<std::uint8_t>& violated) const;

  std::size_t motions_ = 0;
  bool flexible_ = true;
  std::vector<std::uint8_t> pressed_, exchange_;
  SpringBed springs_;
  std::vector<double> stiffnesses_, forces_, pushed_;
  std::vector<std::uint8_t> full_;
  double pressed_heights_[kMostMotions] = {};  // B^T A^-1 g of the pressed cells
  std::vector<std::uint64_t> seen_;
  std::vector<std::size_t> places_;
  Matrix factor_, right_, stiffness_, map_forces_, map_motion_, map_separation_;
};

}  // namespace mjtactile
