#include "contact/laws/by_name.hpp"

namespace mjtactile {
namespace {

// Pressure that is linear over the area and zero where it would pull. Equal springs under the cells give it.
class Uniform final : public ContactLaw {
 public:
  const char* name() const override { return "uniform"; }
  bool shapes() const override { return false; }

  bool solve(const LawProblem& problem, LawContact& found) const override {
    const RigidProblem& body = problem.body;
    if (!found.bed.solve(problem.face.areas, body.modes, body.motions, nullptr, body.resultants)) return false;
    found.take(found.bed, 1);  // the springs' tilt is that of the pressure, not of the body
    return true;
  }

  bool set_compliance(const Face&, LawContact&, Matrix&) const override { return false; }

  double depth(const Face&, const LawContact&, const Matrix&, std::size_t) const override { return 0.0; }
};

}  // namespace

const ContactLaw& uniform_law() { return the_only<Uniform>(); }

}  // namespace mjtactile
