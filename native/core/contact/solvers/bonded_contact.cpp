#include "contact/solvers/bonded_contact.hpp"

#include <algorithm>
#include <cmath>

#include "contact/solvers/height_order.hpp"

namespace mjtactile {
namespace {

constexpr std::size_t kComponents = 3, kNormal = 2;
// Right sides that are solved for together, the heights among them, and none: products take four rows at once.
constexpr std::size_t kSides = 8;
// Forces and separations this small count as zero; violations this small are left
// where cells on the verge of contact keep changing sides; a motion resisted this much less than another is open, and
// loaded by what is more than this of the resultants; what forces may miss of the resultants.
constexpr double kTolerance = 1e-11, kVerge = 1e-8, kOpen = 1e-12, kLoaded = 1e-11, kBalanced = 1e-10;
// Rounds of exchanging cells, and those in a row that may leave as many violated as before until cells change sides one
// by one (Judice, Pires, Comput. Oper. Res. 21, 1994).
constexpr int kRounds = 20, kPatience = 4;

}  // namespace

bool BondedContact::solve(const BondedProblem& problem, const std::uint8_t* start, WorkLimit& limit) {
  const double *heights = problem.heights, *wanted = problem.wanted;
  count_ = problem.places.size();
  levers_ = problem.levers;
  tilting_ = problem.tilting;
  unit_ = wanted[0];
  for (std::size_t m = 0; m < kMotions; ++m) wanted_[m] = wanted[m] / unit_;
  if (!tilting_) wanted_[1] = wanted_[2] = 0.0;
  heights_.assign(count_, 0.0);
  if (heights != nullptr) {
    const double lowest = *std::min_element(heights, heights + count_);
    for (std::size_t i = 0; i < count_; ++i) heights_[i] = (heights[i] - lowest) / unit_;
  }
  order_by_height(heights != nullptr ? heights_.data() : nullptr, count_, order_);
  factor_.forget();
  pressed_.assign(start, start + count_);
  slips_.assign(count_, 0);
  seen_.clear();
  std::size_t fewest = count_ + 1;
  int patience = kPatience;
  for (int round = 0; round < kRounds; ++round) {
    if (!solve_on_pressed(problem, limit)) return false;
    const std::size_t violated = violations(problem);
    if (violated == 0) return balances();
    const bool again = seen_.again({&pressed_});
    if (again && worst_ <= kVerge) return balances();
    patience = violated < fewest ? kPatience : patience - 1;
    fewest = std::min(fewest, violated);
    if (again) {
      let_slip();
    } else if (patience > 0) {
      for (std::size_t i = 0; i < count_; ++i) pressed_[i] ^= violated_[i];
    } else {
      pressed_[last_violated()] ^= 1;
    }
  }
  return false;
}

// The solution if exactly the pressed cells touched; false where they cannot carry the resultants.
bool BondedContact::solve_on_pressed(const BondedProblem& problem, WorkLimit& limit) {
  hold_pressed(problem);
  const std::size_t size = unknowns_.size();
  if (size == 0 || !limit.factorisation(size, factor_.known(unknowns_))) return false;
  if (!factor_.factor(problem.compliance, unknowns_)) return false;
  set_modes();
  set_right();
  factor_.solve_forward(right_);
  // With S = B^T A^-1 B the motion is d = S^-1 (q + B^T A^-1 g), and the forces are A^-1 (B d - g).
  double needed[kMotions];
  for (std::size_t m = 0; m < kMotions; ++m) needed[m] = wanted_[m] + dot(right_[m], right_[kMotions], size);
  const MotionStiffness stiffness = stiffness_on_held();
  Openness openness = {kOpen * stiffness.largest(), 0.0};
  for (const double resultant : needed) openness.loaded = std::max(openness.loaded, kLoaded * std::abs(resultant));
  std::fill(motion_, motion_ + kMotions, 0.0);
  // Cells in one row leave a tilt open.
  stiffness.add_motion(needed, openness, motion_);
  set_plain_forces();
  double left[kMotions];   // what rounding left of the resultants
  for (std::size_t m = 0; m < kMotions; ++m) left[m] = wanted_[m] - dot(modes_[m], plain_.data(), size);
  openness.loaded = HUGE_VAL;
  stiffness.add_motion(left, openness, motion_);
  set_plain_forces();
  return spread_forces(problem);
}

void BondedContact::hold_pressed(const BondedProblem& problem) {
  held_.clear();
  unknowns_.clear();
  for (const std::size_t i : order_) {
    if (!pressed_[i]) continue;
    for (std::size_t a = slips_[i] ? kNormal : 0; a < kComponents; ++a) {
      held_.push_back({i, a});
      unknowns_.push_back(a * problem.cells + problem.places[i]);
    }
  }
}

// B and -g by row.
void BondedContact::set_right() {
  const std::size_t size = unknowns_.size();
  right_.resize(kSides, size);
  for (std::size_t m = 0; m < kMotions; ++m) std::copy(modes_[m], modes_[m] + size, right_[m]);
  for (std::size_t m = kMotions; m < kSides; ++m) std::fill(right_[m], right_[m] + size, 0.0);
  for (std::size_t k = 0; k < size; ++k) {
    right_[kMotions][k] = held_[k].component == kNormal ? -heights_[held_[k].place] : 0.0;
  }
}

// Of the cells held against the body's motions.
MotionStiffness BondedContact::stiffness_on_held() const {
  double matrix[kMotions * kMotions];
  for (std::size_t m = 0; m < kMotions; ++m) {
    for (std::size_t n = 0; n <= m; ++n) {
      matrix[m * kMotions + n] = matrix[n * kMotions + m] = dot(right_[m], right_[n], unknowns_.size());
    }
  }
  return MotionStiffness(kMotions, matrix);
}

// Forces on the cells held under the motion.
void BondedContact::set_plain_forces() {
  const std::size_t size = unknowns_.size();
  plain_.resize(size);
  for (std::size_t k = 0; k < size; ++k) {
    plain_[k] = -right_[kMotions][k];
    for (std::size_t m = 0; m < kMotions; ++m) plain_[k] += right_[m][k] * motion_[m];
  }
  factor_.solve_backward(plain_.data());
}

// To all cells, in newtons; false where a force is not finite.
bool BondedContact::spread_forces(const BondedProblem& problem) {
  forces_.assign(kComponents * count_, 0.0);
  spread_.assign(kComponents * problem.cells, 0.0);
  for (std::size_t k = 0; k < plain_.size(); ++k) {
    const auto [place, component] = held_[k];
    const double force = plain_[k] * unit_;
    if (!std::isfinite(force)) return false;
    forces_[component * count_ + place] = component == kNormal ? -force : force;
    spread_[unknowns_[k]] = plain_[k];
  }
  return true;
}

// Displacement of the cells held per motion: indentation and two tilts (downward, and z points out of the pad), x, y
// and a turn.
void BondedContact::set_modes() {
  modes_.resize(kMotions, held_.size());
  for (std::size_t m = 0; m < kMotions; ++m) std::fill(modes_[m], modes_[m] + modes_.columns(), 0.0);
  for (std::size_t k = 0; k < held_.size(); ++k) {
    const auto [place, component] = held_[k];
    const Point& lever = levers_[place];
    if (component == kNormal) {
      modes_[0][k] = -1.0;
      if (tilting_) modes_[1][k] = -lever.x, modes_[2][k] = -lever.y;
    } else {
      modes_[3 + component][k] = 1.0;
      modes_[5][k] = component == 0 ? -lever.y : lever.x;
    }
  }
}

// How many cells pull although pressed, or overlap although not.
std::size_t BondedContact::violations(const BondedProblem& problem) {
  violated_.assign(count_, 0);
  double largest = 0.0, scale = std::abs(motion_[0]);
  for (const double force : plain_) largest = std::max(largest, std::abs(force));
  worst_ = 0.0;
  std::size_t found = 0;
  for (std::size_t k = 0; k < held_.size(); ++k) {
    const double pull = plain_[k] / largest;
    if (held_[k].component != kNormal || pull <= kTolerance) continue;
    ++found;
    violated_[held_[k].place] = 1;
    worst_ = std::max(worst_, pull);
  }
  // Separation of body and surface, in place of the forces of cells that have none.
  separation_.assign(count_, 0.0);
  for (std::size_t i = 0; i < count_; ++i) {
    if (pressed_[i]) continue;
    const double* row = problem.compliance[2 * problem.cells + problem.places[i]];
    double sum = heights_[i] - dot(row, spread_.data(), spread_.size()) - motion_[0];
    if (tilting_) sum -= levers_[i].x * motion_[1] + levers_[i].y * motion_[2];
    separation_[i] = sum;
    scale = std::max(scale, std::abs(sum));
  }
  for (std::size_t i = 0; i < count_; ++i) {
    if (pressed_[i] || !(separation_[i] < -kTolerance * scale)) continue;
    ++found;
    violated_[i] = 1;
    worst_ = std::max(worst_, -separation_[i] / scale);
  }
  return found;
}

// Cells that pull where they stick and overlap where they are let go press without shear.
void BondedContact::let_slip() {
  for (std::size_t i = 0; i < count_; ++i) {
    if (violated_[i]) pressed_[i] ^= 1, slips_[i] = 1;
  }
  seen_.clear();
}

std::size_t BondedContact::last_violated() const {
  std::size_t last = count_;
  while (!violated_[--last]) {
  }
  return last;
}

// Whether what rounding leaves of the resultants is rounding; a turn of cells in one place carries none.
bool BondedContact::balances() const {
  double size = 0.0;
  for (const double one : wanted_) size = std::max(size, std::abs(one));
  for (std::size_t m = 0; m < kMotions; ++m) {
    const double left = dot(modes_[m], plain_.data(), plain_.size()) - wanted_[m];
    const bool moves = dot(modes_[m], modes_[m], plain_.size()) > 0.0;
    if (moves && !(std::abs(left) <= kBalanced * size)) return false;
  }
  return true;
}

}  // namespace mjtactile
