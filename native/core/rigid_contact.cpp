#include "rigid_contact.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// The same limits as the readable reference's: mjtactile/rigid.py, mjtactile/complementarity.py.
constexpr double kTolerance = 1e-11;
constexpr double kBalanced = 1e-9;
constexpr std::size_t kExchanges = 30;
// A contact that resists one motion this much less than another is for the slower ways.
constexpr double kOpen = 1e-10;

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
  const std::size_t cells = compliance.rows();
  motions_ = motions;
  pressed_.assign(cells, 1);
  if (start != nullptr) pressed_.assign(start, start + cells);
  seen_.clear();
  for (std::size_t trial = 0; trial < kExchanges; ++trial) {
    const std::uint64_t known = fingerprint(pressed_);
    if (std::find(seen_.begin(), seen_.end(), known) != seen_.end()) return false;
    seen_.push_back(known);
    if (!on(compliance, modes, heights)) return false;
    if (violated(resultants, exchange_) == 0) {
      // What rounding leaves of the resultants must be rounding.
      double left = 0.0, size = 0.0;
      for (std::size_t m = 0; m < motions; ++m) {
        double sum = -resultants[m];
        for (std::size_t i = 0; i < cells; ++i) sum += modes[i * motions + m] * along(map_forces_[i], resultants, motions);
        left = std::max(left, std::abs(sum));
        size = std::max(size, std::abs(resultants[m]));
      }
      return left <= kBalanced * size;
    }
    for (std::size_t i = 0; i < cells; ++i) pressed_[i] ^= exchange_[i];
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
bool RigidContact::on(const Matrix& compliance, const double* modes, const double* heights) {
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
        map_motion_[m][n] = sum;
      }
    }
  }
  if (!solve_small(stiffness_, map_motion_, kOpen)) return false;
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
