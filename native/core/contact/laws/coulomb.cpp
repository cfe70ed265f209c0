#include <algorithm>
#include <cmath>

#include "contact/laws/by_name.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Rounds of pressing and shear, the change of forces at which they agree, over the force, and
// one that serves where a cell on the verge keeps them apart or the work is spent.
constexpr int kRounds = 40;
constexpr double kAgreed = 1e-10, kSufficient = 1e-4;
// Rounds after which what the shear lifts is changed by a part only, and that part.
constexpr int kUndamped = 12;
constexpr double kDamping = 0.3;
// Multiplications for shear under the last pressure; factorisations that a round of pressing and shear may take.
constexpr double kLastWork = 5e6, kReserve = 2.0;

// Shear under the pressure `work.normal`; false where it slides in proportion for want of anything better.
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
  work.displace(problem.cells, *problem.compliance, work.normal.data());
  const SlipProblem slip = {work.tangential, work.grip, work.slipped.data(), wanted};
  if (work.slip.solve(slip, friction, known, work.limit, work.shear.data())) {
    return true;
  }
  double direction[3];
  work.grip.sliding_with(wanted, friction, work.shear.data(), direction);
  return false;
}

// Cells stick where they can and slip where |t| reaches mu F; pressure and slip are solved for in turn until they
// agree.
class Coulomb final : public TangentialChoice {
 public:
  const char* name() const override { return "coulomb"; }
  bool slips() const override { return true; }

  ShearOutcome solve(const ShearProblem& problem, ShearWork& work, double* forces) const override {
    const PressedCells& cells = problem.cells;
    const Matrix& compliance = *problem.compliance;
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
      const double* from = compliance[2 * count + place] + 2 * count;
      for (std::size_t j = 0; j < reached; ++j) work.pressed[i][j] = from[work.reached[j]];
      if (cells.heights != nullptr) work.gaps[i] = cells.heights[place] - lowest;
      double* modes = work.modes.data() + i * motions;
      modes[0] = 1.0;
      if (cells.tilting) {
        modes[1] = (cells.points[place].x - cells.middle.x) / cells.length;
        modes[2] = (cells.points[place].y - cells.middle.y) / cells.length;
      }
      for (std::size_t m = 0; m < motions; ++m) resultants[m] += modes[m] * cells.pressing[place];
      total += cells.pressing[place];
    }
    work.normal.assign(cells.pressing, cells.pressing + count);
    work.found.assign(2 * count, 0.0);
    work.lifted.assign(reached, 0.0);
    work.lifts.resize(reached);
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
          work.lifts[i] = -dot(compliance[2 * count + work.reached[i]], work.found.data(), 2 * count);
          // What the surface was lifted by is not what the shear does: as forces, by the cell's own compliance.
          changed = std::max(changed, std::abs(work.lifts[i] - work.lifted[i]) / work.pressed[i][i]);
          work.start[i] = work.normal[work.reached[i]] > 0.0 ? 1 : 0;
        }
        if (round <= kUndamped) {
          work.mixing.next(work.lifts, work.lifted);
        } else {
          for (std::size_t i = 0; i < reached; ++i) work.lifted[i] += kDamping * (work.lifts[i] - work.lifted[i]);
        }
        for (std::size_t i = 0; i < reached; ++i) work.heights[i] = work.gaps[i] + work.lifted[i];
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
      const bool known = round > 0 && work.last_held == work.held && !outcome.slides;
      settled = slipping(problem, work, known, outcome.slides);
      work.last = work.found;
      std::fill(work.found.begin(), work.found.end(), 0.0);
      for (std::size_t i = 0; i < work.held.size(); ++i) {
        work.found[work.held[i]] = work.shear[i];
        work.found[count + work.held[i]] = work.shear[work.held.size() + i];
      }
      for (std::size_t k = 0; k < 2 * count; ++k) changed = std::max(changed, std::abs(work.found[k] - work.last[k]));
      if (round > 0) change = changed;
      agreed = change <= kAgreed * total;
    }
    if (!agreed && settled && !outcome.slides) {
      // The work is spent, or pressure and shear keep each other going: shear that suits the last pressure.
      work.limit.allow(work.patience * kLastWork);
      settled = slipping(problem, work, true, outcome.slides);
    }
    outcome.simplified = !settled || (!agreed && change > kSufficient * total);
    work.write(cells, work.normal.data(), forces);
    return outcome;
  }
};

}  // namespace

const TangentialChoice& coulomb_shear() {
  static const Coulomb choice;
  return choice;
}

}  // namespace mjtactile
