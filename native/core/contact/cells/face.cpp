#include "contact/cells/face.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/vectors.hpp"

namespace mjtactile {

bool CellEdge::step(const std::vector<double>& tractions, double* step) const {
  bool steps = false;
  for (int k = 0; k < 3; ++k) {
    const double of_left = left < 0 ? 0.0 : tractions[static_cast<std::size_t>(3 * left + k)];
    const double of_right = right < 0 ? 0.0 : tractions[static_cast<std::size_t>(3 * right + k)];
    step[k] = of_left - of_right;
    steps = steps || step[k] != 0.0;
  }
  return steps;
}

void add_edge(const CellEdge& edge, std::vector<CellEdge>& edges) {
  if (edge.start.x != edge.end.x || edge.start.y != edge.end.y) edges.push_back(edge);
}

void add_quadrature(const Point& middle, const Point& axis, double along, double across, std::vector<Point>& points) {
  for (const double sign : {1.0, -1.0}) {
    points.push_back({middle.x + sign * along * axis.x, middle.y + sign * along * axis.y});
    points.push_back({middle.x - sign * across * axis.y, middle.y + sign * across * axis.x});
  }
}

bool place(const FacePlane& face, const Pose& pose, Placement& placement) {
  double turn[9];  // from the face's frame to the pad's: pose.rotation * face.rotation^T
  rotate_from(pose.rotation, face.rotation, turn);
  if (!(turn[8] > 0.0) || std::hypot(turn[6], turn[7]) > face.most_slope * turn[8]) return false;
  const double c = turn[0] + turn[4], s = turn[3] - turn[1], size = std::hypot(c, s);
  placement.cosine = c / size;
  placement.sine = s / size;
  for (int i = 0; i < 2; ++i) placement.shift[i] = pose.position[i] + turn[3 * i + 2] * face.height;
  return true;
}

void find_outline(const Face& face, const Placement& placement, std::vector<Segment>& outline) {
  outline.clear();
  for (const CellEdge& edge : face.edges) {
    if ((edge.left >= 0) == (edge.right >= 0)) continue;
    const Point start = placement(edge.start), end = placement(edge.end);
    outline.push_back(edge.left >= 0 ? Segment{start, end} : Segment{end, start});
  }
}

void bound_stress(const Face& cells, double strength, double* forces) {
  for (std::size_t i = 0; strength > 0.0 && i < cells.cells(); ++i) {
    double* force = forces + 3 * i;
    const double most = strength * cells.areas[i];
    const double shear = std::hypot(force[0], force[1]);
    force[2] = std::min(std::max(force[2], -most), most);
    const double bound = std::sqrt(std::max(most * most - force[2] * force[2], 0.0) / 3.0);
    if (shear > bound) force[0] *= bound / shear, force[1] *= bound / shear;
  }
}

void nodal_forces(const Face& face, const Placement& placement, const SurfaceGrid& grid, const CellForces& forces,
                  TractionWork& work, double* nodal) {
  work.tractions.resize(3 * face.cells());
  for (std::size_t i = 0; i < face.cells(); ++i) {
    double* traction = work.tractions.data() + 3 * i;
    forces.at(i, traction);
    for (std::size_t k = 0; k < 3; ++k) traction[k] /= face.areas[i];
  }
  work.edges.clear();
  for (const CellEdge& edge : face.edges) {
    TractionEdge on_pad;
    if (!edge.step(work.tractions, on_pad.traction)) continue;
    on_pad.start = placement(edge.start), on_pad.end = placement(edge.end);
    work.edges.push_back(on_pad);
  }
  grid.traction_forces(work.edges.data(), work.edges.size(), work.grid, nodal);
}

InclinedPlane plane_of(const FacePlane& face, const Pose& pose) {
  double normal[3], point[3];
  rotate(pose.rotation, face.rotation + 6, normal);
  for (int i = 0; i < 3; ++i) point[i] = pose.position[i] + normal[i] * face.height;
  const double x = -normal[0] / normal[2], y = -normal[1] / normal[2];
  return {{x, y}, point[2] - x * point[0] - y * point[1]};
}

}  // namespace mjtactile
