#include "contact/laws/cell_contact.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "contact/solvers/bearing.hpp"
#include "geometry/tangent_plane.hpp"
#include "linalg/angles.hpp"
#include "linalg/small.hpp"

namespace mjtactile {
namespace {

constexpr double kHullMargin = 1e-3;
// Torsion is not carried if the pressed cells' polar moment, over their force, is below this.
constexpr double kOpen = 1e-12;
constexpr std::size_t kMostPressures = kMostMotions + 1;
// Shear due to torsion is limited so that no cell's shear exceeds kMostTwist times its pressure, or kTwistOverSliding
// times the mean shear due to the tangential force if that is more.
constexpr double kMostTwist = 1.0, kTwistOverSliding = 1.5;
constexpr int kBisections = 40;
// A tilt is set to zero if it moves the rim of the cells by more than this many indentations. Pressed cells in one row
// do not determine it.
constexpr double kOpenTilt = 1e3;
// Cells whose middles lie along a line up to this fraction of their extent are in a row.
constexpr double kInRow = 1e-3;
// Distances that differ by less than this fraction of the face's length count as equal.
constexpr double kTie = 1e-9;
// If the load is at least this fraction of what all cells together can bear, all of them are pressed in proportion.
constexpr double kNearlyAll = 0.98;

// Displacements of a point, over the face's length from the cells' middle, under the body's motions in the plane:
// translations along x and y, and a rotation.
void shear_modes(const Point& at, double modes[2][3]) {
  modes[0][0] = 1.0, modes[0][1] = 0.0, modes[0][2] = -at.y;
  modes[1][0] = 0.0, modes[1][1] = 1.0, modes[1][2] = at.x;
}

}  // namespace

CellContact::Row::Row(const std::vector<Point>& points) {
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (const Point& point : points) xx += point.x * point.x, xy += point.x * point.y, yy += point.y * point.y;
  const double mean = (xx + yy) / 2, apart = std::hypot((xx - yy) / 2, xy);
  if (mean - apart > kInRow * kInRow * (mean + apart)) return;
  const double angle = principal_angle(xx, xy, yy);
  along_ = {std::cos(angle), std::sin(angle)};
  is_row_ = true;
}

Point CellContact::Row::operator()(const Point& at) const {
  if (!is_row_) return at;
  const double along = along_.x * at.x + along_.y * at.y;
  return {along * along_.x, along * along_.y};
}

void CellContact::place(const Face& face, const Placement& placement, const ContactSurface& surface,
                        Workspace& workspace, const BentCells* bent) {
  const LawOptions& options = surface.options;
  const std::size_t cells = face.cells();
  placement_ = placement;
  tilting_ = (options.tilting || !options.law->shapes()) && cells >= 3;
  workspace.placed.resize(2 * cells);
  centre_ = {0.0, 0.0};
  for (std::size_t i = 0; i < cells; ++i) {
    const Point at =
        bent == nullptr ? placement(face.centroids[i]) : Point{bent->levers()[2 * i], bent->levers()[2 * i + 1]};
    workspace.placed[2 * i] = at.x;
    workspace.placed[2 * i + 1] = at.y;
    centre_.x += at.x / static_cast<double>(cells);
    centre_.y += at.y / static_cast<double>(cells);
  }
  points_.resize(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    points_[i] = {(workspace.placed[2 * i] - centre_.x) / face.length,
                  (workspace.placed[2 * i + 1] - centre_.y) / face.length};
  }
  on_row_ = Row(points_);
  workspace.modes.resize(cells * motions());
  for (std::size_t i = 0; i < cells; ++i) {
    points_[i] = on_row_(points_[i]);
    double* modes = workspace.modes.data() + i * motions();
    modes[0] = 1.0;
    if (tilting_) modes[1] = points_[i].x, modes[2] = points_[i].y;
  }
  workspace.quadrature.clear();
  if (!options.law->couples()) return;
  for (std::size_t k = 0; bent == nullptr && k < face.quadrature.size(); ++k) {
    const Point at = placement(face.quadrature[k]);
    workspace.quadrature.insert(workspace.quadrature.end(), {at.x, at.y});
  }
  found_.contact.forget();
  surface.compliance.normal(on_surface(face, workspace, bent), workspace.compliance, workspace.matrix);
}

SurfaceCells CellContact::on_surface(const Face& face, const Workspace& workspace, const BentCells* bent) {
  const std::vector<double>& middles = bent == nullptr ? workspace.placed : bent->on_pad();
  const std::vector<double>& quadrature = bent == nullptr ? workspace.quadrature : bent->quadrature();
  const bool spread = !quadrature.empty();
  return {face.cells(), (spread ? quadrature : middles).data(), spread ? quadrature.size() / (2 * face.cells()) : 1,
          face.areas.data(), face.inverse_distance.data(), bend_of(bent)};
}

void CellContact::press(const Face& face, const ContactSurface& surface, const PressedBody& body,
                        Workspace& workspace) {
  const std::size_t cells = face.cells();
  const LawOptions& options = surface.options;
  const double* wrench = body.wrench;
  has_heights_ = body.heights != nullptr;
  force_ = -wrench[2];
  double wanted[kMostPressures];
  resultants(face, wrench, wanted);
  found_.slopes[0] = found_.slopes[1] = 0.0;
  length_ = face.length;
  found_.normal.assign(cells, 0.0);
  const ContactLaw& law = *options.law;
  const RigidProblem rigid = {&workspace.matrix, workspace.modes.data(), motions(), body.heights, wanted};
  const LawProblem problem = {face, surface.compliance, rigid, workspace.matrix, body.start};
  found_.contact.allow();
  std::copy(wanted, wanted + motions(), wanted_);
  // Shear uses a part of the strength: sqrt(p^2 + 3 t^2) is bounded.
  const double sliding = std::min(std::hypot(wrench[0], wrench[1]) / -wrench[2], kMostTwist);
  strength_ = options.strength / std::sqrt(1.0 + 3.0 * sliding * sliding);
  const bool spread = solve(law, problem, body.overloads, workspace);
  if (!exact_) found_.slopes[0] = found_.slopes[1] = 0.0;
  if (!exact_ && !spread) fill_nearest(face, wrench, workspace);
  double most = 0.0;
  for (std::size_t i = 0; i < cells; ++i) {
    found_.normal[i] = found_.pressed[i] ? std::max(found_.normal[i], 0.0) : 0.0;
    most = std::max(most, found_.normal[i]);
  }
  pressed_area_ = 0.0;
  for (std::size_t i = 0; i < cells; ++i) pressed_area_ += found_.normal[i] > kTouches * most ? face.areas[i] : 0.0;
  measure(face, law, workspace.matrix, body.heights);
}

// Solve the contact without bounds. If that exceeds the pad's strength or fails, solve it with bounded pressure, and at
// once if it likely will. Returns whether forces with bounded pressure were found.
bool CellContact::solve(const ContactLaw& law, const LawProblem& problem, bool overloads, Workspace& workspace) {
  const std::vector<double>& areas = problem.face.areas;
  linear_ = false;
  if (strength_ > 0.0) set_most(areas, workspace);
  const bool bounded = strength_ > 0.0 && law.couples();
  // Cells that carry all that they can need no solution, and rounding must not decide whether one is found.
  if (bounded && fills_all(problem)) {
    exact_ = true;
    return bound_pressure(law, problem, workspace);
  }
  // If forces within the strength certainly cannot carry the load, the contact without bounds is not solved.
  if (bounded && (overloads || lies_beyond_bearing(problem.body, workspace.most.data()))) {
    found_.pressed.assign(areas.size(), 1);
    if (bound_pressure(law, problem, workspace) && found_.contact.definite()) {
      linear_ = exact_ && law.shapes() && found_.contact.is_free();
      return true;
    }
    found_.contact.forget();
  }
  exact_ = law.solve(problem, found_);
  linear_ = exact_ && law.shapes();
  if (!exact_) {
    if (!bounded) return false;
    found_.pressed.assign(areas.size(), 1);
    return bound_pressure(law, problem, workspace);
  }
  bool over = false;
  for (std::size_t i = 0; i < areas.size(); ++i) over = over || found_.normal[i] > strength_ * areas[i];
  if (!(strength_ > 0.0) || !over) return false;
  linear_ = false;
  return bound_pressure(law, problem, workspace);
}

// Whether the load is nearly all that the cells can bear together.
bool CellContact::fills_all(const LawProblem& problem) const {
  const std::vector<double>& areas = problem.face.areas;
  return problem.body.resultants[0] >= kNearlyAll * strength_ * std::accumulate(areas.begin(), areas.end(), 0.0);
}

void CellContact::set_most(const std::vector<double>& areas, Workspace& workspace) const {
  workspace.most.resize(areas.size());
  for (std::size_t i = 0; i < areas.size(); ++i) workspace.most[i] = strength_ * areas[i];
}

// Leave of a tilt the part along the pressed cells' longest direction, if it is at most `most`.
void CellContact::drop_open_tilt(double most, double* slopes) const {
  Point middle = {0.0, 0.0};
  double count = 0.0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!found_.pressed[i]) continue;
    middle.x += points_[i].x, middle.y += points_[i].y, count += 1.0;
  }
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!found_.pressed[i]) continue;
    const double x = points_[i].x - middle.x / count, y = points_[i].y - middle.y / count;
    xx += x * x, xy += x * y, yy += y * y;
  }
  const double angle = principal_angle(xx, xy, yy), c = std::cos(angle), s = std::sin(angle);
  const double along = c * slopes[0] + s * slopes[1], kept = std::abs(along) <= most ? along : 0.0;
  slopes[0] = kept * c, slopes[1] = kept * s;
}

