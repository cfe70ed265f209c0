#include "rigid_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mjtactile {
namespace {

// The same limits as the readable reference's: mjtactile/rigid.py, mjtactile/complementarity.py.
constexpr double kTolerance = 1e-11;
constexpr double kBalanced = 1e-9;
constexpr std::size_t kExchanges = 40, kPatience = 3;
// Steps of the descent that has the last word, and rounds with bounded forces: time is bounded, too.
constexpr std::size_t kDescents = 20, kBounded = 40;
// Springs that start the search, over the stiffness of single cells.
constexpr double kSprings = 0.2;
// Where a contact resists one motion this much less than another, it is looked at whether that is open: below the second
// limit it is, and loaded by what is more than the third of the resultants (mjtactile/rigid.py).
constexpr double kOpen = 1e-10, kOpenMotion = 1e-12, kLoaded = 1e-11;

std::uint64_t fingerprint(const std::vector<std::uint8_t>& cells) {
  std::uint64_t hash = 1469598103934665603u;  // FNV-1a
  for (const std::uint8_t cell : cells) hash = (hash ^ cell) * 1099511628211u;
  return hash;
}

double along(const double* map, const double* resultants, std::size_t motions) {
  double value = map[motions];
  for (std::size_t m = 0; m < motions; ++m) value += map[m] * resultants[m];
  return value;
}

}  // namespace

bool RigidContact::solve(const Matrix& compliance, const double* modes, std::size_t motions, const double* heights,
                         const double* resultants, const std::uint8_t* start) {
  if ((start != nullptr || heights == nullptr) &&
      exchange(compliance, modes, motions, heights, resultants, start)) {
    return true;
  }
  stiffnesses_.resize(compliance.rows());
  for (std::size_t i = 0; i < stiffnesses_.size(); ++i) stiffnesses_[i] = kSprings / compliance[i][i];
  if (!springs_.solve(stiffnesses_, modes, motions, heights, resultants)) return false;
  if (exchange(compliance, modes, motions, heights, resultants, springs_.pressed().data())) return true;
  return descend(compliance, modes, heights, resultants) && balances(modes, resultants);
}

// Block principal pivoting (Portugal, Judice, Vicente, Mathematics of Computation 63, 1994): all cells that violate their
// conditions change sides while that leaves fewer; where it does not for a few times, only the last of them does.
bool RigidContact::exchange(const Matrix& compliance, const double* modes, std::size_t motions, const double* heights,
                            const double* resultants, const std::uint8_t* start, bool flexible) {
  const std::size_t cells = compliance.rows();
  flexible_ = flexible;
  motions_ = motions;
  pressed_.assign(cells, 1);
  if (start != nullptr) pressed_.assign(start, start + cells);
  std::size_t fewest = cells + 1, patience = kPatience;
  for (std::size_t trial = 0; trial < kExchanges; ++trial) {
    if (!on(compliance, modes, heights, resultants)) return false;
    const std::size_t wrong = violated(resultants, exchange_);
    if (wrong == 0) return balances(modes, resultants);
    if (wrong < fewest) {
      fewest = wrong;
      patience = kPatience;
    } else if (patience > 0) {
      --patience;
    } else {
      const auto last = std::find(exchange_.rbegin(), exchange_.rend(), std::uint8_t{1});
      std::fill(last + 1, exchange_.rend(), std::uint8_t{0});
    }
    for (std::size_t i = 0; i < cells; ++i) pressed_[i] ^= exchange_[i];
  }
  return false;
}

// Whether what rounding leaves of the resultants is rounding.
bool RigidContact::balances(const double* modes, const double* resultants) const {
  double left = 0.0, size = 0.0;
  for (std::size_t m = 0; m < motions_; ++m) {
    double sum = -resultants[m];
    for (std::size_t i = 0; i < cells(); ++i) {
      sum += modes[i * motions_ + m] * along(map_forces_[i], resultants, motions_);
    }
    left = std::max(left, std::abs(sum));
    size = std::max(size, std::abs(resultants[m]));
  }
  return left <= kBalanced * size;
}

