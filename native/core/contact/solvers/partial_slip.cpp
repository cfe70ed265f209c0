#include "contact/solvers/partial_slip.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Steps of Newton's method, and what its conditions may be off at the end: over the mean of what friction bears, and
// where rounding lets no more steps help.
constexpr int kSteps = 16;
constexpr double kConverged = 1e-11, kAlmost = 1e-10;
// What its resultants and circles may be off where the interior-point method has the last word.
constexpr double kMissed = 1e-10;
// Of the interior-point method.
constexpr int kInteriorSteps = 50;
constexpr double kGap = 1e-13, kSufficient = 1e-7, kStepShare = 0.995;
// Shares of the limit from which on all cells may slip, rather slip than stick, and may as well slip. Motions along
// which they do, over what the surface gives, and steps that find one.
constexpr double kMaySlide = 0.5, kRatherSlides = 0.9995, kNearlySlides = 0.999, kSlides = 1.0 - 1e-8;
constexpr double kShortest = 1e-3, kFarthest = 1e12;
constexpr int kHalvings = 60;
// Motions that the contact resists this much less than another are open; lever arms this short turn nothing.
constexpr double kOpen = 1e-14, kNoLever = 1e-9;

}  // namespace

void PartialSlip::scale(const SlipProblem& problem, double unit, bool same) {
  const Matrix& compliance = problem.compliance;
  const ShearGrip& grip = problem.grip;
  const std::size_t cells = grip.count(), size = 2 * cells;
  cells_ = cells;
  unit_ = unit;
  if (!same) {
    all_stick_ = false;
    give_ = 0.0;
    for (std::size_t k = 0; k < size; ++k) give_ += compliance[k][k] / static_cast<double>(size);
    own_.resize(size, size);
    const double inverse_give = 1.0 / give_;
    for (std::size_t k = 0; k < size; ++k) {
      for (std::size_t l = 0; l < size; ++l) own_[k][l] = inverse_give * compliance[k][l];
    }
  }
  load_.resize(size);
  for (std::size_t k = 0; k < size; ++k) load_[k] = problem.slip[k] / (give_ * unit);
  double levers = 0.0;
  for (std::size_t i = 0; i < cells; ++i) levers += grip.x(i) * grip.x(i) + grip.y(i) * grip.y(i);
  turn_ = std::sqrt(levers / static_cast<double>(cells));
  const double inverse = turn_ > kNoLever ? 1.0 / turn_ : 0.0;
  modes_.assign(3 * size, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    modes_[i] = 1.0;
    modes_[size + cells + i] = 1.0;
    modes_[2 * size + i] = -grip.y(i) * inverse;
    modes_[2 * size + cells + i] = grip.x(i) * inverse;
  }
  wanted_[0] = problem.wanted[0] / unit;
  wanted_[1] = problem.wanted[1] / unit;
  wanted_[2] = problem.wanted[2] / unit * inverse;
}

// How far each cell moves against the body, and what its resultants miss.
void PartialSlip::displace() {
  const std::size_t size = 2 * cells_;
  moved_.resize(size);
  std::copy(load_.begin(), load_.end(), moved_.begin());
  add_product(own_, shear_.data(), moved_.data());
  for (std::size_t k = 0; k < size; ++k) {
    for (std::size_t m = 0; m < 3; ++m) moved_[k] -= modes_[m * size + k] * motion_[m];
  }
}

void PartialSlip::missing(double* missing) const {
  const std::size_t size = 2 * cells_;
  for (std::size_t m = 0; m < 3; ++m) missing[m] = wanted_[m] - dot(modes_.data() + m * size, shear_.data(), size);
}

