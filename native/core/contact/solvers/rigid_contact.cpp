#include "contact/solvers/rigid_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "contact/solvers/bearing.hpp"
#include "contact/solvers/height_order.hpp"
#include "linalg/kernels.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Pulling forces and overlaps below this fraction of the largest force and separation are ignored.
constexpr double kTolerance = 1e-11;
constexpr double kBalanced = 1e-9;
// Largest number of exchanges. After kPatience of them that do not reduce the number of violated cells, single cells
// are exchanged.
constexpr std::size_t kExchanges = 24, kPatience = 3;
// Largest numbers of steps of the final descent, and with bounded forces: of rounds in which cells are exchanged, which
// seldom succeed later, and of steps. They bound the time.
constexpr std::size_t kDescents = 20, kBounded = 10, kBoundedDescents = 200;
// In a descent, cells change sides together if their violation is at least this fraction of the largest.
constexpr double kGoOver = 0.5;
// Largest work of one contact, counted as cubes of factored sizes: this much, or so many factorisations of all cells.
constexpr double kMostWork = 5e6, kMostFactors = 8.0;
// If more than this fraction of the cells is violated by the first guess, the search begins again from springs: without
// bounds on the forces, and with them.
constexpr double kFarOff = 0.2, kFarOffBounded = 0.1;
// Stiffness of the springs that start the search, over that of single cells.
constexpr double kSprings = 0.2;
// Least compliance of a spring over the largest. Under some layers a cell's own compliance is zero or negative.
constexpr double kStiffest = 1e-3;
// Motions may be open if the least pivot of the stiffness is below the fraction kOpen of the largest entry. A motion is
// open if its stiffness is below the fraction kOpenMotion of the largest. It is loaded if the load along it exceeds the
// fraction kLoaded of the resultants.
constexpr double kOpen = 1e-10, kOpenMotion = 1e-12, kLoaded = 1e-11;

// Each time the number of violated cells does not decrease, the fraction of the largest violation from which on cells
// change sides moves this far towards 1.
constexpr double kStricter = 1.0 / 3.0;
// State to which a cell changes in an exchange with bounded forces.
constexpr std::uint8_t kStays = 0, kIsFree = 1, kPresses = 2, kIsFull = 3;

double along(const double* map, const double* resultants, std::size_t motions) {
  double value = map[motions];
  for (std::size_t m = 0; m < motions; ++m) value += map[m] * resultants[m];
  return value;
}

}  // namespace

bool RigidContact::solve(const RigidProblem& problem, const std::uint8_t* start) {
  const std::size_t cells = problem.cells();
  // Under a flat face springs are no better guess.
  const std::size_t far_off =
      problem.heights == nullptr ? cells : static_cast<std::size_t>(kFarOff * static_cast<double>(cells));
  if ((start != nullptr || problem.heights == nullptr) && exchange_from(problem, start, far_off)) return true;
  set_springs(problem);
  const bool balanced =
      springs_.solve(stiffnesses_, problem.modes, problem.motions, problem.heights, problem.resultants);
  if (exchange(problem, springs_.pressed().data())) return true;
  return balanced && descend(problem) && balances(problem);
}

void RigidContact::set_springs(const RigidProblem& problem) {
  const Matrix& compliance = *problem.compliance;
  double largest = std::numeric_limits<double>::min();
  for (std::size_t i = 0; i < problem.cells(); ++i) largest = std::max(largest, compliance[i][i]);
  stiffnesses_.resize(problem.cells());
  for (std::size_t i = 0; i < stiffnesses_.size(); ++i) {
    stiffnesses_[i] = kSprings / std::max(compliance[i][i], kStiffest * largest);
  }
}

