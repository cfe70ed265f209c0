#include <algorithm>

#include "contact/laws/by_name.hpp"

namespace mjtactile {
namespace {

// Solve for pressure and shear together. False if no contact is found.
bool bonded(const ShearProblem& problem, ShearWork& work, double* forces) {
  const PressedCells& cells = problem.cells;
  const double* wrench = problem.wrench;
  const std::size_t count = work.reached.size();
  work.levers.resize(count);
  work.heights.resize(count);
  work.start.resize(count);
  const double touching = most_of_touching(cells, cells.pressing);
  double wanted[6] = {};
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t place = work.reached[i];
    const double pressing = cells.pressing[place];
    work.levers[i] = cells.lever(place);
    if (cells.heights != nullptr) work.heights[i] = cells.heights[place];
    work.start[i] = pressing > touching ? 1 : 0;
    wanted[0] += pressing;
    wanted[1] += pressing * work.levers[i].x;
    wanted[2] += pressing * work.levers[i].y;
  }
  wanted[3] = wrench[0];
  wanted[4] = wrench[1];
  wanted[5] = (wrench[5] - (cells.middle.x * wrench[1] - cells.middle.y * wrench[0])) / cells.length;
  const double* heights = cells.heights == nullptr ? nullptr : work.heights.data();
  const BondedProblem body = {problem.compliance->whole(), cells.count, work.reached, work.levers.data(), heights,
                              wanted, cells.tilting};
  if (!work.bonded.solve(body, work.start.data(), work.limit)) return false;
  std::fill(forces, forces + 3 * cells.count, 0.0);
  const double* found = work.bonded.forces().data();
  for (std::size_t i = 0; i < count; ++i) {
    double* force = forces + 3 * work.reached[i];
    force[0] = found[i], force[1] = found[count + i], force[2] = -found[2 * count + i];
  }
  return true;
}

// Solve for the shear if all cells that press without friction stick, with the pressure unchanged. False if the
// compliance is not positive definite.
bool bonded_as_pressed(const ShearProblem& problem, ShearWork& work, double* forces) {
  const PressedCells& cells = problem.cells;
  work.hold(cells, cells.pressing);
  work.displace(cells, problem.compliance->whole(), cells.pressing);
  double wanted[3];
  work.grip.about_centre(problem.wrench, problem.wrench[5], wanted);
  work.allow();  // the work may be spent already, and this takes only one factorisation
  if (!work.slip.bonded({work.tangential, work.grip, work.free_slip.data(), wanted}, work.limit, work.shear.data())) {
    return false;
  }
  work.write(cells, cells.pressing, forces);
  return true;
}

// Whether friction carries the wrench's shear and torsion under the pressure of these forces.
bool holds(const ShearProblem& problem, ShearWork& work, const double* forces) {
  const PressedCells& cells = problem.cells;
  work.normal.resize(cells.count);
  for (std::size_t i = 0; i < cells.count; ++i) work.normal[i] = -forces[3 * i + 2];
  work.hold(cells, work.normal.data());
  double wanted[3];
  work.grip.about_centre(problem.wrench, problem.wrench[5], wanted);
  return !work.grip.nearest(wanted, problem.friction, work.shear.data());
}

// No cell slips. Pressure and shear are solved together.
class Stick final : public TangentialChoice {
 public:
  const char* name() const override { return "stick"; }
  bool leans() const override { return false; }

  ShearOutcome solve(const ShearProblem& problem, ShearWork& work, double* forces) const override {
    const PressedCells& cells = problem.cells;
    ShearOutcome outcome;
    outcome.simplified = !bonded(problem, work, forces);
    double share = outcome.simplified ? 0.0 : 1.0;
    for (std::size_t i = 0; i < cells.count && share > 0.0; ++i) {
      share = std::min(share, share_borne(cells, i, -forces[3 * i + 2]));
    }
    if (share < 1.0) {
      work.coupled.assign(forces, forces + 3 * cells.count);
      if (!bonded_as_pressed(problem, work, forces)) {
        outcome = proportional_shear().solve(problem, work, forces);
        outcome.simplified = true;
        return outcome;
      }
      if (share > 0.0) {
        for (std::size_t k = 0; k < 3 * cells.count; ++k) forces[k] += share * (work.coupled[k] - forces[k]);
      }
    }
    if (problem.friction < 0.0 || holds(problem, work, forces)) return outcome;
    return proportional_shear().solve(problem, work, forces);
  }
};

}  // namespace

const TangentialChoice& stick_shear() { return the_only<Stick>(); }

}  // namespace mjtactile