// How far the shear is from what its own displacement asks of it, and which cells slip there.
double PartialSlip::residual() {
  const std::size_t cells = cells_;
  displace();
  pushed_.resize(2 * cells);
  slips_.resize(cells);
  double worst = 0.0, left[3];
  for (std::size_t i = 0; i < cells; ++i) {
    const double stiffness = 2.0 / (own_[i][i] + own_[cells + i][cells + i]);
    const double x = shear_[i] - stiffness * moved_[i], y = shear_[cells + i] - stiffness * moved_[cells + i];
    pushed_[i] = x, pushed_[cells + i] = y;
    const double size = std::hypot(x, y);
    slips_[i] = size > radius_[i] ? 1 : 0;
    const double share = slips_[i] ? radius_[i] / size : 1.0;
    for (const double one : {share * x - shear_[i], share * y - shear_[cells + i]}) {
      if (!(std::abs(one) <= worst)) worst = std::abs(one);  // numbers that are none stay
      if (std::isnan(worst)) return worst;
    }
  }
  missing(left);
  for (const double one : left) worst = std::max(worst, std::abs(one) / static_cast<double>(cells));
  return worst;
}

// One step: cells that stick follow the body, those that slip stay on their circles. False where it cannot be taken.
bool PartialSlip::newton_step(bool sticks, bool again, WorkLimit& limit) {
  const std::size_t cells = cells_, size = 2 * cells;
  known_.assign(size, 0.0);
  std::size_t stuck = 0;
  for (std::size_t i = 0; i < cells; ++i) {
    if (sticks || !slips_[i]) {
      ++stuck;
      continue;
    }
    const double x = pushed_[i], y = pushed_[cells + i], along = std::hypot(x, y);
    const double ux = x / along, uy = y / along;
    const double outward = radius_[i] - (ux * shear_[i] + uy * shear_[cells + i]);
    known_[i] = ux * outward, known_[cells + i] = uy * outward;
  }
  if (!again && !linearise(sticks, stuck, limit)) return false;
  const std::size_t count = cell_of_.size();
  right_.resize(4, count);
  change_.resize(size);
  std::fill(change_.begin(), change_.end(), 0.0);
  if (stuck < cells) add_product(own_, known_.data(), change_.data());
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = cell_of_[k];
    const double x = axis_[2 * k], y = axis_[2 * k + 1];
    const double give = (own_[i][i] + own_[cells + i][cells + i]) / 2;
    const double moved = x * moved_[i] + y * moved_[cells + i];
    right_[0][k] = -(1.0 + bend_[k] / give) * moved - (x * change_[i] + y * change_[cells + i]);
    for (std::size_t m = 0; m < 3; ++m) {
      right_[m + 1][k] = x * modes_[m * size + i] + y * modes_[m * size + cells + i];
    }
  }
  solve_forward(factor_, right_);
  double stiffness[9], flexibility[9], left[3], motion[3] = {};
  missing(left);
  for (std::size_t m = 0; m < 3; ++m) {
    left[m] -= dot(modes_.data() + m * size, known_.data(), size) + dot(right_[m + 1], right_[0], count);
    for (std::size_t n = 0; n < 3; ++n) stiffness[3 * m + n] = dot(right_[m + 1], right_[n + 1], count);
  }
  pseudo_inverse(3, stiffness, kOpen, flexibility);
  for (std::size_t m = 0; m < 3; ++m) {
    for (std::size_t n = 0; n < 3; ++n) motion[m] += flexibility[3 * m + n] * left[n];
  }
  for (std::size_t m = 0; m < 3; ++m) motion_[m] += motion[m];
  for (std::size_t k = 0; k < size; ++k) shear_[k] += known_[k];
  double* step = right_[0];
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t m = 0; m < 3; ++m) step[k] += right_[m + 1][k] * motion[m];
  }
  solve_backward(factor_, step);
  for (std::size_t k = 0; k < count; ++k) {
    shear_[cell_of_[k]] += step[k] * axis_[2 * k];
    shear_[cells + cell_of_[k]] += step[k] * axis_[2 * k + 1];
  }
  return true;
}

