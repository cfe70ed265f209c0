#include "contact/laws/friction.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Rounds of pressing and shear, the change of forces at which they agree, over the force, and
// one that serves where a cell on the verge keeps them apart or the work is spent.
constexpr int kRounds = 40;
constexpr double kAgreed = 1e-10, kSufficient = 1e-4;
// What the shear of a round may be off, over the change of the round before and at most; at the last next to nothing.
constexpr double kSettled = 1e-2, kLoose = 1e-2, kTight = 1e-11;
// Rounds after which what the shear lifts is changed by a part only, and that part.
constexpr int kUndamped = 12;
constexpr double kDamping = 0.3;
// Multiplications that one contact may spend on factorisations, some milliseconds, and on shear for the last pressure;
// factorisations that a round of pressing and shear may take.
constexpr double kWork = 2e7, kLastWork = 5e6, kReserve = 2.0;

bool finite(const double* numbers, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(numbers[i])) return false;
  }
  return true;
}

}  // namespace

ShearOutcome SurfaceShear::solve(const PressedCells& cells, const Matrix* compliance, const double* wrench,
                                 Tangential tangential, double friction, double* forces) {
  limit_.allow(patience_ * kWork);
  double pressing = 0.0;
  for (std::size_t i = 0; i < cells.count; ++i) pressing += std::max(cells.pressing[i], 0.0);
  if (!(pressing > 0.0) || !finite(wrench, 6) || !finite(cells.pressing, cells.count)) {
    std::fill(forces, forces + 3 * cells.count, 0.0);
    ShearOutcome refused;
    refused.refused = true;
    return refused;
  }
  reached_.clear();
  for (std::size_t i = 0; i < cells.count; ++i) {
    if (cells.heights == nullptr || std::isfinite(cells.heights[i])) reached_.push_back(i);
  }
  gathered_.clear();
  ShearOutcome outcome;
  if (tangential == Tangential::proportional) {
    outcome = proportional(cells, wrench, friction, forces);
  } else if (tangential == Tangential::stick) {
    outcome = stick(cells, *compliance, wrench, friction, forces);
  } else {
    outcome = coulomb(cells, *compliance, wrench, friction, forces);
  }
  if (!finite(forces, 3 * cells.count)) {
    outcome = proportional(cells, wrench, friction, forces);
    outcome.simplified = true;
  }
  return outcome;
}

// Hold on to the cells under pressure.
void SurfaceShear::hold(const PressedCells& cells, const double* normal) {
  held_.clear();
  for (std::size_t i = 0; i < cells.count; ++i) {
    if (normal[i] > 0.0) held_.push_back(i);
  }
  grip_.hold(cells.points, normal, held_.data(), held_.size(), cells.length);
  shear_.resize(2 * held_.size());
}

void SurfaceShear::write(const PressedCells& cells, const double* normal, const double* shear, double* forces) const {
  for (std::size_t i = 0; i < cells.count; ++i) {
    forces[3 * i] = forces[3 * i + 1] = 0.0;
    forces[3 * i + 2] = -normal[i];
  }
  for (std::size_t i = 0; i < held_.size(); ++i) {
    forces[3 * held_[i]] = shear[i];
    forces[3 * held_[i] + 1] = shear[held_.size() + i];
  }
}

ShearOutcome SurfaceShear::proportional(const PressedCells& cells, const double* wrench, double friction,
                                        double* forces) {
  ShearOutcome outcome;
  hold(cells, cells.pressing);
  double wanted[3];
  grip_.about_centre(wrench, wrench[5], wanted);
  if (friction >= 0.0) outcome.slides = grip_.nearest(wanted, friction, shear_.data());
  if (!outcome.slides) grip_.proportional(wanted, shear_.data());
  write(cells, cells.pressing, shear_.data(), forces);
  return outcome;
}

ShearOutcome SurfaceShear::stick(const PressedCells& cells, const Matrix& compliance, const double* wrench,
                                 double friction, double* forces) {
  ShearOutcome outcome;
  outcome.simplified = !bonded(cells, compliance, wrench, forces);
  double share = outcome.simplified ? 0.0 : 1.0;
  for (std::size_t i = 0; i < cells.count && share > 0.0; ++i) {
    share = std::min(share, share_borne(cells, i, -forces[3 * i + 2]));
  }
  if (share < 1.0) {
    coupled_.assign(forces, forces + 3 * cells.count);
    if (!bonded_as_pressed(cells, compliance, wrench, forces)) {
      outcome = proportional(cells, wrench, friction, forces);
      outcome.simplified = true;
      return outcome;
    }
    if (share > 0.0) {
      for (std::size_t k = 0; k < 3 * cells.count; ++k) forces[k] += share * (coupled_[k] - forces[k]);
    }
  }
  if (friction < 0.0 || holds(cells, wrench, friction, forces)) return outcome;
  return proportional(cells, wrench, friction, forces);
}

