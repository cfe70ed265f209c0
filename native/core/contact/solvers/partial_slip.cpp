#include "contact/solvers/partial_slip.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Largest number of steps of Newton's method, and the residual at which it ends, over the mean of what friction bears.
// If rounding errors prevent further progress, kAlmost is accepted.
constexpr int kSteps = 16;
constexpr double kConverged = 1e-11, kAlmost = 1e-10;
// A factor serves the next step, too, if the same cells slip and its last step left less than this share of the
// residual.
constexpr double kStillGood = 0.05;
// Largest error of the resultants and of the friction bounds if the result is that of the interior-point method.
constexpr double kMissed = 1e-10;
// Interior-point method: largest number of steps, gap at which it ends, gap that is accepted if it cannot go on, and
// share of the longest step inside the bounds that is taken.
constexpr int kInteriorSteps = 50;
constexpr double kGap = 1e-13, kSufficient = 1e-7, kStepShare = 0.995;
// Shares of the load in the largest load that friction carries. Above kMaySlide, a start near full sliding is tried;
// above kRatherSlides, it is tried first. Above kNearlySlides, full sliding is accepted if no method converges. Above
// kSlides, all cells slide.
constexpr double kMaySlide = 0.5, kRatherSlides = 0.9995, kNearlySlides = 0.999, kSlides = 1.0 - 1e-8;
// Bounds on the body's motion near full sliding, over the surface's displacement, and the number of bisections for it.
constexpr double kShortest = 1e-3, kFarthest = 1e12;
constexpr int kHalvings = 60;
// A motion is open if its stiffness is below the fraction kOpen of the largest. Lever arms below kNoLever carry no
// torsion.
constexpr double kOpen = 1e-14, kNoLever = 1e-9;

}  // namespace