// Block principal pivoting (Portugal, Judice, Vicente, Mathematics of Computation 63, 1994). All cells that violate
// their conditions change sides as long as that reduces their number. If it has not for some exchanges, only the last
// violated cell changes sides. False if the first solution has more than `far_off` violated cells, or none is found.
bool RigidContact::exchange_from(const RigidProblem& problem, const std::uint8_t* start, std::size_t far_off) {
  const std::size_t cells = problem.cells();
  pressed_.assign(cells, 1);
  if (start != nullptr) pressed_.assign(start, start + cells);
  std::size_t fewest = cells + 1, patience = kPatience;
  for (std::size_t trial = 0; trial < kExchanges; ++trial) {
    if (!solve_pressed(problem)) return false;
    const std::size_t wrong = violated(exchange_);
    if (wrong == 0) return balances(problem);
    if (trial == 0 && wrong > far_off) return false;
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

// Whether the forces have the wanted resultants up to rounding.
bool RigidContact::balances(const RigidProblem& problem) const {
  double left = 0.0, size = 0.0;
  for (std::size_t m = 0; m < motions_; ++m) {
    double sum = -problem.resultants[m];
    for (std::size_t i = 0; i < cells(); ++i) sum += problem.modes[i * motions_ + m] * forces_[i];
    left = std::max(left, std::abs(sum));
    size = std::max(size, std::abs(problem.resultants[m]));
  }
  return left <= kBalanced * size;
}

// Primal active-set method, started from the springs' forces, which carry the resultants. The energy decreases in every
// step, so that it cannot cycle.
bool RigidContact::descend(const RigidProblem& problem) {
  reached_ = springs_.forces();
  for (std::size_t i = 0; i < cells(); ++i) pressed_[i] = reached_[i] > 0.0 ? 1 : 0;
  for (std::size_t trial = 0; trial < std::min(cells(), kDescents); ++trial) {
    if (!solve_pressed(problem)) return false;
    double largest = 0.0, length = 1.0;
    for (const double force : forces_) largest = std::max(largest, std::abs(force));
    // Move towards the solution on these cells until one of them would pull.
    for (std::size_t i = 0; i < cells(); ++i) {
      const double wanted = forces_[i];
      if (pressed_[i] && wanted < -kTolerance * largest) {
        length = std::min(length, reached_[i] / (reached_[i] - wanted));
      }
    }
    double most = 0.0;
    for (std::size_t i = 0; i < cells(); ++i) {
      reached_[i] = std::max(reached_[i] + length * (forces_[i] - reached_[i]), 0.0);
      most = std::max(most, reached_[i]);
    }
    if (length < 1.0) {
      for (std::size_t i = 0; i < cells(); ++i) {
        if (pressed_[i] && reached_[i] <= kTolerance * most) pressed_[i] = 0, reached_[i] = 0.0;
      }
      continue;
    }
    if (violated(exchange_) == 0) return true;
    std::size_t worst = cells();
    double deepest = 0.0;
    for (std::size_t i = 0; i < cells(); ++i) {
      if (exchange_[i] && !pressed_[i] && separation_[i] < deepest) deepest = separation_[i], worst = i;
    }
    if (worst == cells()) return false;
    pressed_[worst] = 1;
  }
  return false;
}

bool RigidContact::solve_bounded(const RigidProblem& problem, const double* most,
                                 const std::vector<std::uint8_t>& start) {
  const std::size_t cells = problem.cells();
  carries_ = true;
  pressed_ = start;
  full_.assign(cells, 0);
  double nearer[kMostMotions];
  moved_ = bring_within_bearing(problem, most, nearer);
  const auto far_off = static_cast<std::size_t>(kFarOffBounded * static_cast<double>(cells));
  if (!moved_ && exchange_bounded(problem, most, far_off)) return true;
  // The yielding springs give a first guess of the cells at their limit, which are called full.
  set_springs(problem);
  carries_ = springs_.solve(stiffnesses_, problem.modes, problem.motions, problem.heights, nearer, most);
  const RigidProblem moved = {problem.compliance, problem.modes, problem.motions, problem.heights, nearer};
  start_from_springs(most);
  if (carries_ && exchange_bounded(moved, most, cells)) return true;
  start_from_springs(most);
  if (carries_ && descend_bounded(moved, most)) return true;
  if (!carries_) forces_ = springs_.forces(), pressed_ = springs_.pressed();
  return false;
}

void RigidContact::start_from_springs(const double* most) {
  reached_ = springs_.forces();
  for (std::size_t i = 0; i < reached_.size(); ++i) {
    full_[i] = reached_[i] >= most[i] ? 1 : 0;
    pressed_[i] = springs_.pressed()[i] && !full_[i] ? 1 : 0;
  }
}

// False if the first solution has more than `far_off` violated cells, or none is found; see exchange_from().
bool RigidContact::exchange_bounded(const RigidProblem& problem, const double* most, std::size_t far_off) {
  std::size_t fewest = cells() + 1;
  double share = 0.0;
  for (std::size_t round = 0; round < kBounded; ++round) {
    if (!on_free(problem, most)) return false;
    const std::size_t wrong = find_violated(problem, most);
    if (wrong == 0) return fill_up(problem, most);
    if (round == 0 && wrong > far_off) return false;
    // All violated cells change sides as long as that reduces their number. Otherwise the body tilted too far, and
    // cells with small violations should not have changed. Then only those with the largest violations change sides,
    // fewer each time.
    share = wrong < fewest ? share / 2 : share + (1.0 - share) * kStricter;
    fewest = std::min(fewest, wrong);
    change_sides(share);
  }
  return false;
}

// Primal active-set method, started from the forces of yielding springs; see descend().
bool RigidContact::descend_bounded(const RigidProblem& problem, const double* most) {
  double share = kGoOver;
  for (std::size_t trial = 0; trial < kBoundedDescents && on_free(problem, most); ++trial) {
    const double length = step_within(most);
    if (length < 1.0) {
      // Cells that changed sides together may block each other. Then they change one by one.
      if (length < kTolerance) share = 1.0;
      continue;
    }
    if (find_violated(problem, most) == 0) {
      if (fill_up(problem, most)) return true;
      break;
    }
    change_sides(share);
  }
  forces_.resize(cells());
  // Rounding errors of the steps accumulate. Scale the forces so that they carry the load.
  const double drift = problem.resultants[0] / std::accumulate(reached_.begin(), reached_.end(), 0.0);
  for (std::size_t i = 0; i < cells(); ++i) {
    forces_[i] = drift * reached_[i];
    pressed_[i] = reached_[i] > 0.0 ? 1 : 0;
  }
  return false;
}

// Move the forces towards the last solution until a cell would pull or exceed its limit. These cells become free or
// full. Returns the fraction of the way.
double RigidContact::step_within(const double* most) {
  double length = 1.0;
  const auto pulls = [&](std::size_t i) { return forces_[i] < -kTolerance * most[i]; };
  const auto exceeds = [&](std::size_t i) { return forces_[i] > most[i] * (1.0 + kTolerance); };
  for (std::size_t i = 0; i < cells(); ++i) {
    if (!pressed_[i]) continue;
    if (pulls(i)) length = std::min(length, reached_[i] / (reached_[i] - forces_[i]));
    if (exceeds(i)) length = std::min(length, (most[i] - reached_[i]) / (forces_[i] - reached_[i]));
  }
  for (std::size_t i = 0; i < cells(); ++i) {
    if (!pressed_[i]) continue;
    reached_[i] = std::min(std::max(reached_[i] + length * (forces_[i] - reached_[i]), 0.0), most[i]);
    if (pulls(i) && reached_[i] <= kTolerance * most[i]) pressed_[i] = 0, reached_[i] = 0.0;
    if (exceeds(i) && reached_[i] >= most[i] * (1.0 - kTolerance)) pressed_[i] = 0, full_[i] = 1, reached_[i] = most[i];
  }
  return length;
}

// Solve for the forces if full cells bear their limit and exactly the pressed ones carry the rest of the load.
bool RigidContact::on_free(const RigidProblem& problem, const double* most) {
  const Matrix& compliance = *problem.compliance;
  const std::size_t motions = problem.motions;
  double left[kMostMotions];
  std::copy(problem.resultants, problem.resultants + motions, left);
  pushed_.assign(compliance.stride(), 0.0);
  for (std::size_t i = 0; i < cells(); ++i) pushed_[i] = problem.height(i);
  borne_.assign(cells(), 0.0);
  for (std::size_t j = 0; j < cells(); ++j) {
    if (!full_[j]) continue;
    borne_[j] = most[j];
    for (std::size_t m = 0; m < motions; ++m) left[m] -= most[j] * problem.modes[j * motions + m];
  }
  // Full cells lower the surface under the others.
  kernels().multiply_add(borne_.data(), 0, 1, compliance.data(), compliance.stride(), pushed_.data(),
                         compliance.stride(), 1, compliance.stride(), compliance.rows());
  pushed_.resize(cells());
  return solve_pressed({&compliance, problem.modes, motions, pushed_.data(), left});
}

// Set the forces on full cells to their limits. False if all forces together do not carry the load.
bool RigidContact::fill_up(const RigidProblem& problem, const double* most) {
  for (std::size_t i = 0; i < cells(); ++i) {
    if (full_[i]) forces_[i] = most[i], pressed_[i] = 1;
  }
  return balances(problem);
}

// Find the cells that violate their conditions: pressed ones that pull or exceed their limit, free ones that overlap,
// full ones that push the surface deeper than the body is. Violations are relative to the cell's limit. Returns their
// number.
std::size_t RigidContact::find_violated(const RigidProblem& problem, const double* most) {
  const Matrix& compliance = *problem.compliance;
  double scale = std::abs(motion_[0]);
  for (const double pushed : pushed_) scale = std::max(scale, std::abs(pushed));
  exchange_.assign(cells(), kStays);
  excess_.assign(cells(), 0.0);
  for (std::size_t i = 0; i < cells(); ++i) {
    const double deep = std::max(compliance[i][i] * most[i], std::numeric_limits<double>::min());
    if (full_[i]) {
      // The surface under a full cell is not deeper than the body, unless its force is too large.
      if (separation_[i] > kTolerance * scale) exchange_[i] = kPresses, excess_[i] = separation_[i] / deep;
    } else if (pressed_[i]) {
      if (forces_[i] > most[i] * (1.0 + kTolerance)) exchange_[i] = kIsFull, excess_[i] = forces_[i] / most[i] - 1.0;
      if (forces_[i] < -kTolerance * most[i]) exchange_[i] = kIsFree, excess_[i] = -forces_[i] / most[i];
    } else if (separation_[i] < -kTolerance * scale) {
      exchange_[i] = kPresses, excess_[i] = -separation_[i] / deep;
    }
  }
  return cells() - static_cast<std::size_t>(std::count(exchange_.begin(), exchange_.end(), kStays));
}

// Cells whose violation is at least this fraction of the largest change sides.
void RigidContact::change_sides(double share) {
  const double least = share * *std::max_element(excess_.begin(), excess_.end());
  for (std::size_t i = 0; i < cells(); ++i) {
    if (exchange_[i] == kStays || excess_[i] < least) continue;
    pressed_[i] = exchange_[i] == kPresses ? 1 : 0;
    full_[i] = exchange_[i] == kIsFull ? 1 : 0;
  }
}

// Solve for the forces, motion and separation if exactly the pressed cells are in contact. False if these cells cannot
// carry the resultants.
bool RigidContact::solve_pressed(const RigidProblem& problem) {
  const std::size_t motions = problem.motions;
  motions_ = motions;
  if (!factor_pressed(problem)) return false;
  const std::size_t count = places_.size();
  column_.assign(Matrix::padded(count), 0.0);
  std::fill(pressed_heights_, pressed_heights_ + kMostMotions, 0.0);
  if (problem.heights != nullptr) {
    heights_.resize(1, count);
    for (std::size_t a = 0; a < count; ++a) heights_[0][a] = problem.heights[places_[a]];
    factor_.solve_forward(heights_);
    for (std::size_t m = 0; m < motions; ++m) pressed_heights_[m] = dot(modes_[m], heights_[0], count);
    for (std::size_t a = 0; a < count; ++a) column_[a] = -heights_[0][a];
  }
  // With S = B^T A^-1 B the motion is d = S^-1 (q + B^T A^-1 g), and the forces are A^-1 (B d - g).
  double wanted[kMostMotions] = {};
  for (std::size_t m = 0; m < motions; ++m) wanted[m] = problem.resultants[m] + pressed_heights_[m];
  invert_stiffness(wanted);
  std::fill(motion_, motion_ + kMostMotions, 0.0);
  add_motion(wanted);
  // Cells nearly in a row hardly determine a tilt. Then the inverse is inexact, and the forces miss the resultants.
  for (std::size_t m = 0; m < motions; ++m) wanted[m] = problem.resultants[m] - dot(modes_[m], column_.data(), count);
  add_motion(wanted);
  factor_.solve_backward(column_.data());
  forces_.assign(problem.cells(), 0.0);
  for (std::size_t a = 0; a < count; ++a) forces_[places_[a]] = column_[a];
  separation_.assign(problem.compliance->stride(), 0.0);
  if (count < problem.cells()) {
    separate(problem, forces_.data(), motion_, separation_.data());
    if (problem.heights != nullptr) {
      for (std::size_t i = 0; i < problem.cells(); ++i) separation_[i] += problem.heights[i];
    }
  }
  return true;
}

// Add the motion under these resultants, and the forces with it.
void RigidContact::add_motion(const double* resultants) {
  for (std::size_t m = 0; m < motions_; ++m) {
    double added = 0.0;
    for (std::size_t n = 0; n < motions_; ++n) added += flexibility_[m][n] * resultants[n];
    motion_[m] += added;
    for (std::size_t a = 0; a < places_.size(); ++a) column_[a] += added * modes_[m][a];
  }
}

// Factor the pressed cells' compliance, and compute what does not depend on the heights, unless both are known.
bool RigidContact::factor_pressed(const RigidProblem& problem) {
  const std::size_t motions = problem.motions;
  if (order_.size() != problem.cells()) order_by_height(problem.heights, problem.cells(), order_);
  places_.clear();
  for (const std::size_t i : order_) {
    if (pressed_[i]) places_.push_back(i);
  }
  const std::size_t count = places_.size();
  if (count == 0) return false;
  if (factor_.is_of(places_)) return true;
  const auto size = static_cast<double>(count), known = static_cast<double>(factor_.known(places_));
  work_ += size * size * size - known * known * known;
  if (work_ > kMostWork + kMostFactors * std::pow(static_cast<double>(pressed_.size()), 3)) return false;
  if (!factor_.factor(*problem.compliance, places_)) return definite_ = false;
  modes_.resize(motions, count);
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t m = 0; m < motions; ++m) modes_[m][a] = problem.modes[places_[a] * motions + m];
  }
  factor_.solve_forward(modes_);
  for (std::size_t m = 0; m < motions; ++m) {
    for (std::size_t n = 0; n < motions; ++n) stiffness_[m][n] = dot(modes_[m], modes_[n], count);
  }
  return true;
}

