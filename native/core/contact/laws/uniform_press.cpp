#include "contact/laws/uniform_press.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/tangent_plane.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

constexpr int kSteps = 60;
// Newton's method ends when force and moments agree to this fraction of the force. They are then made exact on the part
// of the face that was found.
constexpr double kFits = 1e-10;
// Damping is needed only if the part under pressure is a sliver, because its moments are then nearly singular.
constexpr double kFirstDamping = 1e-10, kLastDamping = 1e2;
constexpr double kEnough = 1e-4, kStagnant = 1e-14, kSingular = 1e-17;
// Least distance of the force's line of action from the rim of the face's hull, over the square root of its area.
// Closer to the rim, the pressure would act on a sliver and grow without bound.
constexpr double kHullMargin = 1e-3;

}  // namespace

bool UniformPress::solve(const Face& face, const Placement& placement, const SurfaceGrid& grid, const double* wrench,
                         double friction, double* forces) {
  traction_.cover(face, placement);
  const double normal = -wrench[2], area = traction_.integrals().area;
  std::copy(wrench, wrench + 6, carried_);
  Point through;
  const double margin = kHullMargin * std::sqrt(area);
  if (!(area > 0.0) || !nearest_inside(traction_.hull(), centre_of_pressure(wrench), margin, through)) {
    return false;
  }
  carried_[3] = -through.y * normal;
  carried_[4] = through.x * normal;
  double coefficients[9];
  if (!traction_.carry(carried_, coefficients)) {
    const double moments[3] = {1.0, through.x, through.y};
    if (!find_part(moments) || !traction_.fit(carried_, coefficients)) return false;
  }
  traction_.nodal_forces(grid, coefficients, forces);
  if (friction >= 0.0 && hold(grid, friction, carried_, forces)) {
    traction_.fit(carried_, coefficients);
    traction_.nodal_forces(grid, coefficients, forces);
  }
  peak_ = 0.0;
  for (const Segment& edge : traction_.edges()) {
    peak_ = std::max(peak_, -coefficients[6] - coefficients[7] * edge.start.x - coefficients[8] * edge.start.y);
  }
  return true;
}

// Restrict traction_ to the part of the face under pressure. `moments`: integrals of the pressure times 1, x and y,
// over the force. False if none was found.
bool UniformPress::find_part(const double* moments) {
  const AreaIntegrals all = traction_.integrals();
  centre_ = {all.x / all.area, all.y / all.area};
  scale_ = std::sqrt(all.area);
  // Coordinates about the face's centroid, over the square root of its area.
  whole_.clear();
  for (const Segment& edge : traction_.edges()) {
    whole_.push_back({{(edge.start.x - centre_.x) / scale_, (edge.start.y - centre_.y) / scale_},
                      {(edge.end.x - centre_.x) / scale_, (edge.end.y - centre_.y) / scale_}});
  }
  const double wanted[3] = {1.0, (moments[1] - centre_.x) / scale_, (moments[2] - centre_.y) / scale_};
  double coefficients[3] = {1e300, 0.0, 0.0}, part[3][3];
  double system[9], step[3];
  energy(coefficients, wanted, part);  // sets `part` to the moments of the whole face
  const auto solve = [&](double damping, const double* right) {
    for (std::size_t a = 0; a < 3; ++a) {
      step[a] = right[a];
      for (std::size_t b = 0; b < 3; ++b) system[3 * a + b] = part[a][b] + (a == b ? damping : 0.0);
    }
    return solve_small(3, system, step, 1, kSingular);
  };
  // Start from the pressure without clipping. Its energy is negative, and a pressure that is nowhere positive has
  // energy 0. So steps that lower the energy cannot lose the contact.
  if (!solve(0.0, wanted)) return false;
  for (std::size_t a = 0; a < 3; ++a) coefficients[a] = step[a];
  double now = energy(coefficients, wanted, part);
  for (int k = 0; k < kSteps; ++k) {
    double right[3], worst = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
      right[a] = wanted[a];
      for (std::size_t b = 0; b < 3; ++b) right[a] -= part[a][b] * coefficients[b];
      worst = std::max(worst, std::abs(right[a]));
    }
    if (worst <= kFits) break;
    bool found = false;
    double trial[3], lower = now, moved[3][3];
    for (double damping = 0.0; !found && damping <= kLastDamping;
         damping = damping > 0.0 ? 10.0 * damping : kFirstDamping) {
      if (!solve(damping, right)) continue;
      double gain = 0.0;
      for (std::size_t a = 0; a < 3; ++a) trial[a] = coefficients[a] + step[a], gain += right[a] * step[a];
      lower = energy(trial, wanted, moved);
      found = lower <= now - kEnough * gain;
    }
    if (!found) break;
    const bool stagnant = now - lower <= kStagnant * std::abs(now);
    std::copy(trial, trial + 3, coefficients);
    std::copy(&moved[0][0], &moved[0][0] + 9, &part[0][0]);
    now = lower;
    if (stagnant) break;
  }
  // Back to pad coordinates.
  const double pressure[3] = {coefficients[0] - (coefficients[1] * centre_.x + coefficients[2] * centre_.y) / scale_,
                              coefficients[1] / scale_, coefficients[2] / scale_};
  traction_.keep_where(pressure);
  return traction_.integrals().area > 0.0;
}

