#include "contact/solvers/bonded_contact.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/small.hpp"

namespace mjtactile {
namespace {

constexpr std::size_t kMotions = 6;
// Forces and separations this small count as zero; violations this small are left
// where cells on the verge of contact keep changing sides; a motion resisted this much less than another is open, and
// loaded by what is more than this of the resultants; what forces may miss of the resultants.
constexpr double kTolerance = 1e-11, kVerge = 1e-8, kOpen = 1e-12, kLoaded = 1e-11, kBalanced = 1e-10;
// Rounds of exchanging cells, and those in a row that may leave as many violated as before until cells change sides one
// by one (Judice, Pires, Comput. Oper. Res. 21, 1994).
constexpr int kRounds = 20, kPatience = 4;

}  // namespace

// Displacement of a cell per motion: indentation and two tilts (downward), x, y and a turn.
double BondedContact::mode(std::size_t motion, std::size_t component, std::size_t place) const {
  switch (motion) {
    case 0: return component == 2 ? 1.0 : 0.0;
    case 1: return component == 2 && tilting_ ? levers_[place].x : 0.0;
    case 2: return component == 2 && tilting_ ? levers_[place].y : 0.0;
    case 3: return component == 0 ? 1.0 : 0.0;
    case 4: return component == 1 ? 1.0 : 0.0;
    default: return component == 0 ? -levers_[place].y : component == 1 ? levers_[place].x : 0.0;
  }
}

bool BondedContact::solve(const Matrix& compliance, std::size_t cells, const std::vector<std::size_t>& places,
                          const Point* levers, const double* heights, const double* wanted, bool tilting,
                          const std::uint8_t* start, WorkLimit& limit) {
  count_ = places.size();
  levers_ = levers;
  tilting_ = tilting;
  unit_ = wanted[0];
  give_ = 0.0;
  for (const std::size_t place : places) {
    for (std::size_t a = 0; a < 3; ++a) give_ += compliance[a * cells + place][a * cells + place];
  }
  give_ /= static_cast<double>(3 * count_);
  for (std::size_t m = 0; m < kMotions; ++m) wanted_[m] = wanted[m] / unit_;
  if (!tilting) wanted_[1] = wanted_[2] = 0.0;
  heights_.assign(count_, 0.0);
  if (heights != nullptr) {
    const double lowest = *std::min_element(heights, heights + count_);
    for (std::size_t i = 0; i < count_; ++i) heights_[i] = (heights[i] - lowest) / (give_ * unit_);
  }
  pressed_.assign(start, start + count_);
  seen_.clear();
  std::size_t fewest = count_ + 1;
  int patience = kPatience;
  for (int round = 0; round < kRounds; ++round) {
    if (!on(compliance, cells, places, limit)) return false;
    const std::size_t violated = violations(compliance, cells, places);
    if (violated == 0) return balances();
    const bool again = seen_.again({&pressed_});
    if (again && worst_ <= kVerge) return balances();
    if (violated < fewest) {
      fewest = violated;
      patience = kPatience;
    } else {
      --patience;
    }
    if (patience > 0 && !again) {
      for (std::size_t i = 0; i < count_; ++i) pressed_[i] ^= violated_[i];
    } else {
      std::size_t last = count_;
      while (!violated_[--last]) {
      }
      pressed_[last] ^= 1;
    }
  }
  return false;
}

// The solution if exactly the pressed cells touched; false where they cannot carry the resultants.
bool BondedContact::on(const Matrix& compliance, std::size_t cells, const std::vector<std::size_t>& places,
                       WorkLimit& limit) {
  held_.clear();
  for (std::size_t i = 0; i < count_; ++i) {
    if (pressed_[i]) held_.push_back(i);
  }
  const std::size_t held = held_.size(), size = 3 * held;
  if (held == 0 || !limit.factorisation(size)) return false;
  factor_.resize(size, size);
  right_.resize(kMotions + 1, size);
  modes_.resize(kMotions, size);
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t i = 0; i < held; ++i) {
      const double* from = compliance[a * cells + places[held_[i]]];
      double* to = factor_[a * held + i];
      for (std::size_t b = a; b < 3; ++b) {
        // Pressing counts downward.
        const double scale = ((a == 2) != (b == 2) ? -1.0 : 1.0) / give_;
        for (std::size_t j = a == b ? i : 0; j < held; ++j) to[b * held + j] = scale * from[b * cells + places[held_[j]]];
      }
      for (std::size_t m = 0; m < kMotions; ++m) modes_[m][a * held + i] = mode(m, a, held_[i]);
      right_[kMotions][a * held + i] = a == 2 ? heights_[held_[i]] : 0.0;
    }
  }
  if (!factor(factor_)) return false;
  for (std::size_t m = 0; m < kMotions; ++m) std::copy(modes_[m], modes_[m] + size, right_[m]);
  solve_forward(factor_, right_);
  // With S = B^T A^-1 B the motion is d = S^-1 (q + B^T A^-1 g), and the forces are A^-1 (B d - g).
  double stiffness[kMotions * kMotions], needed[kMotions];
  for (std::size_t m = 0; m < kMotions; ++m) {
    for (std::size_t n = 0; n <= m; ++n) {
      stiffness[m * kMotions + n] = stiffness[n * kMotions + m] = dot(right_[m], right_[n], size);
    }
    needed[m] = wanted_[m] + dot(right_[m], right_[kMotions], size);
  }
  double values[kMotions], vectors[kMotions * kMotions];
  symmetric_eigen(kMotions, stiffness, values, vectors);
  const double largest = *std::max_element(values, values + kMotions);
  double most = 0.0;
  for (const double one : needed) most = std::max(most, std::abs(one));
  // Cells in one row leave a tilt open. It stays as it is, unless the resultants load it: then it goes far, until other
  // cells come into contact.
  const auto add_motion = [&](const double* resultants, bool first) {
    for (std::size_t k = 0; k < kMotions; ++k) {
      double along = 0.0;
      for (std::size_t m = 0; m < kMotions; ++m) along += vectors[m * kMotions + k] * resultants[m];
      double share = along / std::max(values[k], kOpen * largest);
      if (!(values[k] > kOpen * largest) && !(first && std::abs(along) > kLoaded * most)) share = 0.0;
      for (std::size_t m = 0; m < kMotions; ++m) motion_[m] += share * vectors[m * kMotions + k];
    }
  };
  std::fill(motion_, motion_ + kMotions, 0.0);
  add_motion(needed, true);
  plain_.resize(size);
  for (int round = 0; round < 2; ++round) {
    for (std::size_t k = 0; k < size; ++k) {
      plain_[k] = -right_[kMotions][k];
      for (std::size_t m = 0; m < kMotions; ++m) plain_[k] += right_[m][k] * motion_[m];
    }
    solve_backward(factor_, plain_.data());
    if (round > 0) break;
    // What rounding left of the resultants.
    double left[kMotions];
    for (std::size_t m = 0; m < kMotions; ++m) left[m] = wanted_[m] - dot(modes_[m], plain_.data(), size);
    add_motion(left, false);
  }
  forces_.assign(3 * count_, 0.0);
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t i = 0; i < held; ++i) {
      const double force = plain_[a * held + i] * unit_;
      if (!std::isfinite(force)) return false;
      forces_[a * count_ + held_[i]] = force;
    }
  }
  return true;
}