// Compute how deep the contact is and its energy, and drop a tilt that the pressed cells do not determine.
void CellContact::measure(const Face& face, const ContactLaw& law, const Matrix& between, const double* heights) {
  indentation_ = lowered_ = energy_ = 0.0;
  for (std::size_t i = 0; i < found_.normal.size(); ++i) {
    if (!(found_.normal[i] > 0.0)) continue;
    const double deep = depth(face, law, between, i);
    indentation_ = std::max(indentation_, deep);
    lowered_ = std::max(lowered_, deep + (heights == nullptr ? 0.0 : heights[i]));
    energy_ += found_.normal[i] * deep / 2;
  }
  double widest = 0.0;   // squared
  for (const Point& point : points_) widest = std::max(widest, point.x * point.x + point.y * point.y);
  double* slopes = found_.slopes;
  const double most = kOpenTilt * indentation_ / std::sqrt(widest);
  if (std::hypot(slopes[0], slopes[1]) > most) drop_open_tilt(most, slopes);
  slopes[0] /= length_;
  slopes[1] /= length_;
}

bool CellContact::make_parts(const Face& face, const ContactLaw& law, Workspace& workspace) {
  const RigidProblem body = {&workspace.matrix, workspace.modes.data(), motions(), nullptr, wanted_};
  if (!law.couples()) {  // such laws solve without found_.contact, which has the maps
    if (!law.set_compliance(face, found_, workspace.matrix)) return false;
    if (!found_.contact.exchange(body, found_.pressed.data())) return false;
  }
  found_.contact.make_maps(body);
  gram_.assign(9 * motions(), 0.0);
  for (std::size_t i = 0; i < face.cells(); ++i) {
    double modes[2][3];
    shear_modes(points_[i], modes);
    for (std::size_t n = 0; n < motions(); ++n) {
      const double force = found_.contact.map_forces()[i][n];
      for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
          gram_[9 * n + static_cast<std::size_t>(3 * a + b)] +=
              force * (modes[0][a] * modes[0][b] + modes[1][a] * modes[1][b]);
        }
      }
    }
  }
  return true;
}