// Primal active-set method from the springs' forces, which carry the resultants: the energy falls at every step, so
// that it cannot cycle.
bool RigidContact::descend(const Matrix& compliance, const double* modes, const double* heights,
                           const double* resultants) {
  forces_ = springs_.forces();
  for (std::size_t i = 0; i < cells(); ++i) pressed_[i] = forces_[i] > 0.0 ? 1 : 0;
  for (std::size_t trial = 0; trial < std::min(cells(), kDescents); ++trial) {
    if (!on(compliance, modes, heights, resultants)) return false;
    double largest = 0.0, length = 1.0;
    for (std::size_t i = 0; i < cells(); ++i) {
      largest = std::max(largest, std::abs(along(map_forces_[i], resultants, motions_)));
    }
    // As far towards the solution on these cells as none of them pulls.
    for (std::size_t i = 0; i < cells(); ++i) {
      const double wanted = along(map_forces_[i], resultants, motions_);
      if (pressed_[i] && wanted < -kTolerance * largest) length = std::min(length, forces_[i] / (forces_[i] - wanted));
    }
    double most = 0.0;
    for (std::size_t i = 0; i < cells(); ++i) {
      const double wanted = along(map_forces_[i], resultants, motions_);
      forces_[i] = std::max(forces_[i] + length * (wanted - forces_[i]), 0.0);
      most = std::max(most, forces_[i]);
    }
    if (length < 1.0) {
      for (std::size_t i = 0; i < cells(); ++i) {
        if (pressed_[i] && forces_[i] <= kTolerance * most) pressed_[i] = 0, forces_[i] = 0.0;
      }
      continue;
    }
    if (violated(resultants, exchange_) == 0) return true;
    std::size_t worst = cells();
    double deepest = 0.0;
    for (std::size_t i = 0; i < cells(); ++i) {
      const double separation = pressed_[i] ? 0.0 : along(map_separation_[i], resultants, motions_);
      if (exchange_[i] && separation < deepest) deepest = separation, worst = i;
    }
    if (worst == cells()) return false;
    pressed_[worst] = 1;
  }
  return false;
}

bool RigidContact::solve_bounded(const Matrix& compliance, const double* modes, std::size_t motions,
                                 const double* heights, const double* resultants, const double* most,
                                 const std::vector<std::uint8_t>& start, std::vector<double>& forces, double* motion) {
  const std::size_t cells = compliance.rows();
  const auto give = [&](std::size_t i, std::size_t j) { return i < j ? compliance[i][j] : compliance[j][i]; };
  motions_ = motions;
  flexible_ = true;
  pressed_ = start;
  full_.assign(cells, 0);
  pushed_.resize(cells);
  forces.assign(cells, 0.0);
  seen_.clear();
  for (std::size_t round = 0; round < kBounded; ++round) {
    // What the full cells carry is taken off the load, and the surface lies lower where they push it.
    double left[kMostMotions];
    std::copy(resultants, resultants + motions, left);
    for (std::size_t i = 0; i < cells; ++i) {
      pushed_[i] = heights == nullptr ? 0.0 : heights[i];
      if (!full_[i]) continue;
      for (std::size_t m = 0; m < motions; ++m) left[m] -= most[i] * modes[i * motions + m];
    }
    for (std::size_t j = 0; j < cells; ++j) {
      if (!full_[j]) continue;
      for (std::size_t i = 0; i < cells; ++i) pushed_[i] += most[j] * give(i, j);
    }
    if (!on(compliance, modes, pushed_.data(), left)) return false;
    for (std::size_t m = 0; m < motions; ++m) motion[m] = along(map_motion_[m], left, motions);
    double scale = std::abs(motion[0]);
    for (std::size_t i = 0; i < cells; ++i) scale = std::max(scale, std::abs(pushed_[i]));
    bool changed = false;
    for (std::size_t i = 0; i < cells; ++i) {
      if (full_[i]) {
        // Let go where the surface would be pushed deeper than the body is.
        double separation = pushed_[i];
        for (std::size_t m = 0; m < motions; ++m) separation -= modes[i * motions + m] * motion[m];
        for (const std::size_t j : places_) separation += give(i, j) * along(map_forces_[j], left, motions);
        forces[i] = most[i];
        if (separation > kTolerance * scale) full_[i] = 0, pressed_[i] = 1, changed = true;
      } else if (pressed_[i]) {
        forces[i] = along(map_forces_[i], left, motions);
        if (forces[i] > most[i] * (1.0 + kTolerance)) pressed_[i] = 0, full_[i] = 1, changed = true;
        if (forces[i] < -kTolerance * most[i]) pressed_[i] = 0, changed = true;
      } else {
        forces[i] = 0.0;
        if (along(map_separation_[i], left, motions) < -kTolerance * scale) pressed_[i] = 1, changed = true;
      }
    }
    if (!changed) {
      double sum = -resultants[0];
      for (std::size_t i = 0; i < cells; ++i) {
        pressed_[i] |= full_[i];
        sum += forces[i];
      }
      return std::abs(sum) <= kBalanced * resultants[0];
    }
    std::uint64_t known = fingerprint(pressed_);
    for (const std::uint8_t one : full_) known = (known ^ one) * 1099511628211u;
    if (std::find(seen_.begin(), seen_.end(), known) != seen_.end()) return false;
    seen_.push_back(known);
  }
  return false;
}

