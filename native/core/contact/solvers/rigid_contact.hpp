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

#include "contact/solvers/springs.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

constexpr std::size_t kMostMotions = 3;

// What is pressed on what.
struct RigidProblem {
  const Matrix* compliance;    // symmetric (cells, cells) [m/N]
  const double* modes;         // (cells, motions), of which the first moves every cell by 1
  std::size_t motions;
  const double* heights;       // (cells) [m]; null where they are all zero
  const double* resultants;    // (motions) [N]

  std::size_t cells() const { return compliance->rows(); }
  double height(std::size_t cell) const { return heights == nullptr ? 0.0 : heights[cell]; }
};

class RigidContact {
 public:
  // The compliance or the modes of the next problem are others: what was factored is of no use.
  void forget() { factor_.forget(), order_.clear(), definite_ = true; }
  // Begin to count the work anew: what takes too much of it is given up.
  void allow() { work_ = 0.0; }
  // Find the cells that press. `start`: cells likely pressed, (cells), null where nothing is known. False where no contact
  // is found.
  bool solve(const RigidProblem& problem, const std::uint8_t* start);
  // The same, by exchanging cells that violate their conditions only; `start` null for all cells.
  // `flexible`: go on where pressed cells leave a tilt open.
  bool exchange(const RigidProblem& problem, const std::uint8_t* start, bool flexible = true);
  // The same where no cell bears more than `most` (cells) [N]: those that would bear just that, and others help them.
  // `start`: of the unbounded contact. Cells that cannot bear the load where it is bear it as near to there as they can.
  // Where no such contact is found forces are those of a bed of springs that yield.
  bool solve_bounded(const RigidProblem& problem, const double* most, const std::vector<std::uint8_t>& start);

  // Whether the compliance was positive definite wherever it was factored since `forget`.
  bool definite() const { return definite_; }
  // Whether forces carry the resultants although solve_bounded() found no contact.
  bool carries() const { return carries_; }
  std::size_t cells() const { return pressed_.size(); }
  std::size_t motions() const { return motions_; }
  const std::vector<std::uint8_t>& pressed() const { return pressed_; }
  const std::vector<double>& forces() const { return forces_; }  // pressing on each cell [N]
  const double* motion() const { return motion_; }               // of the body into the pad, by mode

  // Linear maps of the contact that was found last, without bounds: (q, 1) to forces pressing on each cell [N], to the
  // body's motion, and to its separation from each cell [m]; (cells or motions, motions + 1).
  void make_maps(const RigidProblem& problem);
  const Matrix& map_forces() const { return map_forces_; }
  const Matrix& map_motion() const { return map_motion_; }
  const Matrix& map_separation() const { return map_separation_; }
  // Forces (cells) [N] under other resultants, by the maps; false where other cells would be pressed.
  bool under(const double* resultants, double* forces) const;

 private:
  bool on(const RigidProblem& problem);
  void set_springs(const RigidProblem& problem);
  bool exchange_bounded(const RigidProblem& problem, const double* most);
  bool factor_pressed(const RigidProblem& problem);
  bool invert_stiffness(const double* wanted);
  void separate(const RigidProblem& problem, const double* forces, const double* motion, double* separation) const;
  bool descend(const RigidProblem& problem);
  bool balances(const RigidProblem& problem) const;
  std::size_t violated(std::vector<std::uint8_t>& violated) const;
  std::size_t find_wrong(const RigidProblem& problem, const double* most, double scale);
  void send_over(double share);

  std::size_t motions_ = 0;
  bool flexible_ = true, definite_ = true, carries_ = true;
  std::vector<std::uint8_t> pressed_, exchange_, full_;
  std::vector<double> forces_, separation_, excess_, reached_, pushed_, stiffnesses_, column_;
  double work_ = 0.0;
  double motion_[kMostMotions] = {};
  double pressed_heights_[kMostMotions] = {};             // B^T A^-1 g of the pressed cells
  double stiffness_[kMostMotions][kMostMotions] = {};     // B^T A^-1 B of the pressed cells
  double flexibility_[kMostMotions][kMostMotions] = {};   // its inverse
  SpringBed springs_;
  std::vector<std::size_t> order_, places_, filled_;
  // Of the pressed cells: the factor U of their compliance, and U^-T B and U^-T g by row.
  SubmatrixFactor factor_;
  Matrix modes_, heights_;
  Matrix map_forces_, map_motion_, map_separation_;
};

}  // namespace mjtactile
