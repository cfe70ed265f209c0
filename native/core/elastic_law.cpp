#include "elastic_law.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// As the readable reference has them: mjtactile/cell_contact.py.
constexpr double kHullMargin = 1e-3;
// A shear that pressed cells resist this much less than another is for the reference.
constexpr double kOpen = 1e-12;

// Rigid motions of a cell at a point: x, y and a turn, times the face's length.
void shear_modes(const Point& at, double modes[2][3]) {
  modes[0][0] = 1.0, modes[0][1] = 0.0, modes[0][2] = -at.y;
  modes[1][0] = 0.0, modes[1][1] = 1.0, modes[1][2] = at.x;
}

}  // namespace

bool ElasticContact::solve(const Face& face, const Placement& placement, const SurfaceCompliance& compliance,
                           const LawOptions& options, const double* wrench, Workspace& workspace) {
  const std::size_t cells = face.cells();
  placement_ = placement;
  tilting_ = options.tilting && cells >= 3;
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
  double wanted[kMostMotions];
  if (!resultants(face, wrench, wanted)) return false;
  compliance.normal(workspace.placed.data(), face.areas.data(), cells, face.inverse_distance.data(), 1.0,
                    workspace.compliance, workspace.matrix);
  if (!contact_.solve(workspace.matrix, workspace.modes.data(), motions, nullptr, wanted, nullptr)) return false;

  gram_.assign(9 * motions, 0.0);
  pressed_area_ = 0.0;
  for (std::size_t i = 0; i < cells; ++i) {
    if (contact_.pressed()[i]) pressed_area_ += face.areas[i];
    double modes[2][3];
    shear_modes(points_[i], modes);
    for (std::size_t n = 0; n < motions; ++n) {
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

// What forces on the cells must add up to; false where they cannot.
bool ElasticContact::resultants(const Face& face, const double* wrench, double* resultants) const {
  const double normal = -wrench[2];
  if (!(normal > 0.0)) return false;
  resultants[0] = normal;
  if (!tilting_) return true;
  const double x = wrench[4] / normal, y = -wrench[3] / normal;
  if (!surely_inside(face.hull, placement_.back(x, y), kHullMargin * face.length)) return false;
  resultants[1] = normal * (x - centre_.x) / face.length;
  resultants[2] = normal * (y - centre_.y) / face.length;
  return true;
}

bool ElasticContact::weights(const Face& face, const LawOptions& options, const double* wrench,
                             std::vector<double>& weights, Workspace& workspace) const {
  const std::size_t motions = contact_.motions();
  double pressing[kMostMotions];
  if (!resultants(face, wrench, pressing)) return false;
  workspace.forces.resize(face.cells());
  if (!contact_.under(pressing, workspace.forces.data())) return false;
  weights.assign(parts(), 0.0);
  std::copy(pressing, pressing + motions, weights.begin());
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
      for (std::size_t n = 0; n < motions; ++n) gram[a][b] += pressing[n] * gram_[9 * n + 3 * a + b];
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
    for (std::size_t n = 0; n < motions; ++n) weights[motions + motions * j + n] = motion[j][0] * pressing[n];
  }
  return true;
}

double ElasticContact::approach(const std::vector<double>& weights) const {
  const std::size_t motions = contact_.motions();
  double sum = contact_.map_motion()[0][motions];
  for (std::size_t n = 0; n < motions; ++n) sum += contact_.map_motion()[0][n] * weights[n];
  return sum;
}

void ElasticContact::nodal_forces(const Face& face, const SurfaceGrid& grid, const std::vector<double>& weights,
                                  Workspace& workspace, double* forces) const {
  const std::size_t cells = face.cells(), motions = contact_.motions();
  workspace.tractions.assign(3 * cells, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    double modes[2][3];
    shear_modes(points_[i], modes);
    double* traction = workspace.tractions.data() + 3 * i;
    for (std::size_t n = 0; n < motions; ++n) {
      const double pressure = contact_.map_forces()[i][n] / face.areas[i];
      traction[2] -= weights[n] * pressure;
      for (std::size_t j = 0; j < 3; ++j) {
        const double share = weights[motions + motions * j + n] * pressure;
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
