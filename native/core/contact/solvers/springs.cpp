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
// Stiffness of the springs in turn, over their own, if no motion is found at once.
constexpr double kSofter[] = {1e-3, 1e-2, 0.1, 1.0};
// A tilt is open if its stiffness is below the fraction kOpen of all springs'. The body moves along an open tilt if the
// load along it exceeds the fraction kLoaded of the force.
constexpr double kOpen = 1e-12, kLoaded = 1e-10;
// If the least pivot is above this fraction of the largest, no tilt is open.
constexpr double kNearlyOpen = 1e-6;
// Where springs yield, those that are left may leave a tilt open but for rounding, which would then choose the step. So
// all springs resist a step, also those that yield or hang free, with this fraction of their stiffness.
constexpr double kDamping = 1e-4;
// Largest residual of the resultants, over the load.
constexpr double kBalanced = 1e-9;
// Springs that are pressed by less than this fraction of the deepest one hang free but for rounding. They count as
// pressed nowhere, or rounding would decide on the area in contact.
constexpr double kTouches = 1e-10;
// The line search ends if the energy's slope has decreased to this fraction. It tries so many lengths, and extends the
// step by this factor while it is too short.
constexpr double kGoodStep = 0.1, kFarther = 4.0;
constexpr int kTrials = 60;

}  // namespace

// The motion d minimises the energy 1/2 sum k (B d - g)_+^2 - q.d, which grows linearly where springs yield. Newton's
// method with a line search.
bool SpringBed::solve(const std::vector<double>& stiffness, const double* modes, std::size_t motions,
                      const double* heights, const double* resultants, const double* most) {
  stiffness_ = &stiffness;
  motions_ = motions;
  resultants_ = resultants;
  set_rows(modes, heights, most);
  begin();
  bool balanced = settle();
  if (!balanced && most != nullptr) {
    // Where nearly all pressed springs yield, few resist and Newton's steps overshoot. Softer springs yield later, and
    // the motion under them is a good beginning for those that are stiffer.
    for (const double softer : kSofter) {
      softened_.resize(stiffness.size());
      for (std::size_t i = 0; i < stiffness.size(); ++i) softened_[i] = stiffness[i] * softer;
      stiffness_ = &softened_;
      if (softer == kSofter[0]) begin();
      balanced = settle();
    }
    stiffness_ = &stiffness;
  }
  double touches = 0.0;   // depth from which a spring counts as pressed [m]
  for (const double depth : depths_) touches = std::max(touches, kTouches * depth);
  pressed_.resize(depths_.size());
  for (std::size_t i = 0; i < depths_.size(); ++i) pressed_[i] = depths_[i] > touches ? 1 : 0;
  return balanced;
}

// Step from the present motion until the springs carry the resultants. False if they do not.
bool SpringBed::settle() {
  press(motion_);
  for (int iteration = 0; iteration < kIterations && residual() > kTolerance * resultants_[0]; ++iteration) {
    // Where few springs are elastic, because most yield or hang free, Newton's step may not lower the energy.
    if (!step_with(elastic_) && !step_with(*stiffness_)) break;
  }
  return residual() <= kBalanced * resultants_[0];
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
  damping_ = most != nullptr ? kDamping : 0.0;
  for (std::vector<double>* one : {&depths_, &forces_, &elastic_, &rates_, &weighted_}) one->resize(cells);
}

// Initial motion: all springs pressed together, beginning from the highest of the heights.
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

// Set the gradient of the energy: resultants of the springs' forces minus those wanted. Returns its largest component.
double SpringBed::residual() {
  double largest = 0.0;
  for (std::size_t m = 0; m < motions_; ++m) {
    gradient_[m] = dot(forces_.data(), modes_[m], forces_.size()) - resultants_[m];
    largest = std::max(largest, std::abs(gradient_[m]));
  }
  return largest;
}

// One step of Newton's method with these stiffnesses, from the motion of the last residual(). False if it does not
// lower the energy.
bool SpringBed::step_with(const std::vector<double>& stiffnesses) {
  double curvature[kMost * kMost], along[kMost] = {}, slope = 0.0;
  const std::size_t cells = stiffnesses.size();
  for (std::size_t m = 0; m < motions_; ++m) {
    for (std::size_t i = 0; i < cells; ++i) {
      weighted_[i] = (stiffnesses[i] + damping_ * (*stiffness_)[i]) * modes_[m][i];
    }
    for (std::size_t n = 0; n <= m; ++n) {
      curvature[m * motions_ + n] = curvature[n * motions_ + m] = dot(weighted_.data(), modes_[n], cells);
    }
  }
  for (std::size_t m = 0; m < motions_; ++m) along[m] = -gradient_[m];
  if (!solve_small(motions_, curvature, along, 1, kNearlyOpen)) step_with_open_tilt(curvature, along);
  for (std::size_t m = 0; m < motions_; ++m) slope += gradient_[m] * along[m];
  if (!(slope < 0.0)) return false;
  const double length = line_search(along, slope);
  if (!(length > 0.0)) return false;
  for (std::size_t m = 0; m < motions_; ++m) motion_[m] += length * along[m];
  return true;
}

// Newton's step if the pressed springs leave a tilt open. The body does not move along it unless the load does work
// along it. In that case the step is long enough to reach the next springs.
void SpringBed::step_with_open_tilt(const double* curvature, double* along) const {
  double trace = 0.0, load[kMost];
  for (std::size_t m = 0; m < motions_; ++m) {
    trace += curvature[m * motions_ + m];
    load[m] = -gradient_[m];
    along[m] = 0.0;
  }
  const Openness openness = {kOpen * (trace + total_), kLoaded * resultants_[0]};
  MotionStiffness(motions_, curvature).add_motion(load, openness, along);
}

// Line search: the length of the step at which the energy's slope, which is piecewise linear, nearly vanishes. Newton's
// method with bisection as safeguard. Returns 0 if the slope stays negative. The springs' state is that at the end.
double SpringBed::line_search(const double* step, double slope) {
  const double *first = modes_[0], *second = modes_[1], *third = modes_[2];
  for (std::size_t i = 0; i < rates_.size(); ++i) {
    rates_[i] = first[i] * step[0] + second[i] * step[1] + third[i] * step[2];
  }
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
    // Bisect if no spring resists or Newton's method leaves the bounds.
    if (!(length > least && length < most)) length = std::isfinite(most) ? (least + most) / 2 : kFarther * least;
  }
  press(motion_);
  return 0.0;
}

}  // namespace mjtactile