// Solve with pressures bounded by the strength. A load beyond what all cells bear is carried in part. False if no
// forces were found that carry the load. exact_: whether the forces satisfy the contact conditions.
bool CellContact::bound_pressure(const ContactLaw& law, const LawProblem& problem, Workspace& workspace) {
  const std::vector<double>& areas = problem.face.areas;
  const std::size_t cells = areas.size();
  const double area = std::accumulate(areas.begin(), areas.end(), 0.0), load = problem.body.resultants[0];
  found_.slopes[0] = found_.slopes[1] = 0.0;
  if (fills_all(problem)) {
    const double share = std::min(1.0, load / (strength_ * area));
    for (std::size_t i = 0; i < cells; ++i) found_.normal[i] = share * workspace.most[i];
    found_.pressed.assign(cells, 1);
    return true;
  }
  exact_ = false;
  if (!law.set_compliance(problem.face, found_, workspace.matrix)) return false;  // fill_nearest() follows
  exact_ = found_.contact.solve_bounded(problem.body, workspace.most.data(), found_.pressed);
  if (!found_.contact.carries()) return false;
  found_.take(found_.contact, motions());
  return true;
}

// Press the cells nearest to the force's line of action at the strength, until they carry the force. Without a
// strength, the pressure is 1.25 times the mean.
void CellContact::fill_nearest(const Face& face, const double* wrench, Workspace& workspace) {
  const std::size_t cells = face.cells();
  const Point at = placement_(through(wrench));
  const double area = std::accumulate(face.areas.begin(), face.areas.end(), 0.0);
  const double pressure = strength_ > 0.0 ? strength_ : 1.25 * -wrench[2] / area;
  const auto away = [&](std::size_t i) {
    return std::hypot(workspace.placed[2 * i] - at.x, workspace.placed[2 * i + 1] - at.y);
  };
  workspace.order.resize(cells);
  std::iota(workspace.order.begin(), workspace.order.end(), std::size_t{0});
  std::sort(workspace.order.begin(), workspace.order.end(), [&](std::size_t i, std::size_t j) {
    const double first = away(i), second = away(j);
    return first != second ? first < second : i < j;
  });
  found_.pressed.assign(cells, 0);
  std::fill(found_.normal.begin(), found_.normal.end(), 0.0);
  double left = -wrench[2];
  const std::vector<std::size_t>& order = workspace.order;
  for (std::size_t first = 0, next = 0; first < cells && left > 0.0; first = next) {
    // Cells at equal distances share the remaining force, because rounding would decide their order.
    double alike = 0.0;
    do {
      alike += face.areas[order[next++]];
    } while (next < cells && away(order[next]) <= away(order[first]) + kTie * face.length);
    const double own = std::min(left / alike, pressure);
    for (std::size_t k = first; k < next; ++k) {
      found_.normal[order[k]] = own * face.areas[order[k]], found_.pressed[order[k]] = 1;
    }
    left -= own * alike;
  }
}

