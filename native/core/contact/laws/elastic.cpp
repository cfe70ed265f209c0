#include <algorithm>
#include <cmath>

#include "contact/laws/by_name.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// If the compliance is not positive definite, its diagonal is increased by this fraction of its largest entry. The
// fraction grows from the first value to the second.
constexpr double kSofter = 1e-3, kSoftest = 1.0;

// A rigid body on the pad's own compliance.
class Elastic final : public ContactLaw {
 public:
  const char* name() const override { return "elastic"; }
  bool couples() const override { return true; }

  bool solve(const LawProblem& problem, LawContact& found) const override {
    Matrix& between = problem.between;
    double softer = kSofter;
    while (!found.contact.solve(problem.body, problem.start)) {
      if (found.contact.definite() || softer > kSoftest) return false;
      // If layers make the sheet very different from a half space, errors of tables and cells can exceed a cell's own
      // compliance.
      double largest = 0.0;
      for (std::size_t i = 0; i < between.rows(); ++i) largest = std::max(largest, std::abs(between[i][i]));
      for (std::size_t i = 0; i < between.rows(); ++i) between[i][i] += softer * largest;
      softer *= 4.0;
      found.contact.forget();
    }
    found.take(found.contact, problem.body.motions);
    return true;
  }

  bool set_compliance(const Face&, LawContact&, Matrix&) const override { return true; }

  double depth(const Face&, const LawContact& found, const Matrix& between, std::size_t cell) const override {
    return dot(between[cell], found.normal.data(), found.normal.size());
  }
};

}  // namespace

const ContactLaw& elastic_law() { return the_only<Elastic>(); }

}  // namespace mjtactile