// How many cells pull although pressed, or overlap although not.
std::size_t BondedContact::violations(const Matrix& compliance, std::size_t cells,
                                      const std::vector<std::size_t>& places) {
  const std::size_t held = held_.size();
  violated_.assign(count_, 0);
  double largest = 0.0, scale = std::abs(motion_[0]);
  for (const double force : plain_) largest = std::max(largest, std::abs(force));
  worst_ = 0.0;
  std::size_t found = 0;
  for (std::size_t i = 0; i < held; ++i) {
    const double pull = -plain_[2 * held + i] / largest;
    if (pull > kTolerance) ++found, violated_[held_[i]] = 1, worst_ = std::max(worst_, pull);
  }
  if (held == count_) return found;
  // Separation of body and surface, in place of the forces of cells that have none.
  separation_.assign(count_, 0.0);
  for (std::size_t i = 0; i < count_; ++i) {
    if (pressed_[i]) continue;
    const double* row = compliance[2 * cells + places[i]];
    double sum = heights_[i];
    for (std::size_t a = 0; a < 3; ++a) {
      const double sign = (a == 2 ? 1.0 : -1.0) / give_;
      for (std::size_t j = 0; j < held; ++j) sum += sign * row[a * cells + places[held_[j]]] * plain_[a * held + j];
    }
    for (std::size_t m = 0; m < 3; ++m) sum -= mode(m, 2, i) * motion_[m];
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
