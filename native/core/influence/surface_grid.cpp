#include "influence/surface_grid.hpp"

#include <algorithm>
#include <cstddef>

#include "influence/edge_pieces.hpp"
#include "linalg/kernels.hpp"

namespace mjtactile {
namespace {

constexpr int kPowers = 3;  // powers of the local coordinate (xi or eta) in a quadratic shape function
constexpr int kForces = 3;
// Powers 1 to 3 of xi at an element's left end.
constexpr double kLeftEnd[kPowers] = {-1.0, 1.0, -1.0};
// Moments of an element: for each force component and power of eta, one for each power of xi, and one of the edges to
// its right.
constexpr std::size_t kMoments = kForces * kPowers * (kPowers + 1);

// The element that contains a coordinate; beside the sheet, the first or last one.
std::size_t element(const std::vector<double>& ends, double at) {
  const auto after = std::upper_bound(ends.begin() + 1, ends.end() - 1, at);
  return static_cast<std::size_t>(after - ends.begin()) - 1;
}

}  // namespace

SurfaceGrid::SurfaceGrid(std::vector<double> x, std::vector<double> y) : x_(std::move(x)), y_(std::move(y)) {}

void SurfaceGrid::traction_forces(const TractionEdge* edges, std::size_t count, Workspace& workspace,
                                  double* forces) const {
  const std::size_t columns = x_.size() - 1, rows = y_.size() - 1;
  workspace.moments.resize(columns * rows * kMoments);
  workspace.first.assign(rows, columns);
  workspace.last.assign(rows, 0);
  workspace.reference_column = count > 0 ? element(x_, edges[0].start.x) : columns;
  set_reference(count > 0 ? edges[0].start.x : x_.front(), workspace);
  for (std::size_t i = 0; i < count; ++i) {
    visit_pieces(x_, y_, edges[i].start, edges[i].end,
                 [&](const double* start, const double* end, std::size_t column, std::size_t row) {
                   add_piece(start, end, edges[i].traction, column, row, workspace);
                 });
  }
  sum_elements(workspace, forces);
}

// Areas are counted from the left boundary of an element, but from the first edge in the column that contains it. For
// polygons much smaller than an element, differences of areas as large as the element would lose most digits.
void SurfaceGrid::set_reference(double x, Workspace& workspace) const {
  if (workspace.reference_column >= x_.size() - 1) return;
  const double left = x_[workspace.reference_column], half = (x_[workspace.reference_column + 1] - left) / 2;
  const double xi = std::min(1.0, std::max(-1.0, (x - left) / half - 1.0));
  const double powers[kPowers] = {xi, xi * xi, xi * xi * xi};
  std::copy_n(powers, kPowers, workspace.reference);
}

// Extend the row's range of elements by one that contains an edge. Only elements in this range are cleared and summed.
void SurfaceGrid::include(std::size_t row, std::size_t column, Workspace& workspace) const {
  std::size_t &first = workspace.first[row], &last = workspace.last[row];
  const auto clear = [&](std::size_t begin, std::size_t end) {
    const std::size_t place = row * (x_.size() - 1) + begin;
    std::fill_n(workspace.moments.data() + place * kMoments, (end - begin) * kMoments, 0.0);
  };
  if (first > last) {
    clear(column, column + 1);
    first = last = column;
  } else if (column < first) {
    clear(column, first);
    first = column;
  } else if (column > last) {
    clear(last + 1, column + 1);
    last = column;
  }
}

void SurfaceGrid::add_piece(const double* start, const double* end, const double* traction, std::size_t column,
                            std::size_t row, Workspace& workspace) const {
  include(row, column, workspace);
  const double origin[2] = {x_[column], y_[row]};
  const double per[2] = {2.0 / (x_[column + 1] - x_[column]), 2.0 / (y_[row + 1] - y_[row])};
  const double* from = column == workspace.reference_column ? workspace.reference : kLeftEnd;
  kernels().add_edge_moments(start, end, origin, per, from, traction,
                             workspace.moments.data() + (row * (x_.size() - 1) + column) * kMoments);
}

void SurfaceGrid::sum_elements(Workspace& workspace, double* forces) const {
  const std::size_t columns = x_.size() - 1, rows = y_.size() - 1, width = kForces * nodes_x();
  std::fill(forces, forces + width * nodes_y(), 0.0);
  for (std::size_t row = 0; row < rows; ++row) {
    if (workspace.first[row] > workspace.last[row]) continue;
    double right[kForces * kPowers] = {};
    // Elements left of all edges need nothing: the contributions of a closed polygon's edges cancel there.
    for (std::size_t column = workspace.last[row] + 1; column-- > workspace.first[row];) {
      double part[kPowers] = {};  // integrals of xi^a from the left boundary to the reference
      if (column == workspace.reference_column) {
        for (int a = 0; a < kPowers; ++a) part[a] = (workspace.reference[a] - kLeftEnd[a]) / (a + 1);
      }
      kernels().add_element_forces(workspace.moments.data() + (row * columns + column) * kMoments,
                                   (x_[column + 1] - x_[column]) / 2, part, right, width,
                                   forces + 2 * row * width + 2 * kForces * column);
    }
  }
}

}  // namespace mjtactile
