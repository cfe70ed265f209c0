#include <algorithm>
#include <cmath>

#include "contact/laws/by_name.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Largest number of rounds, each of which solves for the pressure and then for the shear. They agree if no force
// changes by more than the fraction kAgreed of the load. If a cell on the verge of contact prevents that, or the work
// is spent, a change of kSufficient is accepted.
constexpr int kRounds = 40;
constexpr double kAgreed = 1e-8, kSufficient = 1e-4;
// After kUndamped rounds, the surface's lift by the shear is changed only by the fraction kDamping of its difference.
constexpr int kUndamped = 12;
constexpr double kDamping = 0.3;
// Multiplications allowed for the shear under the last pressure, and number of factorisations that one round may need.
constexpr double kLastWork = 5e6, kReserve = 2.0;

// Solve for the shear under the pressure `work.normal`. False if no method converges; the shear is then that of sliding
// cells, scaled to the load.
bool slipping(const ShearProblem& problem, ShearWork& work, bool known, bool& slides) {
  const double friction = problem.friction;
  double wanted[3];
  work.grip.about_centre(problem.wrench, problem.wrench[5], wanted);
  work.spread.resize(work.shear.size());
  slides = work.grip.nearest(wanted, friction, work.spread.data());
  if (slides || !(friction > 0.0)) {
    if (slides) {
      work.shear = work.spread;
    } else {
      std::fill(work.shear.begin(), work.shear.end(), 0.0);
    }
    return true;
  }
  // A contact that slid as a whole most likely still slides. Then the compliance is not needed.
  if ((!known || work.slip.slid()) && work.slip.slides(work.grip, wanted, friction, work.shear.data())) return true;
  work.displace(problem.cells, problem.compliance->whole(), work.normal.data());
  const SlipProblem slip = {work.tangential, work.grip, work.free_slip.data(), wanted};
  if (work.slip.solve(slip, friction, known, work.limit, work.shear.data())) return true;
  double direction[3];
  work.grip.sliding_with(wanted, friction, work.shear.data(), direction);
  return false;
}

// Cells stick where |t| < mu F and slip where it reaches this limit. Pressure and shear are solved alternately until
// they agree.
class Coulomb final : public TangentialChoice {
 public:
  const char* name() const override { return "coulomb"; }
  bool slips() const override { return true; }

  ShearOutcome solve(const ShearProblem& problem, ShearWork& work, double* forces) const override {
    const PressedCells& cells = problem.cells;
    const FullCompliance& compliance = *problem.compliance;
    const std::size_t count = cells.count, reached = work.reached.size(), motions = cells.tilting ? 3 : 1;
    work.contact.forget();
    work.contact.allow();
    work.pressed.resize(reached, reached);
    work.modes.resize(reached * motions);
    work.gaps.assign(reached, 0.0);
    work.heights.resize(reached);
    work.start.resize(reached);
    double lowest = 0.0, resultants[3] = {}, total = 0.0;
    if (cells.heights != nullptr) {
      lowest = cells.heights[work.reached[0]];
      for (const std::size_t place : work.reached) lowest = std::min(lowest, cells.heights[place]);
    }
    for (std::size_t i = 0; i < reached; ++i) {
      const std::size_t place = work.reached[i];
      const double* from = compliance.normal_row(place) + 2 * count;
      for (std::size_t j = 0; j < reached; ++j) work.pressed[i][j] = from[work.reached[j]];
      if (cells.heights != nullptr) work.gaps[i] = cells.heights[place] - lowest;
      double* modes = work.modes.data() + i * motions;
      modes[0] = 1.0;
      const Point lever = cells.lever(place);
      if (cells.tilting) modes[1] = lever.x, modes[2] = lever.y;
      for (std::size_t m = 0; m < motions; ++m) resultants[m] += modes[m] * cells.pressing[place];
      total += cells.pressing[place];
    }
    work.normal.assign(cells.pressing, cells.pressing + count);
    work.found.assign(2 * count, 0.0);
    work.lift.assign(reached, 0.0);
    work.new_lift.resize(reached);
    ShearOutcome outcome;
    bool agreed = false, settled = true;
    double change = total;
    work.held.clear();
    for (int round = 0; round < kRounds && settled && !agreed; ++round) {
      double changed = 0.0;
      if (round > 0) {
        if (!work.limit.leaves(2 * work.held.size(), kReserve)) break;
        if (round == 1 || work.held != work.last_held) work.mixing.forget();
        for (std::size_t i = 0; i < reached; ++i) {
          work.new_lift[i] = -dot(compliance.normal_row(work.reached[i]), work.along.data(), 2 * count);
          // The error of the assumed lift, converted to a force by the cell's own compliance.
          changed = std::max(changed, std::abs(work.new_lift[i] - work.lift[i]) / work.pressed[i][i]);
          work.start[i] = work.normal[work.reached[i]] > 0.0 ? 1 : 0;
        }
        if (round <= kUndamped) {
          work.mixing.next(work.new_lift, work.lift);
        } else {
          for (std::size_t i = 0; i < reached; ++i) work.lift[i] += kDamping * (work.new_lift[i] - work.lift[i]);
        }
        for (std::size_t i = 0; i < reached; ++i) work.heights[i] = work.gaps[i] + work.lift[i];
        if (!work.limit.factorisation(reached) ||
            !work.contact.solve({&work.pressed, work.modes.data(), motions, work.heights.data(), resultants},
                                work.start.data())) {
          break;
        }
        double borne = 1.0;
        for (std::size_t i = 0; i < reached; ++i) {
          borne = std::min(borne, share_borne(cells, work.reached[i], work.contact.forces()[i]));
        }
        for (std::size_t i = 0; i < reached; ++i) {
          const double without = cells.pressing[work.reached[i]];
          const double coupled = work.contact.forces()[i];
          const double force = borne < 1.0 ? without + borne * (coupled - without) : coupled;
          changed = std::max(changed, std::abs(force - work.normal[work.reached[i]]));
          work.normal[work.reached[i]] = force;
        }
      }
      work.last_held = work.held;
      work.hold(cells, work.normal.data());
      work.lean(cells, work.normal.data());
      const bool known = round > 0 && work.last_held == work.held && !outcome.slides;
      settled = slipping(problem, work, known, outcome.slides);
      work.last = work.found;
      std::fill(work.found.begin(), work.found.end(), 0.0);
      for (std::size_t i = 0; i < work.held.size(); ++i) {
        work.found[work.held[i]] = work.shear[i];
        work.found[count + work.held[i]] = work.shear[work.held.size() + i];
      }
      work.along = work.found;
      for (std::size_t k = 0; k < work.leaning.size(); ++k) work.along[k] += work.leaning[k];
      for (std::size_t k = 0; k < 2 * count; ++k) changed = std::max(changed, std::abs(work.found[k] - work.last[k]));
      if (round > 0) change = changed;
      agreed = change <= kAgreed * total;
    }
    if (!agreed && settled && !outcome.slides) {
      // The work is spent, or pressure and shear do not converge. Solve for the shear under the last pressure.
      work.limit.allow(work.patience * kLastWork);
      settled = slipping(problem, work, true, outcome.slides);
    }
    outcome.simplified = !settled || (!agreed && change > kSufficient * total);
    work.write(cells, work.normal.data(), forces);
    return outcome;
  }
};

}  // namespace

const TangentialChoice& coulomb_shear() { return the_only<Coulomb>(); }

}  // namespace mjtactile
