#include "contact/solvers/springs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linalg/kernels.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

constexpr int kIterations = 40;
constexpr double kTolerance = 1e-12;
// Stiffness against a tilt, over all springs', below which it is open, and share of the load that turns the body along
// it.
constexpr double kOpen = 1e-12, kLoaded = 1e-10;
// Least pivot over the largest of springs that surely leave none open.
constexpr double kNearlyOpen = 1e-6;
// Of the load: what may be left of it.
constexpr double kBalanced = 1e-9;
// Share of its slope that a step may leave of the energy's; lengths tried, each so many times farther where none was
// far enough.
constexpr double kGoodStep = 0.1, kFarther = 4.0;
constexpr int kTrials = 60;

}  // namespace

// The motion d minimises 1/2 sum k (B d - g)_+^2 - q.d, less where springs yield: Newton's method, as far along every
// step as the energy falls.
bool SpringBed::solve(const std::vector<double>& stiffness, const double* modes, std::size_t motions,
                      const double* heights, const double* resultants, const double* most) {
  stiffness_ = &stiffness;
  motions_ = motions;
  resultants_ = resultants;
  set_rows(modes, heights, most);
  begin();
  press(motion_);
  for (int iteration = 0; iteration < kIterations && left_over() > kTolerance * resultants[0]; ++iteration) {
    if (!step()) break;
  }
  const std::size_t cells = stiffness.size();
  pressed_.resize(cells);
  for (std::size_t i = 0; i < cells; ++i) pressed_[i] = depths_[i] > 0.0 ? 1 : 0;
  return left_over() <= kBalanced * resultants[0];
}

void SpringBed::set_rows(const double* modes, const double* heights, const double* most) {
  const std::size_t cells = stiffness_->size();
  modes_.resize(kMost, cells);
  for (std::size_t m = 0; m < kMost; ++m) {
    for (std::size_t i = 0; i < cells; ++i) modes_[m][i] = m < motions_ ? modes[i * motions_ + m] : 0.0;
  }
  heights_.assign(cells, 0.0);
  if (heights != nullptr) heights_.assign(heights, heights + cells);
  most_.assign(cells, std::numeric_limits<double>::infinity());
  if (most != nullptr) most_.assign(most, most + cells);
  for (std::vector<double>* one : {&depths_, &forces_, &elastic_, &rates_, &weighted_}) one->resize(cells);
}

// As deep as all springs together would be pressed, over the highest of them.
void SpringBed::begin() {
  total_ = 0.0;
  double highest = 0.0;
  for (std::size_t i = 0; i < stiffness_->size(); ++i) {
    total_ += (*stiffness_)[i];
    highest = std::max(highest, heights_[i]);
  }
  std::fill(motion_, motion_ + kMost, 0.0);
  motion_[0] = highest + resultants_[0] / total_;
}

void SpringBed::press(const double* motion) {
  const SpringRows springs = {stiffness_->data(), most_.data(), {modes_[0], modes_[1], modes_[2]}, heights_.data()};
  kernels().press_springs(springs, motion, stiffness_->size(), depths_.data(), forces_.data(), elastic_.data());
}

// The largest part of the resultants that the springs do not carry, which is the slope of the energy.
double SpringBed::left_over() {
  double largest = 0.0;
  for (std::size_t m = 0; m < motions_; ++m) {
    gradient_[m] = dot(forces_.data(), modes_[m], forces_.size()) - resultants_[m];
    largest = std::max(largest, std::abs(gradient_[m]));
  }
  return largest;
}

// One step of Newton's method from where left_over() looked; false where none lowers the energy.
bool SpringBed::step() {
  double curvature[kMost * kMost], along[kMost] = {}, slope = 0.0;
  const std::size_t cells = elastic_.size();
  for (std::size_t m = 0; m < motions_; ++m) {
    for (std::size_t i = 0; i < cells; ++i) weighted_[i] = elastic_[i] * modes_[m][i];
    for (std::size_t n = 0; n <= m; ++n) {
      curvature[m * motions_ + n] = curvature[n * motions_ + m] = dot(weighted_.data(), modes_[n], cells);
    }
  }
  for (std::size_t m = 0; m < motions_; ++m) along[m] = -gradient_[m];
  if (!solve_small(motions_, curvature, along, 1, kNearlyOpen)) leave_open(curvature, along);
  for (std::size_t m = 0; m < motions_; ++m) slope += gradient_[m] * along[m];
  if (!(slope < 0.0)) return false;
  const double length = lowest(along, slope);
  if (!(length > 0.0)) return false;
  for (std::size_t m = 0; m < motions_; ++m) motion_[m] += length * along[m];
  return true;
}

// Newton's step where the springs under pressure leave a tilt open: it stays as it is, unless the load turns the body
// along it. Then it goes far, to the next springs.
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

// How far along a step the energy's slope, which grows by pieces, comes to next to nothing: Newton's method between
// bounds; 0 where it falls for ever. Springs are left pressed as they are there.
double SpringBed::lowest(const double* step, double slope) {
  const double *first = modes_[0], *second = modes_[1], *third = modes_[2];
  for (std::size_t i = 0; i < rates_.size(); ++i) rates_[i] = first[i] * step[0] + second[i] * step[1] + third[i] * step[2];
  double length = 1.0, least = 0.0, most = std::numeric_limits<double>::infinity();
  for (int trial = 0; trial < kTrials; ++trial) {
    double motion[kMost];
    for (std::size_t m = 0; m < kMost; ++m) motion[m] = motion_[m] + length * step[m];
    press(motion);
    double after = dot(forces_.data(), rates_.data(), rates_.size());
    for (std::size_t m = 0; m < motions_; ++m) after -= resultants_[m] * step[m];
    if (std::abs(after) <= kGoodStep * std::abs(slope)) return length;
    (after < 0.0 ? least : most) = length;
    for (std::size_t i = 0; i < rates_.size(); ++i) weighted_[i] = elastic_[i] * rates_[i];
    length -= after / dot(weighted_.data(), rates_.data(), rates_.size());
    // Where no spring resists, or beyond the bounds, halfway between them.
    if (!(length > least && length < most)) length = std::isfinite(most) ? (least + most) / 2 : kFarther * least;
  }
  press(motion_);
  return 0.0;
}

}  // namespace mjtactile
