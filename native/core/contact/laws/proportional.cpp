#include "contact/laws/by_name.hpp"

namespace mjtactile {
namespace {

// Shear in proportion to the pressure, plus a rotation that carries the torsion.
class Proportional final : public TangentialChoice {
 public:
  const char* name() const override { return "proportional"; }
  bool couples() const override { return false; }

  ShearOutcome solve(const ShearProblem& problem, ShearWork& work, double* forces) const override {
    const PressedCells& cells = problem.cells;
    ShearOutcome outcome;
    work.hold(cells, cells.pressing);
    double wanted[3];
    work.grip.about_centre(problem.wrench, problem.wrench[5], wanted);
    if (problem.friction >= 0.0) outcome.slides = work.grip.nearest(wanted, problem.friction, work.shear.data());
    if (!outcome.slides) work.grip.proportional(wanted, work.shear.data());
    work.write(cells, cells.pressing, forces);
    return outcome;
  }
};

}  // namespace

const TangentialChoice& proportional_shear() { return the_only<Proportional>(); }

}  // namespace mjtactile