// Factor the system of a step. Unknowns are two components of a cell that sticks, one along its circle of a cell that
// slips.
bool PartialSlip::linearise(bool sticks, std::size_t stuck, WorkLimit& limit) {
  const std::size_t cells = cells_;
  all_stick_ = false;
  cell_of_.clear();
  axis_.clear();
  bend_.clear();
  const auto add = [&](std::size_t cell, double x, double y, double bend) {
    cell_of_.push_back(static_cast<std::uint32_t>(cell));
    axis_.push_back(x);
    axis_.push_back(y);
    bend_.push_back(bend);
  };
  for (std::size_t i = 0; i < cells; ++i) {
    if (sticks || !slips_[i]) add(i, 1.0, 0.0, 0.0);
  }
  for (std::size_t k = 0; k < stuck; ++k) add(cell_of_[k], 0.0, 1.0, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    if (sticks || !slips_[i]) continue;
    const double x = pushed_[i], y = pushed_[cells + i], along = std::hypot(x, y);
    const double give = (own_[i][i] + own_[cells + i][cells + i]) / 2;
    add(i, -y / along, x / along, give * (along / radius_[i] - 1.0));
  }
  const std::size_t count = cell_of_.size();
  if (!limit.factorisation(count)) return false;
  factor_.resize(count, count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = cell_of_[k];
    const double x = axis_[2 * k], y = axis_[2 * k + 1];
    const double *along = own_[i], *across = own_[cells + i];
    double* row = factor_[k];
    // Cells that stick come first, x before y.
    std::size_t l = k;
    if (k < 2 * stuck) {
      const double* from = k < stuck ? along : across;
      for (; l < stuck; ++l) row[l] = from[cell_of_[l]];
      for (; l < 2 * stuck; ++l) row[l] = from[cells + cell_of_[l]];
    }
    for (; l < count; ++l) {
      const std::size_t j = cell_of_[l];
      row[l] = (x * along[j] + y * across[j]) * axis_[2 * l] +
               (x * along[cells + j] + y * across[cells + j]) * axis_[2 * l + 1];
    }
    row[k] += bend_[k];
  }
  if (!factor(factor_)) return false;
  all_stick_ = stuck == cells;
  return true;
}

bool PartialSlip::newton(bool known, WorkLimit& limit) {
  double before = INFINITY;
  for (int step = 0; step <= kSteps; ++step) {
    const double left = residual();
    if (!std::isfinite(left)) return false;
    if (known || step > 0) {
      if (left <= kConverged || (left <= kAlmost && left >= 0.5 * before)) return true;
    }
    const bool sticks = !known && step == 0;
    // Where all cells stick, before and now, the system is the same.
    const bool again = !sticks && all_stick_ && std::find(slips_.begin(), slips_.end(), 1) == slips_.end();
    before = left;
    if (step == kSteps || !newton_step(sticks, again, limit)) return false;
  }
  return false;
}

// The sure way: inside all circles, along the path on which multiplier times slack is the same everywhere.
bool PartialSlip::interior(WorkLimit& limit) {
  all_stick_ = false;  // the factor is overwritten
  const std::size_t cells = cells_;
  double most = 1.0;
  for (const double one : load_) most = std::max(most, std::abs(one));
  std::fill(motion_, motion_ + 3, 0.0);
  multiplier_.resize(cells);
  slack_.resize(cells);
  slide_.resize(cells);
  measure_slack();
  for (std::size_t i = 0; i < cells; ++i) multiplier_[i] = most * 0.5 * radius_[i] / slack_[i];
  OnPath here;
  for (int step = 0; step < kInteriorSteps; ++step) {
    here = interior_residual();
    if (!std::isfinite(here.gap) || !std::isfinite(here.error)) return false;
    if (here.gap < kGap && here.error < 1e-10 * most) return true;
    if (!(here.tightest > 0.0) || !limit.factorisation(2 * cells)) break;
    if (!interior_step(here)) break;
  }
  return here.gap < kSufficient && here.error < kSufficient * most;
}