// Invert the stiffness against the body's motions. If the pressed cells leave a tilt open, such as cells in one row,
// the wanted resultants decide whether the body moves along it.
void RigidContact::invert_stiffness(const double* wanted) {
  const std::size_t motions = motions_;
  double matrix[kMostMotions * kMostMotions], inverse[kMostMotions * kMostMotions];
  for (std::size_t m = 0; m < motions; ++m) {
    for (std::size_t n = 0; n < motions; ++n) {
      matrix[m * motions + n] = stiffness_[m][n];
      flexibility_[m][n] = m == n ? 1.0 : 0.0;
    }
  }
  if (solve_small(motions, matrix, &flexibility_[0][0], kMostMotions, kOpen)) return;
  const MotionStiffness stiffness(motions, matrix);
  Openness openness = {kOpenMotion * std::max(stiffness.largest(), std::numeric_limits<double>::min()), 0.0};
  for (std::size_t m = 0; m < motions; ++m) openness.loaded = std::max(openness.loaded, kLoaded * std::abs(wanted[m]));
  stiffness.invert(wanted, openness, inverse);
  for (std::size_t m = 0; m < motions; ++m) {
    for (std::size_t n = 0; n < motions; ++n) flexibility_[m][n] = inverse[m * motions + n];
  }
}