// How far a cell's force may go from that without friction to the one that shear couples it to, 1 for all the way.
double SurfaceShear::share_borne(const PressedCells& cells, std::size_t cell, double coupled) const {
  if (cells.most == nullptr || coupled <= cells.most[cell]) return 1.0;
  return std::max(cells.most[cell] - cells.pressing[cell], 0.0) / (coupled - cells.pressing[cell]);
}

// Whether friction holds a wrench's shear and torsion under the pressure of these forces.
bool SurfaceShear::holds(const PressedCells& cells, const double* wrench, double friction, const double* forces) {
  normal_.resize(cells.count);
  for (std::size_t i = 0; i < cells.count; ++i) normal_[i] = -forces[3 * i + 2];
  hold(cells, normal_.data());
  double wanted[3];
  grip_.about_centre(wrench, wrench[5], wanted);
  return !grip_.nearest(wanted, friction, shear_.data());
}

bool SurfaceShear::bonded(const PressedCells& cells, const Matrix& compliance, const double* wrench, double* forces) {
  const std::size_t count = reached_.size();
  levers_.resize(count);
  heights_.resize(count);
  start_.resize(count);
  double wanted[6] = {};
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t place = reached_[i];
    const double pressing = cells.pressing[place];
    levers_[i] = {(cells.points[place].x - cells.middle.x) / cells.length,
                  (cells.points[place].y - cells.middle.y) / cells.length};
    if (cells.heights != nullptr) heights_[i] = cells.heights[place];
    start_[i] = pressing > 0.0 ? 1 : 0;
    wanted[0] += pressing;
    wanted[1] += pressing * levers_[i].x;
    wanted[2] += pressing * levers_[i].y;
  }
  wanted[3] = wrench[0];
  wanted[4] = wrench[1];
  wanted[5] = (wrench[5] - (cells.middle.x * wrench[1] - cells.middle.y * wrench[0])) / cells.length;
  if (!bonded_.solve(compliance, cells.count, reached_, levers_.data(),
                     cells.heights == nullptr ? nullptr : heights_.data(), wanted, cells.tilting, start_.data(),
                     limit_)) {
    return false;
  }
  std::fill(forces, forces + 3 * cells.count, 0.0);
  const double* found = bonded_.forces().data();
  for (std::size_t i = 0; i < count; ++i) {
    double* force = forces + 3 * reached_[i];
    force[0] = found[i], force[1] = found[count + i], force[2] = -found[2 * count + i];
  }
  return true;
}

// Displacement along the surface of the cells held that the pressing alone brings, and their compliance there.
void SurfaceShear::displace(const PressedCells& cells, const Matrix& compliance, const double* normal) {
  const std::size_t held = held_.size(), count = cells.count;
  slipped_.resize(2 * held);
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t i = 0; i < held; ++i) {
      const double* row = compliance[a * count + held_[i]] + 2 * count;
      double sum = 0.0;
      for (std::size_t j = 0; j < held; ++j) sum -= row[held_[j]] * normal[held_[j]];
      slipped_[a * held + i] = sum;
    }
  }
  if (gathered_ == held_) return;
  gathered_ = held_;
  tangential_.resize(2 * held, 2 * held);
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t i = 0; i < held; ++i) {
      const double* from = compliance[a * count + held_[i]];
      double* to = tangential_[a * held + i];
      for (std::size_t j = 0; j < held; ++j) to[j] = from[held_[j]], to[held + j] = from[count + held_[j]];
    }
  }
}

// Shear of cells that all stick, on what is pressed without it.
bool SurfaceShear::bonded_as_pressed(const PressedCells& cells, const Matrix& compliance, const double* wrench,
                                     double* forces) {
  hold(cells, cells.pressing);
  displace(cells, compliance, cells.pressing);
  double wanted[3];
  grip_.about_centre(wrench, wrench[5], wanted);
  limit_.allow(patience_ * kWork);  // once more: it takes one factorisation
  if (!slip_.bonded(tangential_, grip_, slipped_.data(), wanted, limit_, shear_.data())) return false;
  write(cells, cells.pressing, shear_.data(), forces);
  return true;
}

// Shear under the pressure `normal_`; false where it slides in proportion for want of anything better.
bool SurfaceShear::slipping(const PressedCells& cells, const Matrix& compliance, const double* wrench, double friction,
                            bool known, double tolerance, bool& slides) {
  double wanted[3];
  grip_.about_centre(wrench, wrench[5], wanted);
  spread_.resize(shear_.size());
  slides = grip_.nearest(wanted, friction, spread_.data());
  if (slides || !(friction > 0.0)) {
    if (slides) {
      shear_ = spread_;
    } else {
      std::fill(shear_.begin(), shear_.end(), 0.0);
    }
    return true;
  }
  displace(cells, compliance, normal_.data());
  if (slip_.solve(tangential_, grip_, slipped_.data(), wanted, friction, known, tolerance, limit_,
                  shear_.data())) {
    return true;
  }
  double direction[3];
  grip_.sliding_with(wanted, friction, shear_.data(), direction);
  return false;
}

