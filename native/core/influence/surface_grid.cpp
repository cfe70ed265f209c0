#include "influence/surface_grid.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

constexpr int kPowers = 3;  // of a local coordinate in a quadratic shape function
constexpr int kForces = 3;
constexpr double kThird = 1.0 / 3.0;
// Gauss points on [0, 1]: an integrand along an edge has degree 5.
const double kRoot = std::sqrt(0.6);
const double kNodes[3] = {0.5 - 0.5 * kRoot, 0.5, 0.5 + 0.5 * kRoot};
constexpr double kWeights[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
// Monomial coefficients of the three quadratic shape functions on [-1, 1].
constexpr double kShapes[3][kPowers] = {{0.0, -0.5, 0.5}, {1.0, 0.0, -1.0}, {0.0, 0.5, 0.5}};
// Integrals of xi^a over [-1, 1].
constexpr double kWhole[kPowers] = {2.0, 0.0, 2.0 / 3.0};
// Powers 1 to 3 of xi at an element's left end.
constexpr double kLeftEnd[kPowers] = {-1.0, 1.0, -1.0};

constexpr std::size_t kOwn = kForces * kPowers * kPowers, kPassing = kForces * kPowers;

// The element that holds a coordinate; the first or the last for what lies outside.
std::size_t element(const std::vector<double>& ends, double at) {
  const auto after = std::upper_bound(ends.begin() + 1, ends.end() - 1, at);
  return static_cast<std::size_t>(after - ends.begin()) - 1;
}

}  // namespace

SurfaceGrid::SurfaceGrid(std::vector<double> x, std::vector<double> y) : x_(std::move(x)), y_(std::move(y)) {}

void SurfaceGrid::traction_forces(const TractionEdge* edges, std::size_t count, Workspace& workspace,
                                  double* forces) const {
  const std::size_t columns = x_.size() - 1, rows = y_.size() - 1;
  workspace.own.resize(columns * rows * kOwn);
  workspace.passing.resize(columns * rows * kPassing);
  workspace.first.assign(rows, columns);
  workspace.last.assign(rows, 0);
  workspace.middle = count > 0 ? element(x_, edges[0].start[0]) : columns;
  set_reference(count > 0 ? edges[0].start[0] : low_x(), workspace);
  for (std::size_t i = 0; i < count; ++i) add_edge(edges[i], workspace);
  gather(workspace, forces);
}

// Areas in the element of the first edge are counted from that edge, in others from their left ends: of polygons much
// smaller than an element, areas as large as the element would leave few digits.
void SurfaceGrid::set_reference(double x, Workspace& workspace) const {
  if (workspace.middle >= x_.size() - 1) return;
  const double left = x_[workspace.middle], half = (x_[workspace.middle + 1] - left) / 2;
  const double xi = std::min(1.0, std::max(-1.0, (x - left) / half - 1.0));
  const double powers[kPowers] = {xi, xi * xi, xi * xi * xi};
  std::copy_n(powers, kPowers, workspace.reference);
}

// Only rows that something runs through are cleared, and gathered from.
void SurfaceGrid::begin_row(std::size_t row, Workspace& workspace) const {
  const std::size_t columns = x_.size() - 1;
  std::fill_n(workspace.own.begin() + static_cast<std::ptrdiff_t>(row * columns * kOwn), columns * kOwn, 0.0);
  std::fill_n(workspace.passing.begin() + static_cast<std::ptrdiff_t>(row * columns * kPassing), columns * kPassing,
              0.0);
}

void SurfaceGrid::add_edge(const TractionEdge& edge, Workspace& workspace) const {
  const double direction[2] = {edge.end[0] - edge.start[0], edge.end[1] - edge.start[1]};
  if (direction[1] == 0.0) return;
  std::vector<double>& crossings = workspace.crossings;
  crossings.clear();
  for (int axis = 0; axis < 2; ++axis) {
    const std::vector<double>& lines = axis == 0 ? x_ : y_;
    if (direction[axis] == 0.0) continue;
    const double low = std::min(edge.start[axis], edge.end[axis]), high = std::max(edge.start[axis], edge.end[axis]);
    for (auto line = std::lower_bound(lines.begin(), lines.end(), low); line != lines.end() && *line <= high; ++line) {
      const double at = (*line - edge.start[axis]) / direction[axis];
      if (at > 0.0 && at < 1.0) crossings.push_back(at);
    }
  }
  std::sort(crossings.begin(), crossings.end());
  crossings.push_back(1.0);
  double begin[2] = {edge.start[0], edge.start[1]}, last = 0.0;
  for (const double at : crossings) {
    if (at <= last) continue;
    const double finish[2] = {at == 1.0 ? edge.end[0] : edge.start[0] + at * direction[0],
                              at == 1.0 ? edge.end[1] : edge.start[1] + at * direction[1]};
    add_piece(begin, finish, edge.traction, workspace);
    begin[0] = finish[0];
    begin[1] = finish[1];
    last = at;
  }
}