// Separation of surface and body under forces and a motion, (padded cells) [m]; 0 under pressed cells.
void RigidContact::separate(const RigidProblem& problem, const double* forces, const double* motion,
                            double* separation) const {
  const Matrix& compliance = *problem.compliance;
  kernels().multiply_add(forces, 0, 1, compliance.data(), compliance.stride(), separation, compliance.stride(), 1,
                         compliance.stride(), compliance.rows());
  for (std::size_t i = 0; i < compliance.rows(); ++i) {
    for (std::size_t m = 0; m < motions_; ++m) separation[i] -= problem.modes[i * motions_ + m] * motion[m];
  }
}

void RigidContact::make_maps(const RigidProblem& problem) {
  const std::size_t cells = problem.cells(), motions = motions_, entries = motions + 1, count = places_.size();
  map_motion_.resize(motions, entries);
  map_forces_.resize(cells, entries);
  map_separation_.resize(cells, entries);
  std::vector<double> forces(cells), apart(problem.compliance->stride());
  for (std::size_t n = 0; n < entries; ++n) {
    const bool constant = n == motions;
    double motion[kMostMotions];
    for (std::size_t m = 0; m < motions; ++m) {
      motion[m] = 0.0;
      for (std::size_t k = 0; k < motions; ++k) {
        motion[m] += flexibility_[m][k] * (constant ? pressed_heights_[k] : k == n ? 1.0 : 0.0);
      }
      map_motion_[m][n] = motion[m];
    }
    for (std::size_t a = 0; a < count; ++a) {
      column_[a] = constant && problem.heights != nullptr ? -heights_[0][a] : 0.0;
      for (std::size_t m = 0; m < motions; ++m) column_[a] += motion[m] * modes_[m][a];
    }
    factor_.solve_backward(column_.data());
    std::fill(forces.begin(), forces.end(), 0.0);
    for (std::size_t a = 0; a < count; ++a) forces[places_[a]] = column_[a];
    std::fill(apart.begin(), apart.end(), 0.0);
    separate(problem, forces.data(), motion, apart.data());
    for (std::size_t i = 0; i < cells; ++i) {
      map_forces_[i][n] = forces[i];
      map_separation_[i][n] = pressed_[i] ? 0.0 : apart[i] + (constant ? problem.height(i) : 0.0);
    }
  }
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

// Find the pressed cells that pull and the free cells that overlap. Returns their number.
std::size_t RigidContact::violated(std::vector<std::uint8_t>& violated) const {
  violated.assign(cells(), 0);
  double largest = 0.0, scale = std::abs(motion_[0]);
  for (std::size_t i = 0; i < cells(); ++i) {
    if (pressed_[i]) {
      largest = std::max(largest, std::abs(forces_[i]));
    } else {
      scale = std::max(scale, std::abs(separation_[i]));
    }
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells(); ++i) {
    const bool wrong = pressed_[i] ? forces_[i] < -kTolerance * largest : separation_[i] < -kTolerance * scale;
    violated[i] = wrong ? 1 : 0;
    count += wrong;
  }
  return count;
}

}  // namespace mjtactile
