#include "contact/solvers/springs.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/small.hpp"

namespace mjtactile {
namespace {

constexpr int kIterations = 40;
constexpr double kTolerance = 1e-12, kDamping = 1e-12;
// Of the load: what may be left of it.
constexpr double kBalanced = 1e-9;
// Share of its slope that a step may leave of the energy's, so that no better length is looked for.
constexpr double kGoodStep = 0.1;
constexpr std::size_t kMost = 3;

}  // namespace

// The motion d minimises 1/2 sum k (B d - g)_+^2 - q.d, less where springs yield: Newton's method, as far along every
// step as the energy falls.
bool SpringBed::solve(const std::vector<double>& stiffness, const double* modes, std::size_t motions,
                      const double* heights, const double* resultants, const double* most) {
  stiffness_ = &stiffness;
  modes_ = modes;
  motions_ = motions;
  heights_ = heights;
  resultants_ = resultants;
  most_ = most;
  const std::size_t cells = stiffness.size();
  double motion[kMost] = {}, total = 0.0, highest = 0.0;
  for (std::size_t i = 0; i < cells; ++i) {
    total += stiffness[i];
    if (heights != nullptr) highest = std::max(highest, heights[i]);
  }
  motion[0] = highest + resultants[0] / total;
  bool balanced = false;
  for (int iteration = 0; iteration < kIterations && !balanced; ++iteration) {
    double gradient[kMost] = {}, curvature[kMost * kMost] = {}, step[kMost] = {};
    for (std::size_t m = 0; m < motions; ++m) gradient[m] = -resultants[m];
    for (std::size_t i = 0; i < cells; ++i) {
      const double depth = overlap(i, motion);
      if (!(depth > 0.0)) continue;
      const double* own = modes + i * motions;
      for (std::size_t m = 0; m < motions; ++m) {
        gradient[m] += force(i, depth) * own[m];
        if (yields(i, depth)) continue;
        for (std::size_t n = 0; n < motions; ++n) curvature[m * motions + n] += stiffness[i] * own[m] * own[n];
      }
    }
    double trace = 0.0, largest = 0.0;
    for (std::size_t m = 0; m < motions; ++m) {
      trace += curvature[m * motions + m];
      largest = std::max(largest, std::abs(gradient[m]));
    }
    balanced = largest <= kTolerance * resultants[0];
    if (balanced) break;
    // Where the springs under pressure leave a tilt open, damping sends the body far along it, to the next springs.
    double slope = 0.0;
    for (std::size_t m = 0; m < motions; ++m) {
      curvature[m * motions + m] += kDamping * (trace + total);
      step[m] = -gradient[m];
    }
    if (!solve_small(motions, curvature, step, 1, 0.0)) break;
    for (std::size_t m = 0; m < motions; ++m) slope += gradient[m] * step[m];
    const double length = lowest(motion, step, slope);
    if (!(length > 0.0)) break;
    for (std::size_t m = 0; m < motions; ++m) motion[m] += length * step[m];
  }
  std::copy(motion, motion + kMost, motion_);
  pressed_.resize(cells);
  forces_.resize(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    const double depth = overlap(i, motion);
    pressed_[i] = depth > 0.0 ? 1 : 0;
    forces_[i] = force(i, depth);
  }
  double largest = 0.0;
  for (std::size_t m = 0; m < motions; ++m) {
    double sum = -resultants[m];
    for (std::size_t i = 0; i < cells; ++i) sum += modes[i * motions + m] * forces_[i];
    largest = std::max(largest, std::abs(sum));
  }
  return largest <= kBalanced * resultants[0];
}

double SpringBed::overlap(std::size_t cell, const double* motion) const {
  double depth = heights_ == nullptr ? 0.0 : -heights_[cell];
  for (std::size_t m = 0; m < motions_; ++m) depth += modes_[cell * motions_ + m] * motion[m];
  return depth;
}

// How far along a step the energy is least: its slope grows by pieces that end where springs meet the body or yield.
// 0 where it falls for ever.
double SpringBed::lowest(const double* motion, const double* step, double slope) {
  const std::size_t cells = stiffness_->size();
  rates_.assign(cells, 0.0);
  double trial[kMost], after = 0.0, bend = 0.0;
  for (std::size_t m = 0; m < motions_; ++m) {
    trial[m] = motion[m] + step[m];
    after -= resultants_[m] * step[m];
  }
  for (std::size_t i = 0; i < cells; ++i) {
    for (std::size_t m = 0; m < motions_; ++m) rates_[i] += modes_[i * motions_ + m] * step[m];
    after += force(i, overlap(i, trial)) * rates_[i];
  }
  if (std::abs(after) <= kGoodStep * std::abs(slope)) return 1.0;
  turns_.clear();
  for (std::size_t i = 0; i < cells; ++i) {
    const double rate = rates_[i];
    if (rate == 0.0) continue;
    const double depth = overlap(i, motion), own = (*stiffness_)[i] * rate * rate;
    if (depth > 0.0 && !yields(i, depth)) bend += own;
    // Where it begins to press, or ends; where it begins to yield, or ends.
    const double meets = -depth / rate, gives = most_ == nullptr ? -1.0 : (most_[i] / (*stiffness_)[i] - depth) / rate;
    if (meets > 0.0) turns_.push_back({meets, rate > 0.0 ? own : -own});
    if (gives > 0.0) turns_.push_back({gives, rate > 0.0 ? -own : own});
  }
  std::sort(turns_.begin(), turns_.end(), [](const Turn& a, const Turn& b) { return a.at < b.at; });
  double length = 0.0;
  for (const Turn& turn : turns_) {
    const double next = slope + bend * (turn.at - length);
    if (next >= 0.0) break;
    slope = next;
    length = turn.at;
    bend += turn.bend;
  }
  return bend > 0.0 ? length - slope / bend : 0.0;
}

}  // namespace mjtactile