void PartialSlip::measure_slack() {
  for (std::size_t i = 0; i < cells_; ++i) {
    const double x = shear_[i], y = shear_[cells_ + i];
    slack_[i] = 0.5 * (radius_[i] * radius_[i] - x * x - y * y);
  }
}

PartialSlip::OnPath PartialSlip::interior_residual() {
  const std::size_t cells = cells_;
  measure_slack();
  displace();
  OnPath here;
  here.gap = here.error = 0.0;
  for (std::size_t i = 0; i < cells; ++i) {
    here.gap += multiplier_[i] * slack_[i] / static_cast<double>(cells);
    here.tightest = std::min(here.tightest, slack_[i]);
    moved_[i] += multiplier_[i] * shear_[i];
    moved_[cells + i] += multiplier_[i] * shear_[cells + i];
    here.error = std::max({here.error, std::abs(moved_[i]), std::abs(moved_[cells + i])});
  }
  missing(here.missing);
  for (const double one : here.missing) here.error = std::max(here.error, std::abs(one));
  return here;
}

// Newton's step towards a point of the path with a smaller gap, as far as every cell stays inside; false where its
// system cannot be solved.
bool PartialSlip::interior_step(const OnPath& here) {
  const std::size_t cells = cells_, size = 2 * cells;
  const double target = (here.gap > 1e-6 ? 0.1 : 0.01) * here.gap;
  factor_.resize(size, size);
  right_.resize(4, size);
  for (std::size_t k = 0; k < size; ++k) std::copy(own_[k] + k, own_[k] + size, factor_[k] + k);
  for (std::size_t i = 0; i < cells; ++i) {
    const double x = shear_[i], y = shear_[cells + i], ratio = multiplier_[i] / slack_[i];
    const double push = (target - multiplier_[i] * slack_[i]) / slack_[i];
    factor_[i][i] += multiplier_[i] + ratio * x * x;
    factor_[cells + i][cells + i] += multiplier_[i] + ratio * y * y;
    factor_[i][cells + i] += ratio * x * y;
    slide_[i] = push;
    right_[0][i] = -moved_[i] - x * push;
    right_[0][cells + i] = -moved_[cells + i] - y * push;
  }
  for (std::size_t m = 0; m < 3; ++m) {
    std::copy(modes_.data() + m * size, modes_.data() + (m + 1) * size, right_[m + 1]);
  }
  if (!factor(factor_)) return false;
  solve_forward(factor_, right_);
  double stiffness[9], flexibility[9], left[3], motion[3] = {};
  for (std::size_t m = 0; m < 3; ++m) {
    left[m] = here.missing[m] - dot(right_[m + 1], right_[0], size);
    for (std::size_t n = 0; n < 3; ++n) stiffness[3 * m + n] = dot(right_[m + 1], right_[n + 1], size);
  }
  pseudo_inverse(3, stiffness, kOpen, flexibility);
  for (std::size_t m = 0; m < 3; ++m) {
    for (std::size_t n = 0; n < 3; ++n) motion[m] += flexibility[3 * m + n] * left[n];
  }
  change_.resize(size);
  for (std::size_t k = 0; k < size; ++k) {
    change_[k] = right_[0][k];
    for (std::size_t m = 0; m < 3; ++m) change_[k] += right_[m + 1][k] * motion[m];
  }
  solve_backward(factor_, change_.data());
  const double share = share_inside();
  for (std::size_t k = 0; k < size; ++k) shear_[k] += share * change_[k];
  for (std::size_t i = 0; i < cells; ++i) multiplier_[i] += share * slide_[i];
  for (std::size_t m = 0; m < 3; ++m) motion_[m] += share * motion[m];
  return true;
}

