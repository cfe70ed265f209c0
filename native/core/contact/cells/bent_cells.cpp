#include "contact/cells/bent_cells.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/small.hpp"

namespace mjtactile {
namespace {

// Motions that the loaded nodes resist this much less than others are not corrected.
constexpr double kOpen = 1e-10;

}  // namespace

void BentCells::lay(const Face& face, const TangentPlane& plane) {
  plane_ = &plane;
  const std::size_t cells = face.cells();
  on_pad_.resize(2 * cells), positions_.resize(3 * cells), levers_.resize(2 * cells), slopes_.resize(2 * cells);
  stretches_.resize(cells), places_.resize(3 * cells);
  for (std::size_t i = 0; i < cells; ++i) {
    const Point& at = face.centroids[i];
    const SeenSurface seen = plane.beyond(at.x, at.y);   // cells may reach over the pad's edge
    const double here[3] = {at.x, at.y, seen.height};
    double* position = positions_.data() + 3 * i;
    plane.out_of(here, position);
    std::copy(here, here + 3, places_.data() + 3 * i);
    on_pad_[2 * i] = position[0], on_pad_[2 * i + 1] = position[1];
    for (std::size_t k = 0; k < 2; ++k) {
      slopes_[2 * i + k] = seen.slopes[k];
      levers_[2 * i + k] = here[k] + seen.height * seen.slopes[k];
    }
    stretches_[i] = std::sqrt(1.0 + seen.slopes[0] * seen.slopes[0] + seen.slopes[1] * seen.slopes[1]);
  }
}

void BentCells::along_plane(const double* pressing, double* along) const {
  std::fill(along, along + 3, 0.0);
  for (std::size_t i = 0; i < stretches_.size(); ++i) {
    const double force = pressing[i], *slopes = slopes_.data() + 2 * i, *at = places_.data() + 3 * i;
    along[0] += force * slopes[0];
    along[1] += force * slopes[1];
    along[2] += force * (at[0] * slopes[1] - at[1] * slopes[0]);
  }
}

void BentCells::force_on(std::size_t cell, const double* force, double* on_pad) const {
  const double* slopes = slopes_.data() + 2 * cell;
  // Shear lies in the cell, the pressing along its normal (-slopes, 1).
  const double here[3] = {force[0] - slopes[0] * force[2], force[1] - slopes[1] * force[2],
                          force[2] + slopes[0] * force[0] + slopes[1] * force[1]};
  plane_->turn_out_of(here, on_pad);
}

bool BentCells::nodal_forces(const Face& face, const SurfaceGrid& grid, const double* forces, double* wrench,
                             Workspace& workspace, double* nodal) const {
  const std::size_t cells = face.cells();
  workspace.edges.clear();
  workspace.areas.assign(cells, 0.0);
  const auto place = [](std::int32_t cell) { return static_cast<std::size_t>(cell); };
  for (const CellEdge& edge : face.edges) {
    TractionEdge step = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (const bool first : {true, false}) {
      const double* end = first ? edge.start : edge.end;
      const SeenSurface seen = plane_->beyond(end[0], end[1]);
      double* to = first ? step.start : step.end;
      to[0] = seen.x, to[1] = seen.y;
    }
    // Of the polygons that the cells are on the pad's plane.
    const double near[2] = {on_pad_[0], on_pad_[1]};
    const double cross = ((step.start[0] - near[0]) * (step.end[1] - near[1]) -
                          (step.end[0] - near[0]) * (step.start[1] - near[1])) / 2;
    if (edge.left >= 0) workspace.areas[place(edge.left)] += cross;
    if (edge.right >= 0) workspace.areas[place(edge.right)] -= cross;
    workspace.edges.push_back(step);
  }
  workspace.tractions.assign(3 * cells, 0.0);
  for (std::size_t i = 0; i < cells; ++i) {
    double* traction = workspace.tractions.data() + 3 * i;
    force_on(i, forces + 3 * i, traction);
    for (int k = 0; k < 3; ++k) traction[k] = workspace.areas[i] > 0.0 ? traction[k] / workspace.areas[i] : 0.0;
  }
  std::size_t kept = 0;
  for (std::size_t e = 0; e < face.edges.size(); ++e) {
    const CellEdge& edge = face.edges[e];
    TractionEdge step = workspace.edges[e];
    bool stepped = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const double left = edge.left < 0 ? 0.0 : workspace.tractions[3 * place(edge.left) + k];
      const double right = edge.right < 0 ? 0.0 : workspace.tractions[3 * place(edge.right) + k];
      step.traction[k] = left - right;
      stepped = stepped || step.traction[k] != 0.0;
    }
    if (stepped) workspace.edges[kept++] = step;
  }
  grid.traction_forces(workspace.edges.data(), kept, workspace.grid, nodal);
  return correct(grid, wrench, nodal);
}