bool RigidContact::under(const double* resultants, double* forces) const {
  double largest = 0.0;
  for (std::size_t i = 0; i < cells(); ++i) {
    forces[i] = along(map_forces_[i], resultants, motions_);
    largest = std::max(largest, std::abs(forces[i]));
  }
  double scale = std::abs(along(map_motion_[0], resultants, motions_)), overlap = 0.0;
  for (std::size_t i = 0; i < cells(); ++i) {
    if (pressed_[i]) {
      if (forces[i] < -kTolerance * largest) return false;
      continue;
    }
    const double separation = along(map_separation_[i], resultants, motions_);
    scale = std::max(scale, std::abs(separation));
    overlap = std::max(overlap, -separation);
  }
  return overlap <= kTolerance * scale;
}

// The solution if exactly the pressed cells were in contact; false where they cannot carry resultants.
bool RigidContact::on(const Matrix& compliance, const double* modes, const double* heights,
                      const double* resultants) {
  const std::size_t cells = pressed_.size(), motions = motions_, entries = motions + 1;
  places_.clear();
  for (std::size_t i = 0; i < cells; ++i) {
    if (pressed_[i]) places_.push_back(i);
  }
  const std::size_t count = places_.size();
  if (count == 0) return false;
  factor_.resize(count, count);
  right_.resize(entries, count);
  for (std::size_t a = 0; a < count; ++a) {
    const double* from = compliance[places_[a]];
    double* to = factor_[a];
    if (count == cells) {
      std::copy(from + a, from + cells, to + a);
    } else {
      for (std::size_t b = a; b < count; ++b) to[b] = from[places_[b]];
    }
    for (std::size_t m = 0; m < motions; ++m) right_[m][a] = modes[places_[a] * motions + m];
    right_[motions][a] = heights == nullptr ? 0.0 : heights[places_[a]];
  }
  if (!factor(factor_)) return false;
  solve_factored(factor_, right_);

  // With S = B^T A^-1 B the motion is d = S^-1 (q + B^T A^-1 g), and the forces are A^-1 (B d - g).
  stiffness_.resize(motions, motions);
  map_motion_.resize(motions, entries);
  for (std::size_t m = 0; m < motions; ++m) {
    for (std::size_t n = 0; n < entries; ++n) {
      double sum = 0.0;
      for (std::size_t a = 0; a < count; ++a) sum += modes[places_[a] * motions + m] * right_[n][a];
      if (n < motions) {
        stiffness_[m][n] = sum;
        map_motion_[m][n] = m == n ? 1.0 : 0.0;
      } else {
        map_motion_[m][n] = pressed_heights_[m] = sum;
      }
    }
  }
  if (!solve_small(stiffness_, map_motion_, kOpen)) {
    if (!flexible_) return false;
    to_flexible_motion(resultants);
  }
  map_forces_.resize(cells, entries);
  map_separation_.resize(cells, entries);
  std::fill(map_forces_.data(), map_forces_.data() + cells * map_forces_.stride(), 0.0);
  std::fill(map_separation_.data(), map_separation_.data() + cells * map_separation_.stride(), 0.0);
  for (std::size_t a = 0; a < count; ++a) {
    double* force = map_forces_[places_[a]];
    for (std::size_t n = 0; n < entries; ++n) {
      double sum = n == motions ? -right_[motions][a] : 0.0;
      for (std::size_t m = 0; m < motions; ++m) sum += right_[m][a] * map_motion_[m][n];
      force[n] = sum;
    }
  }
  for (std::size_t i = 0; i < cells; ++i) {
    if (pressed_[i]) continue;
    double* separation = map_separation_[i];
    for (std::size_t a = 0; a < count; ++a) {
      const std::size_t j = places_[a];
      const double give = i < j ? compliance[i][j] : compliance[j][i];
      for (std::size_t n = 0; n < entries; ++n) separation[n] += give * map_forces_[j][n];
    }
    for (std::size_t m = 0; m < motions; ++m) {
      for (std::size_t n = 0; n < entries; ++n) separation[n] -= modes[i * motions + m] * map_motion_[m][n];
    }
    if (heights != nullptr) separation[motions] += heights[i];
  }
  return true;
}