void PartialSlip::scale(const SlipProblem& problem, double unit, bool same) {
  const Matrix& compliance = problem.compliance;
  const ShearGrip& grip = problem.grip;
  const std::size_t cells = grip.count(), size = 2 * cells;
  cells_ = cells;
  force_unit_ = unit;
  if (!same) {
    factored_.clear();
    compliance_unit_ = 0.0;
    for (std::size_t k = 0; k < size; ++k) compliance_unit_ += compliance[k][k] / static_cast<double>(size);
    compliance_.resize(size, size);
    const double inverse_unit = 1.0 / compliance_unit_;
    for (std::size_t k = 0; k < size; ++k) {
      for (std::size_t l = 0; l < size; ++l) compliance_[k][l] = inverse_unit * compliance[k][l];
    }
  }
  free_slip_.resize(size);
  for (std::size_t k = 0; k < size; ++k) free_slip_[k] = problem.slip[k] / (compliance_unit_ * unit);
  double levers = 0.0;
  for (std::size_t i = 0; i < cells; ++i) levers += grip.x(i) * grip.x(i) + grip.y(i) * grip.y(i);
  lever_unit_ = std::sqrt(levers / static_cast<double>(cells));
  const double inverse = lever_unit_ > kNoLever ? 1.0 / lever_unit_ : 0.0;
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

// Set the displacement of each cell relative to the body.
void PartialSlip::displace() {
  const std::size_t size = 2 * cells_;
  displacement_.resize(size);
  std::copy(free_slip_.begin(), free_slip_.end(), displacement_.begin());
  add_product(compliance_, shear_.data(), displacement_.data());
  for (std::size_t k = 0; k < size; ++k) {
    for (std::size_t m = 0; m < 3; ++m) displacement_[k] -= modes_[m * size + k] * motion_[m];
  }
}

void PartialSlip::missing(double* missing) const {
  const std::size_t size = 2 * cells_;
  for (std::size_t m = 0; m < 3; ++m) missing[m] = wanted_[m] - dot(modes_.data() + m * size, shear_.data(), size);
}

// Residual of the contact conditions: the shear minus the projection of the trial shear on the friction circle. The
// trial shear is the shear minus a cell's stiffness times its displacement. Cells slip if it is outside the circle.
double PartialSlip::residual() {
  const std::size_t cells = cells_;
  displace();
  trial_.resize(2 * cells);
  slips_.resize(cells);
  double worst = 0.0, left[3];
  for (std::size_t i = 0; i < cells; ++i) {
    const double stiffness = 2.0 / (compliance_[i][i] + compliance_[cells + i][cells + i]);
    const double x = shear_[i] - stiffness * displacement_[i];
    const double y = shear_[cells + i] - stiffness * displacement_[cells + i];
    trial_[i] = x, trial_[cells + i] = y;
    const double size = std::hypot(x, y);
    slips_[i] = size > radius_[i] ? 1 : 0;
    const double share = slips_[i] ? radius_[i] / size : 1.0;
    for (const double one : {share * x - shear_[i], share * y - shear_[cells + i]}) {
      if (!(std::abs(one) <= worst)) worst = std::abs(one);  // written so that NaN is kept
      if (std::isnan(worst)) return worst;
    }
  }
  missing(left);
  for (const double one : left) worst = std::max(worst, std::abs(one) / static_cast<double>(cells));
  return worst;
}

// One step of the semismooth Newton method. Sticking cells follow the body, and slipping cells move along their
// friction circles. `same_system`: whether to keep the last factor, although the directions of slip have changed since.
// False if the system cannot be solved.
bool PartialSlip::newton_step(bool all_stick, bool same_system, WorkLimit& limit) {
  const std::size_t cells = cells_, size = 2 * cells;
  radial_step_.assign(size, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    if (all_stick || !slips_[i]) continue;
    const double x = trial_[i], y = trial_[cells + i], along = std::hypot(x, y);
    const double ux = x / along, uy = y / along;
    const double outward = radius_[i] - (ux * shear_[i] + uy * shear_[cells + i]);
    radial_step_[i] = ux * outward, radial_step_[cells + i] = uy * outward;
  }
  const std::size_t stuck = set_unknowns(all_stick);
  if (!same_system && !linearise(stuck, limit)) return false;
  const std::size_t count = cell_of_.size();
  right_.resize(4, count);
  change_.resize(size);
  std::fill(change_.begin(), change_.end(), 0.0);
  if (stuck < cells) add_product(compliance_, radial_step_.data(), change_.data());
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = cell_of_[k];
    const double x = axis_[2 * k], y = axis_[2 * k + 1];
    const double own = (compliance_[i][i] + compliance_[cells + i][cells + i]) / 2;
    const double moved = x * displacement_[i] + y * displacement_[cells + i];
    right_[0][k] = -(1.0 + curvature_[k] / own) * moved - (x * change_[i] + y * change_[cells + i]);
    for (std::size_t m = 0; m < 3; ++m) {
      right_[m + 1][k] = x * modes_[m * size + i] + y * modes_[m * size + cells + i];
    }
  }
  double left[3], moved[3], motion[3];
  missing(left);
  for (std::size_t m = 0; m < 3; ++m) moved[m] = dot(modes_.data() + m * size, radial_step_.data(), size);
  solve_step(left, moved, motion);
  for (std::size_t m = 0; m < 3; ++m) motion_[m] += motion[m];
  for (std::size_t k = 0; k < size; ++k) shear_[k] += radial_step_[k];
  const double* step = right_[0];
  for (std::size_t k = 0; k < count; ++k) {
    shear_[cell_of_[k]] += step[k] * axis_[2 * k];
    shear_[cells + cell_of_[k]] += step[k] * axis_[2 * k + 1];
  }
  return true;
}

