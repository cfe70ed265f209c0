#include <algorithm>
#include <cmath>

#include "contact/laws/by_name.hpp"

namespace mjtactile {
namespace {

// Largest number of rounds in which the contact area and the springs' stiffness are adapted to each other.
constexpr int kRounds = 30;
constexpr double kSameArea = 1e-9;

// Independent springs. Their stiffness depends on the area in contact (mjtactile/contact/foundation.py).
class Foundation final : public ContactLaw {
 public:
  const char* name() const override { return "foundation"; }

  bool solve(const LawProblem& problem, LawContact& found) const override {
    const std::vector<double>& areas = problem.face.areas;
    double area = 0.0;
    for (std::size_t i = 0; i < areas.size(); ++i) {
      area += problem.start == nullptr || problem.start[i] ? areas[i] : 0.0;
    }
    bool solved = false;
    for (int round = 0; round < kRounds; ++round) {
      found.stiffness = problem.compliance.foundation_stiffness(area);
      found.springs.resize(areas.size());
      for (std::size_t i = 0; i < areas.size(); ++i) found.springs[i] = found.stiffness * areas[i];
      const RigidProblem& body = problem.body;
      solved = found.bed.solve(found.springs, body.modes, body.motions, body.heights, body.resultants);
      if (!solved) break;
      double pressed = 0.0;
      for (std::size_t i = 0; i < areas.size(); ++i) pressed += found.bed.pressed()[i] ? areas[i] : 0.0;
      if (std::abs(pressed - area) <= kSameArea * area) break;
      area = std::abs(pressed - area) < 0.1 * area ? (area + pressed) / 2 : pressed;
    }
    found.take(found.bed, problem.body.motions);
    return solved;
  }

  bool set_compliance(const Face& face, LawContact& found, Matrix& between) const override {
    found.contact.forget();
    between.resize(face.cells(), face.cells());
    for (std::size_t i = 0; i < face.cells(); ++i) {
      std::fill(between[i], between[i] + between.stride(), 0.0);
      between[i][i] = 1.0 / (found.stiffness * face.areas[i]);
    }
    return true;
  }

  double depth(const Face& face, const LawContact& found, const Matrix&, std::size_t cell) const override {
    return found.normal[cell] / (found.stiffness * face.areas[cell]);
  }
};

}  // namespace

const ContactLaw& foundation_law() { return the_only<Foundation>(); }

}  // namespace mjtactile