// Energy of a pressure, clipped where it is negative, and the moments (of 1, x, y with 1, x, y) of the part under it.
double UniformPress::energy(const double* coefficients, const double* wanted, double moments[3][3]) {
  cut_where(whole_, coefficients, crossings_, part_);
  const AreaIntegrals part = integrals_of(part_, {0.0, 0.0});
  const double rows[3][3] = {{part.area, part.x, part.y}, {part.x, part.xx, part.xy}, {part.y, part.xy, part.yy}};
  std::copy(&rows[0][0], &rows[0][0] + 9, &moments[0][0]);
  double sum = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    sum -= wanted[a] * coefficients[a];
    for (std::size_t b = 0; b < 3; ++b) sum += 0.5 * coefficients[a] * rows[a][b] * coefficients[b];
  }
  return sum;
}

// Reduce the shear and torsion of a wrench to what friction carries under the normal nodal forces. Returns whether they
// were reduced.
bool UniformPress::hold(const SurfaceGrid& grid, double friction, double* wrench, const double* forces) {
  const std::size_t columns = grid.nodes_x(), rows = grid.nodes_y();
  points_.resize(columns * rows);
  normal_.resize(columns * rows);
  places_.clear();
  // Some nodal forces of a positive pressure are negative. Leave these out, and scale the others to the same force.
  double positive = 0.0;
  for (std::size_t i = 0; i < columns * rows; ++i) {
    points_[i] = {grid.node_x(i % columns), grid.node_y(i / columns)};
    normal_[i] = std::max(-forces[3 * i + 2], 0.0);
    if (normal_[i] > 0.0) places_.push_back(i), positive += normal_[i];
  }
  if (places_.empty()) return false;
  for (double& one : normal_) one *= -wrench[2] / positive;
  const double length = std::sqrt(traction_.integrals().area);
  grip_.hold(points_.data(), normal_.data(), places_.data(), places_.size(), length);
  double wanted[3], held[3];
  grip_.about_centre(wrench, wrench[5], wanted);
  shear_.resize(2 * places_.size());
  if (!grip_.nearest(wanted, friction, shear_.data())) return false;
  grip_.resultants(shear_.data(), held);
  // Convert the torsion about the centre of pressure to one about the pad's origin.
  double origin[3];
  const double force[2] = {held[0], held[1]};
  grip_.about_centre(force, 0.0, origin);
  wrench[0] = held[0];
  wrench[1] = held[1];
  wrench[5] = (held[2] - origin[2]) * length;
  return true;
}

}  // namespace mjtactile
