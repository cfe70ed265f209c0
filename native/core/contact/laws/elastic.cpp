#include <algorithm>
#include <cmath>

#include "contact/laws/by_name.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Shares by which cells are taken to be softer where their compliance is not positive definite, the first and the most.
constexpr double kSofter = 1e-3, kSoftest = 1.0;

// The pad's own compliance against the rigid body.
class Elastic final : public ContactLaw {
 public:
  const char* name() const override { return "elastic"; }
  bool couples() const override { return true; }

  bool solve(const LawProblem& problem, LawContact& found) const override {
    Matrix& between = problem.between;
    double softer = kSofter;
    while (!found.contact.solve(problem.body, problem.start)) {
      if (found.contact.definite() || softer > kSoftest) return false;
      // Under layers far from a half space what tables and cells leave out can outweigh a cell's own compliance.
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

const ContactLaw& elastic_law() {
  static const Elastic law;
  return law;
}

}  // namespace mjtactile
