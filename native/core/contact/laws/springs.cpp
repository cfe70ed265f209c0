#include "contact/laws/springs.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/small.hpp"

namespace mjtactile {
namespace {

constexpr int kIterations = 40;
constexpr double kTolerance = 1e-12, kSufficientDecrease = 1e-4, kDamping = 1e-12, kShortest = 1e-6;
// Of the energy: changes that are rounding; of the load: what may be left of it.
constexpr double kRounding = 1e-13, kBalanced = 1e-9;
constexpr std::size_t kMost = 3;

}  // namespace

// The motion d minimises 1/2 sum k (B d - g)_+^2 - q.d, less where springs yield: Newton's method with a line search.
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
  double least = energy(motion);
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
    double length = 1.0, trial[kMost];
    for (;; length /= 2) {
      for (std::size_t m = 0; m < motions; ++m) trial[m] = motion[m] + length * step[m];
      // Next to the solution the energy does not tell any more.
      if (length < kShortest || std::abs(slope) <= kRounding * std::abs(least) ||
          energy(trial) <= least + kSufficientDecrease * length * slope) {
        break;
      }
    }
    std::copy(trial, trial + motions, motion);
    least = energy(motion);
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

double SpringBed::energy(const double* motion) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < stiffness_->size(); ++i) {
    const double depth = overlap(i, motion);
    if (!(depth > 0.0)) continue;
    const double elastic = yields(i, depth) ? most_[i] / (*stiffness_)[i] : depth;
    sum += (*stiffness_)[i] * elastic * (depth - elastic / 2);
  }
  for (std::size_t m = 0; m < motions_; ++m) sum -= resultants_[m] * motion[m];
  return sum;
}

}  // namespace mjtactile