// Loaded nodes take what is left of the wrench as a rigid motion of what each carries.
bool BentCells::correct(const SurfaceGrid& grid, double* wrench, double* nodal) const {
  const std::size_t columns = grid.nodes_x(), rows = grid.nodes_y();
  const auto node = [](const std::vector<double>& ends, std::size_t number) {
    return number % 2 == 0 ? ends[number / 2] : (ends[number / 2] + ends[number / 2 + 1]) / 2;
  };
  const double *origin = plane_->origin(), *normal = plane_->axes() + 6;
  double sum[6] = {}, gram[36] = {}, all = 0.0, length = 0.0;
  const auto visit = [&](auto&& each) {
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t column = 0; column < columns; ++column) {
        double* force = nodal + 3 * (row * columns + column);
        if (force[0] == 0.0 && force[1] == 0.0 && force[2] == 0.0) continue;
        const double x = node(grid.x(), column), y = node(grid.y(), row);
        const double arm[3] = {x - origin[0], y - origin[1], plane_->surface().at(x, y).z - origin[2]};
        each(force, arm, std::abs(force[0] * normal[0] + force[1] * normal[1] + force[2] * normal[2]));
      }
    }
  };
  visit([&](double* force, const double* arm, double weight) {
    for (int k = 0; k < 3; ++k) {
      sum[k] += force[k];
      sum[3 + k] += arm[(k + 1) % 3] * force[(k + 2) % 3] - arm[(k + 2) % 3] * force[(k + 1) % 3];
      length += weight * arm[k] * arm[k];
    }
    all += weight;
  });
  if (!(all > 0.0)) return false;
  length = std::max(std::sqrt(length / all), 1e-9);
  // Motions: three translations and three turns about the plane's point, over the length.
  visit([&](double*, const double* arm, double weight) {
    const double x = arm[0] / length, y = arm[1] / length, z = arm[2] / length;
    const double moved[3][6] = {{1, 0, 0, 0, z, -y}, {0, 1, 0, -z, 0, x}, {0, 0, 1, y, -x, 0}};
    for (std::size_t a = 0; a < 6; ++a) {
      for (std::size_t b = 0; b < 6; ++b) {
        for (int k = 0; k < 3; ++k) gram[6 * a + b] += weight / all * moved[k][a] * moved[k][b];
      }
    }
  });
  double left[6];   // about the plane's point
  for (int k = 0; k < 3; ++k) {
    const double moment = origin[(k + 1) % 3] * wrench[(k + 2) % 3] - origin[(k + 2) % 3] * wrench[(k + 1) % 3];
    left[k] = (wrench[k] - sum[k]) / all;
    left[3 + k] = (wrench[3 + k] - moment - sum[3 + k]) / (all * length);
  }
  if (!solve_small(6, gram, left, 1, kOpen)) {
    for (int k = 0; k < 3; ++k) {
      wrench[k] = sum[k];
      wrench[3 + k] = sum[3 + k] + origin[(k + 1) % 3] * sum[(k + 2) % 3] - origin[(k + 2) % 3] * sum[(k + 1) % 3];
    }
    return false;
  }
  visit([&](double* force, const double* arm, double weight) {
    const double x = arm[0] / length, y = arm[1] / length, z = arm[2] / length;
    force[0] += weight * (left[0] + z * left[4] - y * left[5]);
    force[1] += weight * (left[1] - z * left[3] + x * left[5]);
    force[2] += weight * (left[2] + y * left[3] - x * left[4]);
  });
  return true;
}

}  // namespace mjtactile
