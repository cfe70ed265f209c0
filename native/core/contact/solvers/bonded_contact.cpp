#include "contact/solvers/bonded_contact.hpp"

#include <algorithm>
#include <cmath>

#include "contact/solvers/height_order.hpp"

namespace mjtactile {
namespace {

constexpr std::size_t kComponents = 3, kNormal = 2;
// Number of right sides that are solved together: six motions, the heights, and one row of zeros. Products take four
// rows at once.
constexpr std::size_t kRightSides = 8;
// Pulling forces and overlaps below the fraction kTolerance of the largest force and separation count as zero. If cells
// on the verge of contact keep changing sides, violations up to kVerge are accepted.
constexpr double kTolerance = 1e-11, kVerge = 1e-8;
// A motion is open if its stiffness is below the fraction kOpen of the largest. It is loaded if the load along it
// exceeds the fraction kLoaded of the resultants.
constexpr double kOpen = 1e-12, kLoaded = 1e-11;
// Largest error of the forces' resultants, over the largest resultant.
constexpr double kBalanced = 1e-10;
// Largest number of rounds in which cells are exchanged. After kPatience rounds in a row that do not reduce the number
// of violated cells, single cells are exchanged (Judice, Pires, Comput. Oper. Res. 21, 1994).
constexpr int kRounds = 20, kPatience = 4;

}  // namespace

bool BondedContact::solve(const BondedProblem& problem, const std::uint8_t* start, WorkLimit& limit) {
  const double *heights = problem.heights, *wanted = problem.wanted;
  count_ = problem.places.size();
  levers_ = problem.levers;
  tilting_ = problem.tilting;
  force_unit_ = wanted[0];
  for (std::size_t m = 0; m < kMotions; ++m) wanted_[m] = wanted[m] / force_unit_;
  if (!tilting_) wanted_[1] = wanted_[2] = 0.0;
  heights_.assign(count_, 0.0);
  if (heights != nullptr) {
    const double lowest = *std::min_element(heights, heights + count_);
    for (std::size_t i = 0; i < count_; ++i) heights_[i] = (heights[i] - lowest) / force_unit_;
  }
  order_by_height(heights != nullptr ? heights_.data() : nullptr, count_, order_);
  factor_.forget();
  pressed_.assign(start, start + count_);
  slips_.assign(count_, 0);
  unchanged_ = -HUGE_VAL;
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
      for (std::size_t i = 0; i < count_; ++i) {
        if (violated_[i]) exchange(i);
      }
    } else {
      exchange(static_cast<std::size_t>(violated_.rend() - std::find(violated_.rbegin(), violated_.rend(), 1)) - 1);
    }
  }
  return false;
}

