#include "influence/surface_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "linalg/kernels.hpp"

namespace mjtactile {
namespace {

constexpr int kPowers = 3;  // of a local coordinate in a quadratic shape function
constexpr int kForces = 3;
// Powers 1 to 3 of xi at an element's left end.
constexpr double kLeftEnd[kPowers] = {-1.0, 1.0, -1.0};
// Moments of an element: by force and power of eta those of powers of xi, and what passes it.
constexpr std::size_t kMoments = kForces * kPowers * (kPowers + 1);

// Elements along one axis on the way along an edge, and where, from 0 at its start to 1 at its end, the next one begins.
class Walk {
 public:
  Walk(const std::vector<double>& ends, double start, double direction)
      : ends_(ends), start_(start), direction_(direction) {
    // What starts on a line goes into the element that lies ahead.
    const auto after = direction < 0.0 ? std::lower_bound(ends.begin(), ends.end(), start)
                                       : std::upper_bound(ends.begin(), ends.end(), start);
    element_ = after - ends.begin() - 1;
    look_ahead();
  }

  double next() const { return next_; }
  bool within() const { return element_ >= 0 && element_ < last() + 1; }
  // The element, or the outermost one on this side.
  std::size_t nearest() const {
    return static_cast<std::size_t>(std::min(std::max(element_, std::ptrdiff_t{0}), last()));
  }
  void step() {
    element_ += direction_ < 0.0 ? -1 : 1;
    look_ahead();
  }

 private:
  std::ptrdiff_t last() const { return static_cast<std::ptrdiff_t>(ends_.size()) - 2; }
  void look_ahead() {
    const std::ptrdiff_t line = direction_ < 0.0 ? element_ : element_ + 1;
    const bool any = direction_ != 0.0 && line >= 0 && line <= last() + 1;
    next_ = any ? (ends_[static_cast<std::size_t>(line)] - start_) / direction_ : std::numeric_limits<double>::infinity();
  }

  const std::vector<double>& ends_;
  double start_, direction_, next_ = 0.0;
  std::ptrdiff_t element_;
};

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
  workspace.moments.resize(columns * rows * kMoments);
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

// Something runs in an element: only those from the first to the last such of a row are cleared, and gathered from.
void SurfaceGrid::reach(std::size_t row, std::size_t column, Workspace& workspace) const {
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

void SurfaceGrid::add_edge(const TractionEdge& edge, Workspace& workspace) const {
  const double direction[2] = {edge.end[0] - edge.start[0], edge.end[1] - edge.start[1]};
  if (direction[1] == 0.0) return;
  Walk columns(x_, edge.start[0], direction[0]), rows(y_, edge.start[1], direction[1]);
  double begin[2] = {edge.start[0], edge.start[1]}, last = 0.0;
  for (double at = 0.0; at < 1.0;) {
    at = std::min({columns.next(), rows.next(), 1.0});
    if (at > last) {
      const double finish[2] = {at == 1.0 ? edge.end[0] : edge.start[0] + at * direction[0],
                                at == 1.0 ? edge.end[1] : edge.start[1] + at * direction[1]};
      if (rows.within() && begin[1] != finish[1]) {
        add_piece(begin, finish, edge.traction, columns.nearest(), rows.nearest(), workspace);
      }
      begin[0] = finish[0];
      begin[1] = finish[1];
      last = at;
    }
    if (columns.next() == at) columns.step();
    if (rows.next() == at) rows.step();
  }
}

void SurfaceGrid::add_piece(const double* start, const double* end, const double* traction, std::size_t column,
                            std::size_t row, Workspace& workspace) const {
  reach(row, column, workspace);
  const double origin[2] = {x_[column], y_[row]};
  const double per[2] = {2.0 / (x_[column + 1] - x_[column]), 2.0 / (y_[row + 1] - y_[row])};
  const double* from = column == workspace.middle ? workspace.reference : kLeftEnd;
  kernels().add_edge_moments(start, end, origin, per, from, traction,
                             workspace.moments.data() + (row * (x_.size() - 1) + column) * kMoments);
}

void SurfaceGrid::gather(Workspace& workspace, double* forces) const {
  const std::size_t columns = x_.size() - 1, rows = y_.size() - 1, width = kForces * nodes_x();
  std::fill(forces, forces + width * nodes_y(), 0.0);
  for (std::size_t row = 0; row < rows; ++row) {
    if (workspace.first[row] > workspace.last[row]) continue;
    double right[kForces * kPowers] = {};
    // Left of all edges nothing is left to fill: those of closed polygons cancel.
    for (std::size_t column = workspace.last[row] + 1; column-- > workspace.first[row];) {
      double part[kPowers] = {};  // integrals of xi^a over what lies left of the reference
      if (column == workspace.middle) {
        for (int a = 0; a < kPowers; ++a) part[a] = (workspace.reference[a] - kLeftEnd[a]) / (a + 1);
      }
      kernels().add_element_forces(workspace.moments.data() + (row * columns + column) * kMoments,
                                   (x_[column + 1] - x_[column]) / 2, part, right, width,
                                   forces + 2 * row * width + 2 * kForces * column);
    }
  }
}

}  // namespace mjtactile