ShearOutcome SurfaceShear::coulomb(const PressedCells& cells, const Matrix& compliance, const double* wrench,
                                   double friction, double* forces) {
  const std::size_t count = cells.count, reached = reached_.size(), motions = cells.tilting ? 3 : 1;
  contact_.forget();
  contact_.allow();
  pressed_.resize(reached, reached);
  modes_.resize(reached * motions);
  gaps_.assign(reached, 0.0);
  heights_.resize(reached);
  start_.resize(reached);
  double lowest = 0.0, resultants[3] = {}, total = 0.0;
  if (cells.heights != nullptr) {
    lowest = cells.heights[reached_[0]];
    for (const std::size_t place : reached_) lowest = std::min(lowest, cells.heights[place]);
  }
  for (std::size_t i = 0; i < reached; ++i) {
    const std::size_t place = reached_[i];
    const double* from = compliance[2 * count + place] + 2 * count;
    for (std::size_t j = 0; j < reached; ++j) pressed_[i][j] = from[reached_[j]];
    if (cells.heights != nullptr) gaps_[i] = cells.heights[place] - lowest;
    double* modes = modes_.data() + i * motions;
    modes[0] = 1.0;
    if (cells.tilting) {
      modes[1] = (cells.points[place].x - cells.middle.x) / cells.length;
      modes[2] = (cells.points[place].y - cells.middle.y) / cells.length;
    }
    for (std::size_t m = 0; m < motions; ++m) resultants[m] += modes[m] * cells.pressing[place];
    total += cells.pressing[place];
  }
  normal_.assign(cells.pressing, cells.pressing + count);
  found_.assign(2 * count, 0.0);
  lifted_.assign(reached, 0.0);
  ShearOutcome outcome;
  bool agreed = false, settled = true;
  double change = total, tolerance = kLoose;
  held_.clear();
  for (int round = 0; round < kRounds && settled && !agreed; ++round) {
    double changed = 0.0;
    if (round > 0) {
      if (!limit_.leaves(2 * held_.size(), kReserve)) break;
      const double share = round <= kUndamped ? 1.0 : kDamping;
      for (std::size_t i = 0; i < reached; ++i) {
        const double* row = compliance[2 * count + reached_[i]];
        double sum = 0.0;
        for (std::size_t j = 0; j < held_.size(); ++j) {
          sum += row[held_[j]] * shear_[j] + row[count + held_[j]] * shear_[held_.size() + j];
        }
        lifted_[i] = (1.0 - share) * lifted_[i] - share * sum;
        heights_[i] = gaps_[i] + lifted_[i];
        start_[i] = normal_[reached_[i]] > 0.0 ? 1 : 0;
      }
      if (!limit_.factorisation(reached) ||
          !contact_.solve({&pressed_, modes_.data(), motions, heights_.data(), resultants}, start_.data())) {
        break;
      }
      double borne = 1.0;
      for (std::size_t i = 0; i < reached; ++i) {
        borne = std::min(borne, share_borne(cells, reached_[i], contact_.forces()[i]));
      }
      for (std::size_t i = 0; i < reached; ++i) {
        const double without = cells.pressing[reached_[i]];
        const double force = borne < 1.0 ? without + borne * (contact_.forces()[i] - without) : contact_.forces()[i];
        changed = std::max(changed, std::abs(force - normal_[reached_[i]]));
        normal_[reached_[i]] = force;
      }
    }
    last_held_ = held_;
    hold(cells, normal_.data());
    const bool known = round > 0 && last_held_ == held_ && !outcome.slides;
    settled = slipping(cells, compliance, wrench, friction, known, tolerance, outcome.slides);
    last_ = found_;
    std::fill(found_.begin(), found_.end(), 0.0);
    for (std::size_t i = 0; i < held_.size(); ++i) {
      found_[held_[i]] = shear_[i];
      found_[count + held_[i]] = shear_[held_.size() + i];
    }
    for (std::size_t k = 0; k < 2 * count; ++k) changed = std::max(changed, std::abs(found_[k] - last_[k]));
    if (round > 0) change = changed;
    agreed = change <= kAgreed * total && tolerance <= kTight;
    const double bound = friction * total / static_cast<double>(held_.size());
    tolerance = change <= kAgreed * total || !(bound > 0.0)
                    ? kTight
                    : std::max(std::min(kLoose, kSettled * changed / bound), kTight);
  }
  if (!agreed && settled && !outcome.slides) {
    // The work is spent, or pressure and shear keep each other going: shear that suits the last pressure.
    limit_.allow(patience_ * kLastWork);
    settled = slipping(cells, compliance, wrench, friction, true, kTight, outcome.slides);
  }
  outcome.simplified = !settled || (!agreed && change > kSufficient * total);
  write(cells, normal_.data(), shear_.data(), forces);
  return outcome;
}

}  // namespace mjtactile