void CellContact::resultants(const Face& face, const double* wrench, double* resultants) const {
  const double normal = -wrench[2];
  resultants[0] = normal;
  if (!tilting_) return;
  const double margin = kHullMargin * face.length;
  Point inside;
  // Cells in one row have no inside.
  if (!nearest_inside(face.hull, through(wrench), margin, inside)) {
    inside = nearest_along(face.hull, through(wrench), margin);
  }
  inside = placement_(inside);
  const Point borne = on_row_({(inside.x - centre_.x) / face.length, (inside.y - centre_.y) / face.length});
  resultants[1] = normal * borne.x;
  resultants[2] = normal * borne.y;
}

// Point at which the force's line of action passes through the surface, in the face's frame.
Point CellContact::through(const double* wrench) const {
  const Point at = centre_of_pressure(wrench);
  return placement_.back(at.x, at.y);
}

void CellContact::carried(const Face& face, const double* wrench, double* carried) const {
  std::copy(wrench, wrench + 6, carried);
  if (!tilting_) return;
  double pressing[kMostPressures];
  resultants(face, wrench, pressing);
  carried[3] = (centre_.y * pressing[0] + pressing[2] * face.length) * -1.0;
  carried[4] = centre_.x * pressing[0] + pressing[1] * face.length;
}

void CellContact::forces(const Face& face, const double* wrench, double* forces) const {
  const std::size_t cells = face.cells();
  double turning = 0.0, sum = 0.0;
  Point pressed = {0.0, 0.0};
  for (std::size_t i = 0; i < cells; ++i) {
    const double normal = found_.normal[i];
    double* force = forces + 3 * i;
    force[0] = force[1] = 0.0;
    force[2] = -normal;
    if (!(normal > 0.0)) continue;
    turning += normal * (points_[i].y * points_[i].y + points_[i].x * points_[i].x);
    sum += normal;
    pressed.x += normal * points_[i].x, pressed.y += normal * points_[i].y;
  }
  if (!(sum > 0.0) || (wrench[0] == 0.0 && wrench[1] == 0.0 && wrench[5] == 0.0)) return;
  pressed = {pressed.x / sum, pressed.y / sum};
  // A translation carries the tangential force. A rotation about the centre of pressure carries the remaining torsion.
  const double slide[2] = {wrench[0] / sum, wrench[1] / sum};
  const double middle[2] = {centre_.x + face.length * pressed.x, centre_.y + face.length * pressed.y};
  const double torsion = wrench[5] - (middle[0] * wrench[1] - middle[1] * wrench[0]);
  const double polar = turning - sum * (pressed.x * pressed.x + pressed.y * pressed.y);
  double turn = polar > kOpen * sum ? torsion / face.length / polar : 0.0;
  const double limit = std::max(kMostTwist, kTwistOverSliding * std::hypot(slide[0], slide[1]));
  const auto exceeds = [&](double share) {
    for (std::size_t i = 0; i < cells; ++i) {
      if (!(found_.normal[i] > 0.0)) continue;
      const double x = slide[0] - share * turn * (points_[i].y - pressed.y);
      const double y = slide[1] + share * turn * (points_[i].x - pressed.x);
      if (x * x + y * y > limit * limit) return true;
    }
    return false;
  };
  if (exceeds(1.0)) {
    double low = 0.0, high = 1.0;
    for (int step = 0; step < kBisections; ++step) {
      const double share = (low + high) / 2;
      (exceeds(share) ? high : low) = share;
    }
    turn *= low;
  }
  for (std::size_t i = 0; i < cells; ++i) {
    if (!(found_.normal[i] > 0.0)) continue;
    double* force = forces + 3 * i;
    force[0] = found_.normal[i] * (slide[0] - turn * (points_[i].y - pressed.y));
    force[1] = found_.normal[i] * (slide[1] + turn * (points_[i].x - pressed.x));
  }
}