// The motion where pressed cells in one row leave a tilt open. It stays as it is, unless the resultants load it: then it
// goes far, until other cells come into contact.
void RigidContact::to_flexible_motion(const double* resultants) {
  const std::size_t motions = motions_, entries = motions + 1;
  double values[kMostMotions], vectors[3][3], flexibility[kMostMotions][kMostMotions] = {};
  eigen_small(stiffness_, values, vectors);
  const double largest = std::max(*std::max_element(values, values + motions), std::numeric_limits<double>::min());
  double wanted[kMostMotions], size = 0.0;
  for (std::size_t m = 0; m < motions; ++m) {
    wanted[m] = resultants[m] + pressed_heights_[m];
    size = std::max(size, std::abs(wanted[m]));
  }
  for (std::size_t k = 0; k < motions; ++k) {
    double along_it = 0.0, inverse = 1.0 / std::max(values[k], kOpenMotion * largest);
    for (std::size_t m = 0; m < motions; ++m) along_it += vectors[m][k] * wanted[m];
    if (values[k] < kOpenMotion * largest) inverse = std::abs(along_it) > kLoaded * size ? 1.0 / (kOpenMotion * largest) : 0.0;
    for (std::size_t m = 0; m < motions; ++m) {
      for (std::size_t n = 0; n < motions; ++n) flexibility[m][n] += inverse * vectors[m][k] * vectors[n][k];
    }
  }
  for (std::size_t m = 0; m < motions; ++m) {
    double constant = 0.0;
    for (std::size_t n = 0; n < motions; ++n) {
      map_motion_[m][n] = flexibility[m][n];
      constant += flexibility[m][n] * pressed_heights_[n];
    }
    map_motion_[m][entries - 1] = constant;
  }
}

// Which cells pull although pressed, or overlap although not; how many.
std::size_t RigidContact::violated(const double* resultants, std::vector<std::uint8_t>& violated) const {
  violated.assign(cells(), 0);
  double largest = 0.0, scale = std::abs(along(map_motion_[0], resultants, motions_));
  for (std::size_t i = 0; i < cells(); ++i) {
    if (pressed_[i]) {
      largest = std::max(largest, std::abs(along(map_forces_[i], resultants, motions_)));
    } else {
      scale = std::max(scale, std::abs(along(map_separation_[i], resultants, motions_)));
    }
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells(); ++i) {
    const bool wrong = pressed_[i] ? along(map_forces_[i], resultants, motions_) < -kTolerance * largest
                                   : along(map_separation_[i], resultants, motions_) < -kTolerance * scale;
    violated[i] = wrong ? 1 : 0;
    count += wrong;
  }
  return count;
}

}  // namespace mjtactile
