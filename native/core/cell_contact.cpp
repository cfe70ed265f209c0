#include "cell_contact.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// As the readable reference has them: mjtactile/cell_contact.py.
constexpr double kHullMargin = 1e-3;
// A shear that pressed cells resist this much less than another is for the reference.
constexpr double kOpen = 1e-12;
constexpr std::size_t kMostPressures = kMostMotions + 1;
// Rounds in which contact area and stiffness of a foundation adapt to each other (mjtactile/foundation.py).
constexpr int kRounds = 30;
constexpr double kSameArea = 1e-9;

// Rigid motions of a cell at a point: x, y and a turn, times the face's length.
void shear_modes(const Point& at, double modes[2][3]) {
  modes[0][0] = 1.0, modes[0][1] = 0.0, modes[0][2] = -at.y;
  modes[1][0] = 0.0, modes[1][1] = 1.0, modes[1][2] = at.x;
}

}  // namespace

bool CellContact::solve(const Face& face, const Placement& placement, const SurfaceCompliance& compliance,
                        const LawOptions& options, const double* wrench, Workspace& workspace, const double* heights,
                        const std::uint8_t* start) {
  const std::size_t cells = face.cells();
  placement_ = placement;
  tilting_ = options.tilting && cells >= 3;
  curved_ = heights != nullptr;
  workspace.placed.resize(2 * cells);
  centre_ = {0.0, 0.0};
  for (std::size_t i = 0; i < cells; ++i) {
    const Point at = placement(face.centroids[i]);
    workspace.placed[2 * i] = at.x;
    workspace.placed[2 * i + 1] = at.y;
    centre_.x += at.x / static_cast<double>(cells);
    centre_.y += at.y / static_cast<double>(cells);
  }
  points_.resize(cells);
  const std::size_t motions = tilting_ ? 3 : 1;
  workspace.modes.resize(cells * motions);
  for (std::size_t i = 0; i < cells; ++i) {
    points_[i] = {(workspace.placed[2 * i] - centre_.x) / face.length,
                  (workspace.placed[2 * i + 1] - centre_.y) / face.length};
    double* modes = workspace.modes.data() + i * motions;
    modes[0] = 1.0;
    if (tilting_) modes[1] = points_[i].x, modes[2] = points_[i].y;
  }
  double wanted[kMostPressures];
  if (!resultants(face, wrench, wanted)) return false;
  if (!solve_contact(face, compliance, options, wanted, heights, start, workspace)) return false;

  gram_.assign(9 * pressures(), 0.0);
  pressed_area_ = 0.0;
  for (std::size_t i = 0; i < cells; ++i) {
    if (contact_.pressed()[i]) pressed_area_ += face.areas[i];
    double modes[2][3];
    shear_modes(points_[i], modes);
    for (std::size_t n = 0; n < pressures(); ++n) {
      const double force = contact_.map_forces()[i][n];
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

bool CellContact::solve_contact(const Face& face, const SurfaceCompliance& compliance, const LawOptions& options,
                                const double* resultants, const double* heights, const std::uint8_t* start,
                                Workspace& workspace) {
  const double* modes = workspace.modes.data();
  const std::size_t motions = tilting_ ? 3 : 1;
  if (options.law == Law::elastic) {
    compliance.normal(workspace.placed.data(), face.areas.data(), face.cells(), face.inverse_distance.data(), 1.0,
                      workspace.compliance, workspace.matrix);
    return contact_.solve(workspace.matrix, modes, motions, heights, resultants, start);
  }
  // Springs whose stiffness fits the area that comes into contact.
  const std::size_t cells = face.cells();
  const auto pressed_area = [&](const std::uint8_t* pressed) {
    double area = 0.0;
    for (std::size_t i = 0; i < cells; ++i) area += pressed == nullptr || pressed[i] ? face.areas[i] : 0.0;
    return area;
  };
  const bool known = start != nullptr && std::any_of(start, start + cells, [](std::uint8_t one) { return one != 0; });
  double area = pressed_area(known ? start : nullptr);
  for (int round = 0; round < kRounds; ++round) {
    const double stiffness = compliance.foundation_stiffness(area);
    workspace.matrix.resize(cells, cells);
    for (std::size_t i = 0; i < cells; ++i) {
      std::fill(workspace.matrix[i], workspace.matrix[i] + cells, 0.0);
      workspace.matrix[i][i] = 1.0 / (stiffness * face.areas[i]);
    }
    if (!contact_.solve(workspace.matrix, modes, motions, heights, resultants, start)) return false;
    const double found = pressed_area(contact_.pressed().data());
    if (std::abs(found - area) <= kSameArea * area) break;
    area = std::abs(found - area) < 0.1 * area ? (area + found) / 2 : found;
  }
  return true;
}

bool CellContact::resultants(const Face& face, const double* wrench, double* resultants) const {
  const double normal = -wrench[2];
  if (!(normal > 0.0)) return false;
  if (curved_) resultants[tilting_ ? 3 : 1] = 1.0;
  resultants[0] = normal;
  if (!tilting_) return true;
  Point through;
  if (!nearest_inside(face.hull, this->through(wrench), kHullMargin * face.length, through)) return false;
  through = placement_(through);
  resultants[1] = normal * (through.x - centre_.x) / face.length;
  resultants[2] = normal * (through.y - centre_.y) / face.length;
  return true;
}

// Where a force's line passes through the surface, in the face's frame.
Point CellContact::through(const double* wrench) const {
  return placement_.back(-wrench[4] / wrench[2], wrench[3] / wrench[2]);
}

bool CellContact::carries(const Face& face, const double* wrench) const {
  if (!tilting_) return true;
  const Point wanted = through(wrench);
  Point nearest;
  return nearest_inside(face.hull, wanted, kHullMargin * face.length, nearest) && nearest.x == wanted.x &&
         nearest.y == wanted.y;
}

bool CellContact::weights(const Face& face, const LawOptions& options, const double* wrench,
                          std::vector<double>& weights, Workspace& workspace) const {
  const std::size_t pressures = this->pressures();
  double pressing[kMostPressures];
  if (!resultants(face, wrench, pressing)) return false;
  workspace.forces.resize(face.cells());
  if (!contact_.under(pressing, workspace.forces.data())) return false;
  weights.assign(parts(), 0.0);
  std::copy(pressing, pressing + pressures, weights.begin());
  const double torsion = wrench[5] - (centre_.x * wrench[1] - centre_.y * wrench[0]);
  if (wrench[0] == 0.0 && wrench[1] == 0.0 && torsion == 0.0) return true;
  Matrix &gram = workspace.gram, &motion = workspace.motion;
  gram.resize(3, 3);
  motion.resize(3, 1);
  motion[0][0] = wrench[0];
  motion[1][0] = wrench[1];
  motion[2][0] = torsion / face.length;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) {
      gram[a][b] = 0.0;
      for (std::size_t n = 0; n < pressures; ++n) gram[a][b] += pressing[n] * gram_[9 * n + 3 * a + b];
    }
  }
  if (!solve_small(gram, motion, kOpen)) return false;
  if (options.friction >= 0.0) {
    for (std::size_t i = 0; i < face.cells(); ++i) {
      if (!contact_.pressed()[i]) continue;
      const double x = motion[0][0] - points_[i].y * motion[2][0], y = motion[1][0] + points_[i].x * motion[2][0];
      if (std::hypot(x, y) > options.friction) return false;
    }
  }
  for (std::size_t j = 0; j < 3; ++j) {
    for (std::size_t n = 0; n < pressures; ++n) weights[pressures + pressures * j + n] = motion[j][0] * pressing[n];
  }
  return true;
}

RigidMotion CellContact::motion(const Face& face, const std::vector<double>& weights) const {
  const std::size_t motions = contact_.motions();
  double moved[kMostMotions] = {};
  for (std::size_t m = 0; m < motions; ++m) {
    moved[m] = contact_.map_motion()[m][motions];
    for (std::size_t n = 0; n < motions; ++n) moved[m] += contact_.map_motion()[m][n] * weights[n];
  }
  return {moved[0], {moved[1] / face.length, moved[2] / face.length}, centre_};
}

void CellContact::nodal_forces(const Face& face, const SurfaceGrid& grid, const std::vector<double>& weights,
                                  Workspace& workspace, double* forces) const {
  const std::size_t cells = face.cells(), pressures = this->pressures();
  workspace.tractions.assign(3 * cells, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    double modes[2][3];
    shear_modes(points_[i], modes);
    double* traction = workspace.tractions.data() + 3 * i;
    for (std::size_t n = 0; n < pressures; ++n) {
      const double pressure = contact_.map_forces()[i][n] / face.areas[i];
      traction[2] -= weights[n] * pressure;
      for (std::size_t j = 0; j < 3; ++j) {
        const double share = weights[pressures + pressures * j + n] * pressure;
        traction[0] += share * modes[0][j];
        traction[1] += share * modes[1][j];
      }
    }
  }
  workspace.edges.clear();
  for (const CellEdge& edge : face.edges) {
    TractionEdge step = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0, 0.0}};
    bool stepped = false;
    for (int k = 0; k < 3; ++k) {
      const double left = edge.left < 0 ? 0.0 : workspace.tractions[static_cast<std::size_t>(3 * edge.left + k)];
      const double right = edge.right < 0 ? 0.0 : workspace.tractions[static_cast<std::size_t>(3 * edge.right + k)];
      step.traction[k] = left - right;
      stepped = stepped || step.traction[k] != 0.0;
    }
    if (!stepped) continue;
    const Point start = placement_({edge.start[0], edge.start[1]}), end = placement_({edge.end[0], edge.end[1]});
    step.start[0] = start.x, step.start[1] = start.y, step.end[0] = end.x, step.end[1] = end.y;
    workspace.edges.push_back(step);
  }
  grid.traction_forces(workspace.edges.data(), workspace.edges.size(), workspace.grid, forces);
}

}  // namespace mjtactile
