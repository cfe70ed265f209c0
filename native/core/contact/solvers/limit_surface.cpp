#include "contact/solvers/limit_surface.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/small.hpp"
#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

// A wrench within this fraction of the limit counts as carried (tests/reference has the law).
constexpr double kAtLimit = 1e-9;
// A motion is open if its stiffness is below this fraction of the largest.
constexpr double kOpen = 1e-13;
// If the body turns about a cell, the extent has a kink there. It is rounded over motions of this size, relative to the
// body's motion. If Newton's method fails with the last value, it begins with the larger ones.
constexpr double kRounding = 1e-8;
constexpr double kLeadIn[] = {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7};
constexpr int kSteps = 20, kHalvings = 30;
constexpr double kConverged = 1e-14;

}  // namespace

void ShearGrip::hold(const Point* points, const double* normal, const std::size_t* places, std::size_t count,
                     double length) {
  x_.resize(count);
  y_.resize(count);
  normal_.resize(count);
  length_ = length;
  pressing_ = 0.0;
  double x = 0.0, y = 0.0;
  const Point& origin = points[count > 0 ? places[0] : 0];
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t place = places[i];
    normal_[i] = normal[place];
    pressing_ += normal_[i];
    x += normal_[i] * (points[place].x - origin.x);
    y += normal_[i] * (points[place].y - origin.y);
  }
  centre_ = {origin.x + x / pressing_, origin.y + y / pressing_};
  for (std::size_t i = 0; i < count; ++i) {
    x_[i] = (points[places[i]].x - centre_.x) / length;
    y_[i] = (points[places[i]].y - centre_.y) / length;
  }
}

void ShearGrip::about_centre(const double* force, double torsion, double* resultants) const {
  resultants[0] = force[0];
  resultants[1] = force[1];
  resultants[2] = (torsion - (centre_.x * force[1] - centre_.y * force[0])) / length_;
}

void ShearGrip::resultants(const double* shear, double* resultants) const {
  const std::size_t cells = count();
  std::fill(resultants, resultants + 3, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    resultants[0] += shear[i];
    resultants[1] += shear[cells + i];
    resultants[2] += x_[i] * shear[cells + i] - y_[i] * shear[i];
  }
}

void ShearGrip::proportional(const double* wanted, double* shear) const {
  const std::size_t cells = count();
  double gram[9] = {}, motion[3];
  for (std::size_t i = 0; i < cells; ++i) {
    const double share = normal_[i] / pressing_;
    gram[0] += share;
    gram[2] -= share * y_[i];
    gram[5] += share * x_[i];
    gram[8] += share * (x_[i] * x_[i] + y_[i] * y_[i]);
  }
  gram[4] = gram[0], gram[6] = gram[2], gram[7] = gram[5];
  solve_semidefinite(3, gram, kOpen, wanted, motion);
  for (std::size_t i = 0; i < cells; ++i) {
    const double share = normal_[i] / pressing_;
    shear[i] = share * (motion[0] - y_[i] * motion[2]);
    shear[cells + i] = share * (motion[1] + x_[i] * motion[2]);
  }
}

double ShearGrip::work(const double* direction, double rounding, double* slope, double* curvature) const {
  const double square = rounding * rounding;
  double sum = 0.0, sx = 0.0, sy = 0.0, turn = 0.0;
  double h[6] = {};
  for (std::size_t i = 0; i < count(); ++i) {
    const double share = normal_[i] / pressing_;
    const double dx = direction[0] - y_[i] * direction[2], dy = direction[1] + x_[i] * direction[2];
    const double size = std::sqrt(dx * dx + dy * dy + square);
    if (!(size > 0.0)) continue;
    const double inverse = 1.0 / size, ux = dx * inverse, uy = dy * inverse;
    sum += share * size;
    sx += share * ux;
    sy += share * uy;
    turn += share * (x_[i] * uy - y_[i] * ux);
    if (curvature == nullptr) continue;
    const double scale = share * inverse;
    const double xx = scale * (1.0 - ux * ux), xy = -scale * ux * uy, yy = scale * (1.0 - uy * uy);
    const double xt = x_[i] * xy - y_[i] * xx, yt = x_[i] * yy - y_[i] * xy;
    h[0] += xx, h[1] += xy, h[2] += xt, h[3] += yy, h[4] += yt;
    h[5] += x_[i] * yt - y_[i] * xt;
  }
  slope[0] = sx, slope[1] = sy, slope[2] = turn;
  if (curvature != nullptr) {
    const double whole[9] = {h[0], h[1], h[2], h[1], h[3], h[4], h[2], h[4], h[5]};
    std::copy(whole, whole + 9, curvature);
  }
  return sum;
}