// Solve the factored system for a step, which replaces the first row of right_, and for the body's motion. The other
// rows are the motions' modes. `left`: resultants that are missing; `moved`: those of a part of the step that is known.
void PartialSlip::solve_step(const double* left, const double* moved, double* motion) {
  const std::size_t count = right_.columns();
  double* step = right_[0];
  double stiffness[9], unmet[3];
  solve_forward(factor_, right_);
  for (std::size_t m = 0; m < 3; ++m) {
    unmet[m] = left[m] - (moved[m] + dot(right_[m + 1], step, count));
    for (std::size_t n = 0; n < 3; ++n) stiffness[3 * m + n] = dot(right_[m + 1], right_[n + 1], count);
  }
  solve_semidefinite(3, stiffness, kOpen, unmet, motion);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t m = 0; m < 3; ++m) step[k] += right_[m + 1][k] * motion[m];
  }
  solve_backward(factor_, step);
}

// Set the unknowns of a step. A sticking cell has two, its components x and y. A slipping cell has one, along its
// friction circle. Cells that stick come first, x before y. Returns the number of cells that stick.
std::size_t PartialSlip::set_unknowns(bool all_stick) {
  const std::size_t cells = cells_;
  cell_of_.clear();
  axis_.clear();
  curvature_.clear();
  const auto add = [&](std::size_t cell, double x, double y, double bend) {
    cell_of_.push_back(static_cast<std::uint32_t>(cell));
    axis_.push_back(x);
    axis_.push_back(y);
    curvature_.push_back(bend);
  };
  for (std::size_t i = 0; i < cells; ++i) {
    if (all_stick || !slips_[i]) add(i, 1.0, 0.0, 0.0);
  }
  const std::size_t stuck = cell_of_.size();
  for (std::size_t k = 0; k < stuck; ++k) add(cell_of_[k], 0.0, 1.0, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    if (all_stick || !slips_[i]) continue;
    const double x = trial_[i], y = trial_[cells + i], along = std::hypot(x, y);
    const double own = (compliance_[i][i] + compliance_[cells + i][cells + i]) / 2;
    add(i, -y / along, x / along, own * (along / radius_[i] - 1.0));
  }
  return stuck;
}

// Factor the system of a step.
bool PartialSlip::linearise(std::size_t stuck, WorkLimit& limit) {
  const std::size_t cells = cells_, count = cell_of_.size();
  factored_.clear();
  if (!limit.factorisation(count)) return false;
  factor_.resize(count, count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = cell_of_[k];
    const double x = axis_[2 * k], y = axis_[2 * k + 1];
    const double *along = compliance_[i], *across = compliance_[cells + i];
    double* row = factor_[k];
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
    row[k] += curvature_[k];
  }
  if (!factor(factor_)) return false;
  factored_.assign(cells, 0);
  if (stuck < cells) factored_ = slips_;
  return true;
}

bool PartialSlip::newton(bool known, WorkLimit& limit) {
  double before = INFINITY;
  for (int step = 0; step <= kSteps; ++step) {
    const double left = residual();
    if (!std::isfinite(left)) return false;
    const bool converged = left <= kConverged || (left <= kAlmost && left >= 0.5 * before);
    if (converged && (known || step > 0)) return true;
    const bool all_stick = !known && step == 0;
    const bool same_system = !all_stick && factored_ == slips_ && (step == 0 || left <= kStillGood * before);
    before = left;
    if (step == kSteps || !newton_step(all_stick, same_system, limit)) return false;
  }
  return false;
}