void SurfaceGrid::add_piece(const double* start, const double* end, const double* traction,
                            Workspace& workspace) const {
  const double height = (start[1] + end[1]) / 2;
  if (!(height > low_y() && height < high_y()) || start[1] == end[1]) return;
  const std::size_t column = element(x_, (start[0] + end[0]) / 2), row = element(y_, height);
  if (workspace.first[row] > workspace.last[row]) begin_row(row, workspace);
  workspace.first[row] = std::min(workspace.first[row], column);
  workspace.last[row] = std::max(workspace.last[row], column);
  const double half_x = (x_[column + 1] - x_[column]) / 2;
  const double per_x = 1.0 / half_x, per_y = 2.0 / (y_[row + 1] - y_[row]);
  const double* from = column == workspace.middle ? workspace.reference : kLeftEnd;
  double own[kPowers][kPowers] = {}, passing[kPowers] = {};
  for (int g = 0; g < 3; ++g) {
    const double x = start[0] + kNodes[g] * (end[0] - start[0]), y = start[1] + kNodes[g] * (end[1] - start[1]);
    const double xi = std::min(1.0, std::max(-1.0, (x - x_[column]) * per_x - 1.0));
    const double eta = (y - y_[row]) * per_y - 1.0;
    const double square = xi * xi;
    const double left[kPowers] = {half_x * (xi - from[0]), half_x * (square - from[1]) * 0.5,
                                  half_x * (square * xi - from[2]) * kThird};
    double power = (end[1] - start[1]) * kWeights[g];
    for (int b = 0; b < kPowers; ++b, power *= eta) {
      passing[b] += power;
      for (int a = 0; a < kPowers; ++a) own[b][a] += power * left[a];
    }
  }
  const std::size_t place = row * (x_.size() - 1) + column;
  double* to_own = workspace.own.data() + place * kOwn;
  double* to_passing = workspace.passing.data() + place * kPassing;
  for (int m = 0; m < kForces; ++m) {
    if (traction[m] == 0.0) continue;
    for (int b = 0; b < kPowers; ++b) {
      to_passing[m * kPowers + b] += traction[m] * passing[b];
      for (int a = 0; a < kPowers; ++a) to_own[(m * kPowers + b) * kPowers + a] += traction[m] * own[b][a];
    }
  }
}

void SurfaceGrid::gather(Workspace& workspace, double* forces) const {
  const std::size_t columns = x_.size() - 1, rows = y_.size() - 1, width = nodes_x();
  std::fill(forces, forces + kForces * width * nodes_y(), 0.0);
  for (std::size_t row = 0; row < rows; ++row) {
    if (workspace.first[row] > workspace.last[row]) continue;
    double right[kPassing] = {};
    // Left of all edges nothing is left to fill: those of closed polygons cancel.
    for (std::size_t column = workspace.last[row] + 1; column-- > workspace.first[row];) {
      const double* own = workspace.own.data() + (row * columns + column) * kOwn;
      const double* passing = workspace.passing.data() + (row * columns + column) * kPassing;
      const double half = (x_[column + 1] - x_[column]) / 2;
      double part[kPowers] = {};  // integrals of xi^a over what lies left of the reference
      if (column == workspace.middle) {
        for (int a = 0; a < kPowers; ++a) part[a] = (workspace.reference[a] - kLeftEnd[a]) / (a + 1);
      }
      for (int m = 0; m < kForces; ++m) {
        double moments[kPowers][kPowers];
        bool any = false;
        for (int b = 0; b < kPowers; ++b) {
          for (int a = 0; a < kPowers; ++a) {
            moments[b][a] = own[(m * kPowers + b) * kPowers + a] +
                            half * (right[m * kPowers + b] * kWhole[a] + passing[m * kPowers + b] * part[a]);
            any = any || moments[b][a] != 0.0;
          }
        }
        for (int b = 0; b < kPowers; ++b) right[m * kPowers + b] += passing[m * kPowers + b];
        if (!any) continue;
        for (int k = 0; k < 3; ++k) {
          double along[kPowers];
          for (int a = 0; a < kPowers; ++a) {
            along[a] = kShapes[k][0] * moments[0][a] + kShapes[k][1] * moments[1][a] + kShapes[k][2] * moments[2][a];
          }
          for (int l = 0; l < 3; ++l) {
            const double force = kShapes[l][0] * along[0] + kShapes[l][1] * along[1] + kShapes[l][2] * along[2];
            forces[((2 * row + static_cast<std::size_t>(k)) * width + 2 * column + static_cast<std::size_t>(l)) *
                       kForces +
                   static_cast<std::size_t>(m)] += force;
          }
        }
      }
    }
  }
}

}  // namespace mjtactile