// Newton's method, with shorter steps if the whole step does not descend, for the minimum of
//   work(origin + axes . place)                          over two unknowns (pull null), or
//   work(place) + |place|^2 / 2 - pull . place           over all three.
bool ShearGrip::descend(double* place, const double (*axes)[3], std::size_t unknowns, const double* origin,
                        double rounding, const double* pull) const {
  const auto value_at = [&](const double* at, double* slope, double* curvature) {
    double direction[3] = {origin[0], origin[1], origin[2]};
    for (std::size_t k = 0; k < unknowns; ++k) {
      for (int i = 0; i < 3; ++i) direction[i] += at[k] * axes[k][i];
    }
    double slopes[3], bends[9];
    double value = work(direction, rounding, slopes, curvature == nullptr ? nullptr : bends);
    for (std::size_t k = 0; k < unknowns; ++k) {
      slope[k] = dot(slopes, axes[k]);
      if (curvature == nullptr) continue;
      for (std::size_t l = 0; l < unknowns; ++l) {
        double sum = 0.0;
        for (int i = 0; i < 3; ++i) sum += axes[k][i] * dot(bends + 3 * i, axes[l]);
        curvature[k * unknowns + l] = sum;
      }
    }
    if (pull != nullptr) {
      for (std::size_t k = 0; k < unknowns; ++k) {
        value += at[k] * at[k] / 2 - pull[k] * at[k];
        slope[k] += at[k] - pull[k];
        if (curvature != nullptr) curvature[k * unknowns + k] += 1.0;
      }
    }
    return value;
  };
  double measure = 1.0;
  if (pull != nullptr) measure += std::sqrt(dot(pull, pull));
  for (int step = 0; step < kSteps; ++step) {
    double slope[3] = {}, curvature[9] = {}, change[3], size = 0.0, fall = 0.0;
    const double value = value_at(place, slope, curvature);
    for (std::size_t k = 0; k < unknowns; ++k) size = std::max(size, std::abs(slope[k]));
    if (!(size > kConverged * measure)) return true;
    solve_semidefinite(unknowns, curvature, 1e-15, slope, change);
    for (std::size_t k = 0; k < unknowns; ++k) change[k] = -change[k], fall -= slope[k] * change[k];
    if (!(fall > 0.0) || !std::isfinite(fall)) return false;
    double share = 1.0, next[3] = {}, next_slope[3];
    for (int halving = 0; halving < kHalvings; ++halving, share *= 0.5) {
      for (std::size_t k = 0; k < unknowns; ++k) next[k] = place[k] + share * change[k];
      // Differences below the value's rounding error cannot be compared.
      if (fall < 1e-14 * std::abs(value) || value_at(next, next_slope, nullptr) <= value - 1e-4 * share * fall) break;
    }
    std::copy(next, next + unknowns, place);
    if (fall < 1e-28 * std::abs(value)) return true;
  }
  return false;
}

void ShearGrip::least_resisted(const double* unit, double* direction) const {
  // Two axes perpendicular to the wanted wrench.
  int least = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(unit[i]) < std::abs(unit[least])) least = i;
  }
  double axes[3][3] = {};
  axes[0][least] = 1.0;
  for (int i = 0; i < 3; ++i) axes[0][i] -= unit[least] * unit[i];
  const double size = std::sqrt(dot(axes[0], axes[0]));
  for (int i = 0; i < 3; ++i) axes[0][i] /= size;
  cross(unit, axes[0], axes[1]);
  double place[3] = {};
  if (!descend(place, axes, 2, unit, kRounding, nullptr)) {
    std::fill(place, place + 3, 0.0);
    for (const double rounding : kLeadIn) descend(place, axes, 2, unit, rounding, nullptr);
    descend(place, axes, 2, unit, kRounding, nullptr);
  }
  for (int i = 0; i < 3; ++i) direction[i] = unit[i] + place[0] * axes[0][i] + place[1] * axes[1][i];
}

