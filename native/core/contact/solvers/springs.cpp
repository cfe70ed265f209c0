#include "contact/solvers/springs.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/small.hpp"

namespace mjtactile {
namespace {

constexpr int kIterations = 40;
constexpr double kTolerance = 1e-12;
// Stiffness against a tilt, over all springs', below which it is open, and share of the load that turns the body along it.
constexpr double kOpen = 1e-12, kLoaded = 1e-10;
// Least pivot over the largest of springs that surely leave none open.
constexpr double kNearlyOpen = 1e-6;
// Of the load: what may be left of it.
constexpr double kBalanced = 1e-9;
// Share of its slope that a step may leave of the energy's, so that no better length is looked for.
constexpr double kGoodStep = 0.1;

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
  begin();
  for (int iteration = 0; iteration < kIterations && left_over() > kTolerance * resultants[0]; ++iteration) {
    if (!step()) break;
  }
  const std::size_t cells = stiffness.size();
  pressed_.resize(cells);
  forces_.resize(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    const double depth = overlap(i, motion_);
    pressed_[i] = depth > 0.0 ? 1 : 0;
    forces_[i] = force(i, depth);
  }
  return left_over() <= kBalanced * resultants[0];
}

// As deep as all springs together would be pressed, over the highest of them.
void SpringBed::begin() {
  total_ = 0.0;
  double highest = 0.0;
  for (std::size_t i = 0; i < stiffness_->size(); ++i) {
    total_ += (*stiffness_)[i];
    if (heights_ != nullptr) highest = std::max(highest, heights_[i]);
  }
  std::fill(motion_, motion_ + kMost, 0.0);
  motion_[0] = highest + resultants_[0] / total_;
}

// The largest part of the resultants that the springs do not carry, which is the slope of the energy.
double SpringBed::left_over() {
  for (std::size_t m = 0; m < motions_; ++m) gradient_[m] = -resultants_[m];
  for (std::size_t i = 0; i < stiffness_->size(); ++i) {
    const double depth = overlap(i, motion_);
    if (!(depth > 0.0)) continue;
    const double own = force(i, depth);
    for (std::size_t m = 0; m < motions_; ++m) gradient_[m] += own * modes_[i * motions_ + m];
  }
  double largest = 0.0;
  for (std::size_t m = 0; m < motions_; ++m) largest = std::max(largest, std::abs(gradient_[m]));
  return largest;
}

// One step of Newton's method from where left_over() looked; false where none lowers the energy.
bool SpringBed::step() {
  double curvature[kMost * kMost] = {}, along[kMost], slope = 0.0;
  for (std::size_t i = 0; i < stiffness_->size(); ++i) {
    const double depth = overlap(i, motion_);
    if (!(depth > 0.0) || yields(i, depth)) continue;
    const double* own = modes_ + i * motions_;
    for (std::size_t m = 0; m < motions_; ++m) {
      for (std::size_t n = 0; n < motions_; ++n) curvature[m * motions_ + n] += (*stiffness_)[i] * own[m] * own[n];
    }
  }
  for (std::size_t m = 0; m < motions_; ++m) along[m] = -gradient_[m];
  if (!solve_small(motions_, curvature, along, 1, kNearlyOpen)) leave_open(curvature, along);
  for (std::size_t m = 0; m < motions_; ++m) slope += gradient_[m] * along[m];
  if (!(slope < 0.0)) return false;
  const double length = lowest(motion_, along, slope);
  if (!(length > 0.0)) return false;
  for (std::size_t m = 0; m < motions_; ++m) motion_[m] += length * along[m];
  return true;
}

// Newton's step where the springs under pressure leave a tilt open: it stays as it is, unless the load turns the body along
// it. Then it goes far, to the next springs.
void SpringBed::leave_open(const double* curvature, double* along) const {
  double trace = 0.0, load[kMost];
  for (std::size_t m = 0; m < motions_; ++m) {
    trace += curvature[m * motions_ + m];
    load[m] = -gradient_[m];
    along[m] = 0.0;
  }
  const Openness openness = {kOpen * (trace + total_), kLoaded * resultants_[0]};
  MotionStiffness(motions_, curvature).add_motion(load, openness, along);
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