// The largest share of a step, up to 1, that leaves every cell well inside its circle; completes the step of the
// multipliers.
double PartialSlip::share_inside() {
  double share = 1.0;
  for (std::size_t i = 0; i < cells_; ++i) {
    const double x = shear_[i], y = shear_[cells_ + i], dx = change_[i], dy = change_[cells_ + i];
    const double a = dx * dx + dy * dy, b = x * dx + y * dy, c = -2.0 * slack_[i];
    if (a > 0.0) share = std::min(share, kStepShare * (-b + std::sqrt(std::max(b * b - a * c, 0.0))) / a);
    slide_[i] += multiplier_[i] / slack_[i] * b;
    if (slide_[i] < 0.0) share = std::min(share, kStepShare * multiplier_[i] / -slide_[i]);
  }
  return share;
}

// Let cells that have room take up what the resultants miss; false where that leaves some beyond their circles.
bool PartialSlip::balance() {
  const std::size_t cells = cells_, size = 2 * cells;
  for (int round = 0; round < 2; ++round) {
    double gram[9] = {}, inverse[9], left[3], motion[3] = {};
    missing(left);
    slack_.resize(cells);
    for (std::size_t i = 0; i < cells; ++i) {
      const double x = shear_[i], y = shear_[cells + i];
      slack_[i] = std::max(radius_[i] * radius_[i] - x * x - y * y, 0.0);
      for (std::size_t m = 0; m < 3; ++m) {
        for (std::size_t n = 0; n < 3; ++n) {
          gram[3 * m + n] += slack_[i] * (modes_[m * size + i] * modes_[n * size + i] +
                                          modes_[m * size + cells + i] * modes_[n * size + cells + i]);
        }
      }
    }
    pseudo_inverse(3, gram, kOpen, inverse);
    for (std::size_t m = 0; m < 3; ++m) {
      for (std::size_t n = 0; n < 3; ++n) motion[m] += inverse[3 * m + n] * left[n];
    }
    for (std::size_t i = 0; i < cells; ++i) {
      for (std::size_t m = 0; m < 3; ++m) {
        shear_[i] += slack_[i] * motion[m] * modes_[m * size + i];
        shear_[cells + i] += slack_[i] * motion[m] * modes_[m * size + cells + i];
      }
    }
  }
  double left[3];
  missing(left);
  for (const double one : left) {
    if (!(std::abs(one) <= kMissed * static_cast<double>(cells))) return false;
  }
  for (std::size_t i = 0; i < cells; ++i) {
    if (!(std::hypot(shear_[i], shear_[cells + i]) <= radius_[i] * (1.0 + kMissed))) return false;
  }
  return true;
}

// Where next to all cells slip, the body moves far along one direction: how far, so that the cells, which then slip the
// way they are pushed, carry what is wanted. `shear_` holds that of full sliding on entry.
void PartialSlip::nearly_slide(const double* direction) {
  const std::size_t cells = cells_, size = 2 * cells;
  const double along[3] = {direction[0], direction[1], direction[2] * turn_};
  // What the surface moves by itself, apart from a rigid motion.
  double gram[9], inverse[9], fit[3], rigid[3] = {};
  std::fill(motion_, motion_ + 3, 0.0);
  displace();
  for (std::size_t m = 0; m < 3; ++m) {
    fit[m] = dot(modes_.data() + m * size, moved_.data(), size);
    for (std::size_t n = 0; n < 3; ++n) gram[3 * m + n] = dot(modes_.data() + m * size, modes_.data() + n * size, size);
  }
  pseudo_inverse(3, gram, kOpen, inverse);
  for (std::size_t m = 0; m < 3; ++m) {
    for (std::size_t n = 0; n < 3; ++n) rigid[m] += inverse[3 * m + n] * fit[n];
  }
  double aim = 0.0;
  for (std::size_t m = 0; m < 3; ++m) aim += wanted_[m] * along[m];
  double low = kShortest, high = kFarthest;
  for (int halving = 0; halving < kHalvings; ++halving) {
    const double far = std::sqrt(low * high);
    for (std::size_t m = 0; m < 3; ++m) motion_[m] = rigid[m] + far * along[m];
    double work = 0.0;
    for (std::size_t i = 0; i < cells; ++i) {
      double push[2] = {-moved_[i], -moved_[cells + i]}, go[2] = {};
      for (std::size_t m = 0; m < 3; ++m) {
        const double x = modes_[m * size + i], y = modes_[m * size + cells + i];
        push[0] += motion_[m] * x, push[1] += motion_[m] * y;
        go[0] += along[m] * x, go[1] += along[m] * y;
      }
      const double length = std::hypot(push[0], push[1]), share = length > 0.0 ? radius_[i] / length : 0.0;
      shear_[i] = share * push[0], shear_[cells + i] = share * push[1];
      work += shear_[i] * go[0] + shear_[cells + i] * go[1];
    }
    (work < aim ? low : high) = far;
  }
}

