#include "contact/cells/bent_cells.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/small.hpp"
#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

// Least pivot, over the largest, with which the loaded nodes can carry a correction of the wrench.
constexpr double kOpen = 1e-10;

}  // namespace

void BentCells::lay(const Face& face, const TangentPlane& plane) {
  plane_ = &plane;
  const std::size_t cells = face.cells();
  on_pad_.resize(2 * cells), positions_.resize(3 * cells), levers_.resize(2 * cells), slopes_.resize(2 * cells);
  stretches_.resize(cells), seen_.resize(3 * cells);
  for (std::size_t i = 0; i < cells; ++i) {
    const Point& at = face.centroids[i];
    const SeenSurface seen = plane.beyond(at.x, at.y);   // cells may extend beyond the pad's edge
    const double here[3] = {at.x, at.y, seen.height};
    double* position = positions_.data() + 3 * i;
    plane.out_of(here, position);
    for (std::size_t k = 0; k < 3; ++k) seen_[k * cells + i] = here[k];
    on_pad_[2 * i] = position[0], on_pad_[2 * i + 1] = position[1];
    for (std::size_t k = 0; k < 2; ++k) {
      slopes_[2 * i + k] = seen.slopes[k];
      levers_[2 * i + k] = here[k] + seen.height * seen.slopes[k];
    }
    stretches_[i] = std::sqrt(1.0 + seen.slopes[0] * seen.slopes[0] + seen.slopes[1] * seen.slopes[1]);
  }
  quadrature_.clear();
  for (const Point& at : face.quadrature) {
    const SeenSurface seen = plane.beyond(at.x, at.y);
    quadrature_.insert(quadrature_.end(), {seen.x, seen.y});
  }
}

void BentCells::along_plane(const double* pressing, double* along) const {
  std::fill(along, along + 3, 0.0);
  const std::size_t cells = stretches_.size();
  for (std::size_t i = 0; i < cells; ++i) {
    const double force = pressing[i], *slopes = slopes_.data() + 2 * i;
    along[0] += force * slopes[0];
    along[1] += force * slopes[1];
    along[2] += force * (seen_[i] * slopes[1] - seen_[cells + i] * slopes[0]);
  }
}

void BentCells::force_on(std::size_t cell, const CellForces& forces, double* on_pad) const {
  const double *own = forces.forces + 3 * cell, *slopes = slopes_.data() + 2 * cell;
  double leaning[3];
  forces.at(cell, leaning);
  // Shear is in the cell's own plane; pressing is along its normal (-slopes, 1), and leans along the tangent plane.
  const double here[3] = {leaning[0] - slopes[0] * own[2], leaning[1] - slopes[1] * own[2],
                          own[2] + slopes[0] * own[0] + slopes[1] * own[1]};
  plane_->turn_out_of(here, on_pad);
}

bool BentCells::nodal_forces(const Face& face, const SurfaceGrid& grid, const CellForces& forces, double* wrench,
                             Workspace& workspace, double* nodal) const {
  const std::size_t cells = face.cells();
  workspace.edges.clear();
  workspace.areas.assign(cells, 0.0);
  for (const CellEdge& edge : face.edges) {
    const SeenSurface start = plane_->beyond(edge.start.x, edge.start.y);
    const SeenSurface end = plane_->beyond(edge.end.x, edge.end.y);
    const TractionEdge on_pad = {{start.x, start.y}, {end.x, end.y}, {0.0, 0.0, 0.0}};
    // Areas of the polygons to which the cells project on the pad's plane.
    const double near[2] = {on_pad_[0], on_pad_[1]};
    const double cross = ((start.x - near[0]) * (end.y - near[1]) - (end.x - near[0]) * (start.y - near[1])) / 2;
    each_side(edge, [&](std::size_t cell, double sign) { workspace.areas[cell] += sign * cross; });
    workspace.edges.push_back(on_pad);
  }
  workspace.tractions.assign(3 * cells, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    double* traction = workspace.tractions.data() + 3 * i;
    force_on(i, forces, traction);
    for (int k = 0; k < 3; ++k) traction[k] = workspace.areas[i] > 0.0 ? traction[k] / workspace.areas[i] : 0.0;
  }
  std::size_t kept = 0;
  for (std::size_t e = 0; e < face.edges.size(); ++e) {
    TractionEdge on_pad = workspace.edges[e];
    if (face.edges[e].step(workspace.tractions, on_pad.traction)) workspace.edges[kept++] = on_pad;
  }
  grid.traction_forces(workspace.edges.data(), kept, workspace.grid, nodal);
  find_loaded_nodes(grid, nodal, workspace.nodes);
  return correct(workspace.nodes, wrench);
}

