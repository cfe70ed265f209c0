// A rigid body pressed into an elastic surface without friction, cell by cell.
//
// Cell forces F >= 0 minimise 1/2 F.A F + g.F under given resultants B^T F = q. A is the compliance, g are the heights
// of the body above the cells, and B are the cells' displacements per rigid motion of the body. The multipliers of the
// resultants are the body's motion d. The separation A F - (B d - g) is nowhere negative, and it is zero on pressed
// cells. While the same cells are pressed, the solution is linear in (q, 1).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/solvers/springs.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

constexpr std::size_t kMostMotions = 3;

// The problem to solve: A, B, g and q of the text above.
struct RigidProblem {
  const Matrix* compliance;    // A, symmetric (cells, cells) [m/N]
  const double* modes;         // B, (cells, motions) [-]; the first motion moves every cell by 1
  std::size_t motions;
  const double* heights;       // g, (cells) [m]; null if all are zero
  const double* resultants;    // q, (motions) [N]

  std::size_t cells() const { return compliance->rows(); }
  double height(std::size_t cell) const { return heights == nullptr ? 0.0 : heights[cell]; }
};

class RigidContact {
 public:
  // Drop the factors. Call this before a problem with another compliance or other modes.
  void forget() { factor_.forget(), order_.clear(), definite_ = true; }
  // Reset the count of work. A solution that needs too much work is given up.
  void allow() { work_ = 0.0; }
  // Find the cells that press. `start` (cells): cells that are likely pressed; null if nothing is known. False if no
  // contact is found.
  bool solve(const RigidProblem& problem, const std::uint8_t* start);
  // The same, but only by exchanging cells that violate their conditions, without other methods. `start`: null for all
  // cells.
  bool exchange(const RigidProblem& problem, const std::uint8_t* start) {
    return exchange_from(problem, start, problem.cells());
  }
  // The same, where no cell bears more than `most` (cells) [N]. Cells at this limit keep it, and others carry the rest.
  // `start`: cells pressed in the contact without limits. A load that the cells cannot bear is moved to the nearest one
  // that they can. If no such contact is found, the forces are those of a bed of yielding springs.
  bool solve_bounded(const RigidProblem& problem, const double* most, const std::vector<std::uint8_t>& start);

  // Whether the compliance was positive definite in every factorisation since `forget`.
  bool definite() const { return definite_; }
  // Whether the forces carry the resultants even if solve_bounded() found no contact.
  bool carries() const { return carries_; }
  // Whether the contact that solve_bounded() found last is that without limits: no cell bears its limit, and the load
  // was not moved.
  bool is_free() const { return !moved_ && std::find(full_.begin(), full_.end(), 1) == full_.end(); }
  std::size_t cells() const { return pressed_.size(); }
  const std::vector<std::uint8_t>& pressed() const { return pressed_; }
  const std::vector<double>& forces() const { return forces_; }  // pressing on each cell [N]
  const double* motion() const { return motion_; }               // of the body into the pad (motions) [m]

  // Compute the linear maps of the last contact, which must be without limits. They take (q, 1) to the pressing forces
  // on the cells [N], to the body's motion [m] and to its separation from the cells [m]; (cells or motions, motions +
  // 1).
  void make_maps(const RigidProblem& problem);
  const Matrix& map_forces() const { return map_forces_; }
  // Forces (cells) [N] under other resultants, from the maps. False if other cells would be pressed.
  bool under(const double* resultants, double* forces) const;

 private:
  bool exchange_from(const RigidProblem& problem, const std::uint8_t* start, std::size_t far_off);
  bool solve_pressed(const RigidProblem& problem);
  void add_motion(const double* resultants);
  void set_springs(const RigidProblem& problem);
  void start_from_springs(const double* most);
  bool exchange_bounded(const RigidProblem& problem, const double* most, std::size_t far_off);
  bool descend_bounded(const RigidProblem& problem, const double* most);
  double step_within(const double* most);
  bool on_free(const RigidProblem& problem, const double* most);
  bool fill_up(const RigidProblem& problem, const double* most);
  bool factor_pressed(const RigidProblem& problem);
  void invert_stiffness(const double* wanted);
  void separate(const RigidProblem& problem, const double* forces, const double* motion, double* separation) const;
  bool descend(const RigidProblem& problem);
  bool balances(const RigidProblem& problem) const;
  std::size_t violated(std::vector<std::uint8_t>& violated) const;
  std::size_t find_violated(const RigidProblem& problem, const double* most);
  void change_sides(double share);

  std::size_t motions_ = 0;
  bool definite_ = true, carries_ = true, moved_ = false;
  std::vector<std::uint8_t> pressed_, exchange_, full_;
  std::vector<double> forces_, separation_, excess_, reached_, borne_, pushed_, stiffnesses_, column_;
  double work_ = 0.0;
  double motion_[kMostMotions] = {};
  double pressed_heights_[kMostMotions] = {};             // B^T A^-1 g of the pressed cells
  double stiffness_[kMostMotions][kMostMotions] = {};     // B^T A^-1 B of the pressed cells
  double flexibility_[kMostMotions][kMostMotions] = {};   // its inverse
  SpringBed springs_;
  std::vector<std::size_t> order_, places_;
  // Of the pressed cells: the factor U of their compliance A = U^T U, and U^-T B and U^-T g by row.
  SubmatrixFactor factor_;
  Matrix modes_, heights_;
  Matrix map_forces_, map_motion_, map_separation_;
};

}  // namespace mjtactile