bool PartialSlip::solve(const SlipProblem& problem, double friction, bool known, WorkLimit& limit, double* shear) {
  const ShearGrip& grip = problem.grip;
  const double* wanted = problem.wanted;
  const std::size_t cells = grip.count(), size = 2 * cells;
  const double before = give_ * unit_;
  scale(problem, friction * grip.pressing() / static_cast<double>(cells), known);
  radius_.resize(cells);
  for (std::size_t i = 0; i < cells; ++i) radius_[i] = friction * grip.normal(i) / unit_;
  shear_.resize(size);
  const auto take = [&] {
    for (std::size_t k = 0; k < size; ++k) shear[k] = shear_[k] * unit_;
    return true;
  };
  double direction[3];
  if (known) {
    for (std::size_t k = 0; k < size; ++k) shear_[k] = shear[k] / unit_;
    for (double& one : motion_) one *= before / (give_ * unit_);
    // What slid as a whole does so again, most likely.
    if (slid_ && grip.sliding_with(wanted, friction, shear, direction) >= kSlides) return true;
    slid_ = false;
    if (newton(true, limit)) return take();
  }
  const double share = grip.sliding_with(wanted, friction, shear, direction);
  slid_ = share >= kSlides;
  if (slid_) return true;
  for (int trial = 0; trial < 2; ++trial) {
    // From where all cells stick, or from where all slip: the likelier one first.
    const bool slides = (trial == 0) == (share > kRatherSlides);
    if (slides && !(share > kMaySlide)) continue;
    if (slides) {
      for (std::size_t k = 0; k < size; ++k) shear_[k] = shear[k] / unit_;
      nearly_slide(direction);
    } else {
      std::fill(shear_.begin(), shear_.end(), 0.0);
      std::fill(motion_, motion_ + 3, 0.0);
    }
    const bool found = newton(slides, limit);
    if (found) return take();
  }
  std::fill(shear_.begin(), shear_.end(), 0.0);
  if (interior(limit)) {
    // It ends near the solution, which Newton's method reaches.
    slide_.assign(shear_.begin(), shear_.end());
    if (newton(true, limit)) return take();
    std::copy(slide_.begin(), slide_.end(), shear_.begin());
    if (balance()) return take();
  }
  // Cells that still stick are few: all may as well slide.
  return share >= kNearlySlides;
}

bool PartialSlip::bonded(const SlipProblem& problem, WorkLimit& limit, double* shear) {
  const ShearGrip& grip = problem.grip;
  const std::size_t size = 2 * grip.count();
  scale(problem, grip.pressing() / static_cast<double>(grip.count()), false);
  shear_.assign(size, 0.0);
  std::fill(motion_, motion_ + 3, 0.0);
  displace();
  if (!newton_step(true, false, limit)) return false;
  for (std::size_t k = 0; k < size; ++k) {
    if (!std::isfinite(shear_[k])) return false;
    shear[k] = shear_[k] * unit_;
  }
  return true;
}

}  // namespace mjtactile