void BentCells::find_loaded_nodes(const SurfaceGrid& grid, double* nodal, std::vector<LoadedNode>& nodes) const {
  const double *origin = plane_->origin(), *normal = plane_->axes() + 6;
  nodes.clear();
  for (std::size_t row = 0; row < grid.nodes_y(); ++row) {
    for (std::size_t column = 0; column < grid.nodes_x(); ++column, nodal += 3) {
      if (nodal[0] == 0.0 && nodal[1] == 0.0 && nodal[2] == 0.0) continue;
      const double x = grid.node_x(column), y = grid.node_y(row);
      nodes.push_back({nodal, {x - origin[0], y - origin[1], plane_->surface().at(x, y).z - origin[2]},
                       std::abs(dot(nodal, normal))});
    }
  }
}

// Correct the resultant of nodal forces: each node gets a correction in proportion to its weight and to a rigid motion.
bool BentCells::correct(const std::vector<LoadedNode>& nodes, double* wrench) const {
  const double* origin = plane_->origin();
  double sum[6] = {}, all = 0.0, length = 0.0;
  for (const LoadedNode& node : nodes) {
    double moment[3];
    cross(node.arm, node.force, moment);
    for (int k = 0; k < 3; ++k) {
      sum[k] += node.force[k];
      sum[3 + k] += moment[k];
      length += node.weight * node.arm[k] * node.arm[k];
    }
    all += node.weight;
  }
  if (!(all > 0.0)) return false;
  length = std::max(std::sqrt(length / all), 1e-9);
  // Motions are three translations and three rotations about the plane's origin, with arms divided by the length. Their
  // Gram matrix follows from the first and second moments of the weights.
  double first[3] = {}, second[3][3] = {};
  for (const LoadedNode& node : nodes) {
    for (int i = 0; i < 3; ++i) {
      const double one = node.weight / all * node.arm[i] / length;
      first[i] += one;
      for (int j = 0; j < 3; ++j) second[i][j] += one * node.arm[j] / length;
    }
  }
  const double squares = second[0][0] + second[1][1] + second[2][2];
  double gram[36] = {};
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3, last = (i + 2) % 3;
    gram[7 * i] = 1.0;
    // A rotation about axis i moves a point along the next axis by minus its last coordinate, and along the last axis
    // by its next coordinate.
    gram[6 * next + 3 + i] = gram[6 * (3 + i) + next] = -first[last];
    gram[6 * last + 3 + i] = gram[6 * (3 + i) + last] = first[next];
    for (std::size_t j = 0; j < 3; ++j) gram[6 * (3 + i) + 3 + j] = (i == j ? squares : 0.0) - second[i][j];
  }
  double left[6], moment[3];   // missing force and moment, about the plane's origin
  cross(origin, wrench, moment);
  for (int k = 0; k < 3; ++k) {
    left[k] = (wrench[k] - sum[k]) / all;
    left[3 + k] = (wrench[3 + k] - moment[k] - sum[3 + k]) / (all * length);
  }
  if (!solve_small(6, gram, left, 1, kOpen)) {
    for (int k = 0; k < 3; ++k) {
      wrench[k] = sum[k];
      wrench[3 + k] = sum[3 + k] + origin[(k + 1) % 3] * sum[(k + 2) % 3] - origin[(k + 2) % 3] * sum[(k + 1) % 3];
    }
    return false;
  }
  for (const LoadedNode& node : nodes) {
    double turned[3];
    cross(left + 3, node.arm, turned);
    for (int k = 0; k < 3; ++k) node.force[k] += node.weight * (left[k] + turned[k] / length);
  }
  return true;
}

}  // namespace mjtactile