PressedCells CellContact::pressed_cells(const Face& face, const double* heights, Workspace& workspace) const {
  workspace.points.resize(face.cells());
  for (std::size_t i = 0; i < face.cells(); ++i) {
    workspace.points[i] = {workspace.placed[2 * i], workspace.placed[2 * i + 1]};
  }
  set_most(face.areas, workspace);
  return {face.cells(), workspace.points.data(), found_.normal.data(), heights, centre_, face.length, tilting_,
          strength_ > 0.0 ? workspace.most.data() : nullptr};
}

void CellContact::sum(const Workspace& workspace, std::size_t cells, const double* forces, double* carried) {
  std::fill(carried, carried + 6, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    const double x = workspace.placed[2 * i], y = workspace.placed[2 * i + 1];
    const double* force = forces + 3 * i;
    for (int k = 0; k < 3; ++k) carried[k] += force[k];
    carried[3] += y * force[2];
    carried[4] -= x * force[2];
    carried[5] += x * force[1] - y * force[0];
  }
}

bool CellContact::weights(const Face& face, const LawOptions& options, const double* wrench,
                          std::vector<double>& weights, Workspace& workspace) const {
  const std::size_t pressures = motions();
  if (!linear_ || has_heights_ || !(wrench[2] < 0.0)) return false;
  double pressing[kMostPressures];
  resultants(face, wrench, pressing);
  workspace.forces.resize(face.cells());
  if (!found_.contact.under(pressing, workspace.forces.data())) return false;
  for (std::size_t i = 0; options.strength > 0.0 && i < face.cells(); ++i) {
    if (workspace.forces[i] > options.strength * face.areas[i]) return false;
  }
  weights.assign(parts(), 0.0);
  std::copy(pressing, pressing + pressures, weights.begin());
  const double torsion = wrench[5] - (centre_.x * wrench[1] - centre_.y * wrench[0]);
  if (wrench[0] == 0.0 && wrench[1] == 0.0 && torsion == 0.0) return true;
  double motion[3] = {wrench[0], wrench[1], torsion / face.length}, gram[9] = {};
  for (std::size_t n = 0; n < pressures; ++n) {
    for (std::size_t k = 0; k < 9; ++k) gram[k] += pressing[n] * gram_[9 * n + k];
  }
  if (!solve_small(3, gram, motion, 1, kOpen)) return false;
  const double sliding = std::hypot(wrench[0], wrench[1]) / -wrench[2];
  const double limit = std::max(kMostTwist, kTwistOverSliding * sliding);
  for (std::size_t i = 0; i < face.cells(); ++i) {
    if (!found_.contact.pressed()[i]) continue;
    const double x = motion[0] - points_[i].y * motion[2], y = motion[1] + points_[i].x * motion[2];
    if (x * x + y * y > limit * limit) return false;
  }
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t n = 0; n < pressures; ++n) weights[pressures + pressures * j + n] = motion[j] * pressing[n];
  }
  return true;
}

void CellContact::part_forces(const Face& face, std::size_t part, double* forces) const {
  const std::size_t pressures = motions();
  for (std::size_t i = 0; i < face.cells(); ++i, forces += 3) {
    const double pressing = found_.contact.map_forces()[i][part % pressures];
    std::fill(forces, forces + 3, 0.0);
    if (part < pressures) {
      forces[2] = -pressing;
    } else {
      double modes[2][3];
      shear_modes(points_[i], modes);
      for (std::size_t k = 0; k < 2; ++k) forces[k] = pressing * modes[k][part / pressures - 1];
    }
  }
}

}  // namespace mjtactile