// Solve for the forces and the motion if exactly the pressed cells are in contact. False if these cells cannot carry
// the resultants.
bool BondedContact::solve_on_pressed(const BondedProblem& problem, WorkLimit& limit) {
  hold_pressed(problem);
  const std::size_t size = unknowns_.size();
  if (size == 0 || !limit.factorisation(size, kept_unknowns())) return false;
  if (!factor_.factor(problem.compliance, unknowns_)) return false;
  unchanged_ = HUGE_VAL;
  set_modes();
  set_right_sides();
  factor_.solve_forward(right_sides_);
  // With S = B^T A^-1 B the motion is d = S^-1 (q + B^T A^-1 g), and the forces are A^-1 (B d - g).
  double needed[kMotions];
  for (std::size_t m = 0; m < kMotions; ++m) {
    needed[m] = wanted_[m] + dot(right_sides_[m], right_sides_[kMotions], size);
  }
  const MotionStiffness stiffness = stiffness_on_held();
  Openness openness = {kOpen * stiffness.largest(), 0.0};
  for (const double resultant : needed) openness.loaded = std::max(openness.loaded, kLoaded * std::abs(resultant));
  std::fill(motion_, motion_ + kMotions, 0.0);
  // A tilt is open if the cells lie in one row.
  stiffness.add_motion(needed, openness, motion_);
  set_held_forces();
  // Correct the rounding error of the resultants once.
  double left[kMotions];
  for (std::size_t m = 0; m < kMotions; ++m) left[m] = wanted_[m] - dot(modes_[m], held_forces_.data(), size);
  openness.loaded = HUGE_VAL;
  stiffness.add_motion(left, openness, motion_);
  set_held_forces();
  return scatter_forces(problem);
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

// Let a cell change between pressed and free.
void BondedContact::exchange(std::size_t place) {
  pressed_[place] ^= 1;
  unchanged_ = std::min(unchanged_, heights_[place]);
}

// Number of first unknowns that are certainly those of the last factorisation, whatever the order of cells of equal
// height.
std::size_t BondedContact::kept_unknowns() const {
  const auto changed = std::find_if(held_.begin(), held_.end(),
                                    [this](const Held& one) { return heights_[one.place] >= unchanged_; });
  return static_cast<std::size_t>(changed - held_.begin());
}

// Set the right sides: the rows of B^T, and -g.
void BondedContact::set_right_sides() {
  const std::size_t size = unknowns_.size();
  right_sides_.resize(kRightSides, size);
  for (std::size_t m = 0; m < kMotions; ++m) std::copy(modes_[m], modes_[m] + size, right_sides_[m]);
  for (std::size_t m = kMotions; m < kRightSides; ++m) std::fill(right_sides_[m], right_sides_[m] + size, 0.0);
  for (std::size_t k = 0; k < size; ++k) {
    right_sides_[kMotions][k] = held_[k].component == kNormal ? -heights_[held_[k].place] : 0.0;
  }
}

// Stiffness of the held cells against the body's motions.
MotionStiffness BondedContact::stiffness_on_held() const {
  double matrix[kMotions * kMotions];
  for (std::size_t m = 0; m < kMotions; ++m) {
    for (std::size_t n = 0; n <= m; ++n) {
      matrix[m * kMotions + n] = matrix[n * kMotions + m] = dot(right_sides_[m], right_sides_[n], unknowns_.size());
    }
  }
  return MotionStiffness(kMotions, matrix);
}

// Set the forces on the held cells under the present motion.
void BondedContact::set_held_forces() {
  const std::size_t size = unknowns_.size();
  held_forces_.resize(size);
  for (std::size_t k = 0; k < size; ++k) {
    held_forces_[k] = -right_sides_[kMotions][k];
    for (std::size_t m = 0; m < kMotions; ++m) held_forces_[k] += right_sides_[m][k] * motion_[m];
  }
  factor_.solve_backward(held_forces_.data());
}

// Copy the forces to all cells, in newtons. False if a force is not finite.
bool BondedContact::scatter_forces(const BondedProblem& problem) {
  forces_.assign(kComponents * count_, 0.0);
  all_forces_.assign(kComponents * problem.cells, 0.0);
  for (std::size_t k = 0; k < held_forces_.size(); ++k) {
    const auto [place, component] = held_[k];
    const double force = held_forces_[k] * force_unit_;
    if (!std::isfinite(force)) return false;
    forces_[component * count_ + place] = component == kNormal ? -force : force;
    all_forces_[unknowns_[k]] = held_forces_[k];
  }
  return true;
}

// Set the displacements of the held cells per motion: indentation, two tilts, translations along x and y, and rotation.
// Those of the first three are negative, because they point into the pad and z points out of it.
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

// Find the pressed cells that pull and the free cells that overlap. Returns their number.
std::size_t BondedContact::violations(const BondedProblem& problem) {
  violated_.assign(count_, 0);
  double largest = 0.0, scale = std::abs(motion_[0]);
  for (const double force : held_forces_) largest = std::max(largest, std::abs(force));
  worst_ = 0.0;
  std::size_t found = 0;
  for (std::size_t k = 0; k < held_.size(); ++k) {
    const double pull = held_forces_[k] / largest;
    if (held_[k].component != kNormal || pull <= kTolerance) continue;
    ++found;
    violated_[held_[k].place] = 1;
    worst_ = std::max(worst_, pull);
  }
  // Separation of body and surface at the free cells.
  separation_.assign(count_, 0.0);
  for (std::size_t i = 0; i < count_; ++i) {
    if (pressed_[i]) continue;
    const double* row = problem.compliance[2 * problem.cells + problem.places[i]];
    double sum = heights_[i] - dot(row, all_forces_.data(), all_forces_.size()) - motion_[0];
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

// Let the violated cells press without shear. They would pull if they stuck, and overlap if they were free.
void BondedContact::let_slip() {
  for (std::size_t i = 0; i < count_; ++i) {
    if (violated_[i]) exchange(i), slips_[i] = 1;
  }
  seen_.clear();
}

// Whether the forces have the wanted resultants up to rounding. Motions that move no held cell are left out, such as
// the rotation of a single cell.
bool BondedContact::balances() const {
  double size = 0.0;
  for (const double one : wanted_) size = std::max(size, std::abs(one));
  for (std::size_t m = 0; m < kMotions; ++m) {
    const double left = dot(modes_[m], held_forces_.data(), held_forces_.size()) - wanted_[m];
    const bool moves = dot(modes_[m], modes_[m], held_forces_.size()) > 0.0;
    if (moves && !(std::abs(left) <= kBalanced * size)) return false;
  }
  return true;
}

}  // namespace mjtactile