void ShearGrip::slide(const double* direction, double rounding, double friction, double* shear) const {
  const std::size_t cells = count();
  for (std::size_t i = 0; i < cells; ++i) {
    const double dx = direction[0] - y_[i] * direction[2], dy = direction[1] + x_[i] * direction[2];
    const double size = std::sqrt(dx * dx + dy * dy + rounding * rounding);
    const double share = size > 0.0 ? friction * normal_[i] / size : 0.0;
    shear[i] = share * dx;
    shear[cells + i] = share * dy;
  }
}

bool ShearGrip::nearest(const double* wanted, double friction, double* shear) const {
  const std::size_t cells = count();
  const double size = std::sqrt(dot(wanted, wanted)), limit = friction * pressing_;
  if (!(size > 0.0)) return false;
  if (!(limit > 0.0)) {
    std::fill(shear, shear + 2 * cells, 0.0);
    return true;
  }
  proportional(wanted, shear);
  double carried[3], apart = 0.0;
  resultants(shear, carried);
  for (int i = 0; i < 3; ++i) apart = std::max(apart, std::abs(carried[i] - wanted[i]));
  bool held = apart <= kAtLimit * limit;
  for (std::size_t i = 0; held && i < cells; ++i) {
    held = std::hypot(shear[i], shear[cells + i]) <= friction * normal_[i];
  }
  if (held) return false;
  const double unit[3] = {wanted[0] / size, wanted[1] / size, wanted[2] / size};
  double direction[3], slope[3];
  least_resisted(unit, direction);
  const double pull[3] = {wanted[0] / limit, wanted[1] / limit, wanted[2] / limit};
  if (!(size / limit - work(direction, 0.0, slope, nullptr) > kAtLimit)) return false;
  // By how much the wanted wrench exceeds the set along a direction: the one found, or the wrench's own.
  const auto gap = [&](const double* along) { return dot(pull, along) - work(along, 0.0, slope, nullptr); };
  const double length = std::sqrt(dot(direction, direction));
  for (double& one : direction) one /= length;
  if (gap(unit) > gap(direction)) std::copy(unit, unit + 3, direction);
  const double behind = gap(direction);
  if (!(behind > 0.0)) return false;
  const double none[3] = {}, axes[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
  double place[3];
  for (int i = 0; i < 3; ++i) place[i] = behind * direction[i];
  double rounding = kRounding * behind;
  if (!descend(place, axes, 3, none, rounding, pull)) {
    for (int i = 0; i < 3; ++i) place[i] = behind * direction[i];
    for (const double one : kLeadIn) descend(place, axes, 3, none, one * behind, pull);
    descend(place, axes, 3, none, rounding, pull);
  }
  const double found = std::sqrt(dot(place, place));
  rounding = kRounding * std::min(behind, found);
  slide(place, rounding, friction, shear);
  return true;
}

double ShearGrip::sliding_with(const double* wanted, double friction, double* shear, double* direction) const {
  const std::size_t cells = count();
  const double size = std::sqrt(dot(wanted, wanted));
  std::fill(shear, shear + 2 * cells, 0.0);
  std::fill(direction, direction + 3, 0.0);
  if (!(size > 0.0)) return 0.0;
  const double unit[3] = {wanted[0] / size, wanted[1] / size, wanted[2] / size};
  double reached[3];
  least_resisted(unit, direction);
  slide(direction, kRounding, friction, shear);
  resultants(shear, reached);
  const double along = dot(reached, unit), share = along > size ? size / along : 1.0;
  for (std::size_t k = 0; k < 2 * cells; ++k) shear[k] *= share;
  return share;
}

}  // namespace mjtactile