// The slower but more robust method. It follows the central path, on which the product of multiplier and slack is the
// same on all cells, inside all friction circles.
bool PartialSlip::interior_point(WorkLimit& limit) {
  factored_.clear();  // the factor is overwritten
  const std::size_t cells = cells_;
  double most = 1.0;
  for (const double one : free_slip_) most = std::max(most, std::abs(one));
  std::fill(motion_, motion_ + 3, 0.0);
  multiplier_.resize(cells);
  slack_.resize(cells);
  multiplier_change_.resize(cells);
  measure_slack();
  for (std::size_t i = 0; i < cells; ++i) multiplier_[i] = most * 0.5 * radius_[i] / slack_[i];
  PathState here;
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

PartialSlip::PathState PartialSlip::interior_residual() {
  const std::size_t cells = cells_;
  measure_slack();
  displace();
  PathState here;
  here.gap = here.error = 0.0;
  for (std::size_t i = 0; i < cells; ++i) {
    here.gap += multiplier_[i] * slack_[i] / static_cast<double>(cells);
    here.tightest = std::min(here.tightest, slack_[i]);
    // Gradient of the Lagrangian, in place of the displacement.
    displacement_[i] += multiplier_[i] * shear_[i];
    displacement_[cells + i] += multiplier_[i] * shear_[cells + i];
    here.error = std::max({here.error, std::abs(displacement_[i]), std::abs(displacement_[cells + i])});
  }
  missing(here.missing);
  for (const double one : here.missing) here.error = std::max(here.error, std::abs(one));
  return here;
}

// Newton's step towards a point of the central path with a smaller gap, shortened so that every cell stays inside its
// circle. False if its system cannot be solved.
bool PartialSlip::interior_step(const PathState& here) {
  const std::size_t cells = cells_, size = 2 * cells;
  const double target = (here.gap > 1e-6 ? 0.1 : 0.01) * here.gap;
  factor_.resize(size, size);
  right_.resize(4, size);
  for (std::size_t k = 0; k < size; ++k) std::copy(compliance_[k] + k, compliance_[k] + size, factor_[k] + k);
  for (std::size_t i = 0; i < cells; ++i) {
    const double x = shear_[i], y = shear_[cells + i], ratio = multiplier_[i] / slack_[i];
    const double push = (target - multiplier_[i] * slack_[i]) / slack_[i];
    factor_[i][i] += multiplier_[i] + ratio * x * x;
    factor_[cells + i][cells + i] += multiplier_[i] + ratio * y * y;
    factor_[i][cells + i] += ratio * x * y;
    multiplier_change_[i] = push;
    right_[0][i] = -displacement_[i] - x * push;
    right_[0][cells + i] = -displacement_[cells + i] - y * push;
  }
  for (std::size_t m = 0; m < 3; ++m) {
    std::copy(modes_.data() + m * size, modes_.data() + (m + 1) * size, right_[m + 1]);
  }
  if (!factor(factor_)) return false;
  const double moved[3] = {};
  double motion[3];
  solve_step(here.missing, moved, motion);
  const double* change = right_[0];
  const double share = share_inside(change);
  for (std::size_t k = 0; k < size; ++k) shear_[k] += share * change[k];
  for (std::size_t i = 0; i < cells; ++i) multiplier_[i] += share * multiplier_change_[i];
  for (std::size_t m = 0; m < 3; ++m) motion_[m] += share * motion[m];
  return true;
}

// The largest share of a step, up to 1, that leaves every cell inside its circle. It also adds the part of the
// multipliers' change that depends on the change of the shear.
double PartialSlip::share_inside(const double* change) {
  double share = 1.0;
  for (std::size_t i = 0; i < cells_; ++i) {
    const double x = shear_[i], y = shear_[cells_ + i], dx = change[i], dy = change[cells_ + i];
    const double a = dx * dx + dy * dy, b = x * dx + y * dy, c = -2.0 * slack_[i];
    if (a > 0.0) share = std::min(share, kStepShare * (-b + std::sqrt(std::max(b * b - a * c, 0.0))) / a);
    multiplier_change_[i] += multiplier_[i] / slack_[i] * b;
    if (multiplier_change_[i] < 0.0) share = std::min(share, kStepShare * multiplier_[i] / -multiplier_change_[i]);
  }
  return share;
}

// Distribute the error of the resultants over the cells in proportion to their slack. False if a cell is then outside
// its circle.
bool PartialSlip::balance() {
  const std::size_t cells = cells_, size = 2 * cells;
  for (int round = 0; round < 2; ++round) {
    double gram[9] = {}, left[3], motion[3];
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
    solve_semidefinite(3, gram, kOpen, left, motion);
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

// Set a start for Newton's method if nearly all cells slip. The body then moves far along one direction. Find the
// distance at which the cells carry the load, if each slips along its own displacement. On entry, `shear_` is that of
// full sliding.
void PartialSlip::start_near_sliding(const double* direction) {
  const std::size_t cells = cells_, size = 2 * cells;
  const double along[3] = {direction[0], direction[1], direction[2] * lever_unit_};
  // The rigid motion that fits the surface's displacement best.
  double gram[9], fit[3], rigid[3];
  std::fill(motion_, motion_ + 3, 0.0);
  displace();
  for (std::size_t m = 0; m < 3; ++m) {
    fit[m] = dot(modes_.data() + m * size, displacement_.data(), size);
    for (std::size_t n = 0; n < 3; ++n) gram[3 * m + n] = dot(modes_.data() + m * size, modes_.data() + n * size, size);
  }
  solve_semidefinite(3, gram, kOpen, fit, rigid);
  double aim = 0.0;
  for (std::size_t m = 0; m < 3; ++m) aim += wanted_[m] * along[m];
  double low = kShortest, high = kFarthest;
  for (int halving = 0; halving < kHalvings; ++halving) {
    const double far = std::sqrt(low * high);
    for (std::size_t m = 0; m < 3; ++m) motion_[m] = rigid[m] + far * along[m];
    double work = 0.0;
    for (std::size_t i = 0; i < cells; ++i) {
      double push[2] = {-displacement_[i], -displacement_[cells + i]}, go[2] = {};
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

bool PartialSlip::slides(const ShearGrip& grip, const double* wanted, double friction, double* shear) {
  share_ = grip.sliding_with(wanted, friction, shear, direction_);
  return slid();
}

bool PartialSlip::slid() const { return share_ >= kSlides; }

bool PartialSlip::solve(const SlipProblem& problem, double friction, bool known, WorkLimit& limit, double* shear) {
  const ShearGrip& grip = problem.grip;
  const std::size_t cells = grip.count(), size = 2 * cells;
  const double before = compliance_unit_ * force_unit_;
  scale(problem, friction * grip.pressing() / static_cast<double>(cells), known);
  radius_.resize(cells);
  for (std::size_t i = 0; i < cells; ++i) radius_[i] = friction * grip.normal(i) / force_unit_;
  shear_.resize(size);
  const auto take = [&] {
    for (std::size_t k = 0; k < size; ++k) shear[k] = shear_[k] * force_unit_;
    return true;
  };
  if (known) {
    for (std::size_t k = 0; k < size; ++k) shear_[k] = shear[k] / force_unit_;
    for (double& one : motion_) one *= before / (compliance_unit_ * force_unit_);
    if (newton(true, limit)) return take();
    if (slides(grip, problem.wanted, friction, shear)) return true;
  }
  for (int trial = 0; trial < 2; ++trial) {
    // Start from sticking cells or from slipping ones, the likelier first.
    const bool sliding = (trial == 0) == (share_ > kRatherSlides);
    if (sliding && !(share_ > kMaySlide)) continue;
    if (sliding) {
      for (std::size_t k = 0; k < size; ++k) shear_[k] = shear[k] / force_unit_;
      start_near_sliding(direction_);
    } else {
      std::fill(shear_.begin(), shear_.end(), 0.0);
      std::fill(motion_, motion_ + 3, 0.0);
    }
    if (newton(sliding, limit)) return take();
  }
  std::fill(shear_.begin(), shear_.end(), 0.0);
  if (interior_point(limit)) {
    // Newton's method improves the result. The shear is kept in case that it fails.
    interior_shear_ = shear_;
    if (newton(true, limit)) return take();
    shear_ = interior_shear_;
    if (balance()) return take();
  }
  // If only few cells stick, full sliding is close to the solution.
  return share_ >= kNearlySlides;
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
    shear[k] = shear_[k] * force_unit_;
  }
  return true;
}

}  // namespace mjtactile
