#include "influence/surface_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace mjtactile {
namespace {

constexpr int kPowers = 3;  // of a local coordinate in a quadratic shape function
constexpr int kForces = 3;
constexpr double kThird = 1.0 / 3.0;
// Gauss points on [0, 1]: an integrand along an edge has degree 5.
const double kRoot = std::sqrt(0.6);
const double kNodes[3] = {0.5 - 0.5 * kRoot, 0.5, 0.5 + 0.5 * kRoot};
constexpr double kWeights[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
// Integrals of xi^a over [-1, 1].
constexpr double kWhole[kPowers] = {2.0, 0.0, 2.0 / 3.0};
// Powers 1 to 3 of xi at an element's left end.
constexpr double kLeftEnd[kPowers] = {-1.0, 1.0, -1.0};

// Forces stand in lanes of four, so that arithmetic is on all of them at once.
constexpr int kLanes = 4;
constexpr std::size_t kOwn = kLanes * kPowers * kPowers, kPassing = kLanes * kPowers;

// Of moments (kPowers) apart by `step`, the sums with the three quadratic shape functions on [-1, 1], lane by lane.
void on_shapes(const double* moments, std::size_t step, double sums[3][kLanes]) {
  for (int m = 0; m < kLanes; ++m) {
    const double first = moments[step + m], second = moments[2 * step + m];
    sums[0][m] = 0.5 * (second - first);
    sums[1][m] = moments[m] - second;
    sums[2][m] = 0.5 * (second + first);
  }
}

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

// Something runs in an element: only those from the first to the last such of a row are cleared, and gathered from.
void SurfaceGrid::reach(std::size_t row, std::size_t column, Workspace& workspace) const {
  std::size_t &first = workspace.first[row], &last = workspace.last[row];
  const auto clear = [&](std::size_t begin, std::size_t end) {
    const std::size_t place = row * (x_.size() - 1) + begin;
    std::fill_n(workspace.own.data() + place * kOwn, (end - begin) * kOwn, 0.0);
    std::fill_n(workspace.passing.data() + place * kPassing, (end - begin) * kPassing, 0.0);
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
  const double lanes[kLanes] = {traction[0], traction[1], traction[2], 0.0};
  for (int b = 0; b < kPowers; ++b) {
    for (int m = 0; m < kLanes; ++m) to_passing[kLanes * b + m] += lanes[m] * passing[b];
    for (int a = 0; a < kPowers; ++a, to_own += kLanes) {
      for (int m = 0; m < kLanes; ++m) to_own[m] += lanes[m] * own[b][a];
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
      double moments[kPowers * kPowers * kLanes];
      for (int b = 0; b < kPowers; ++b) {
        for (int a = 0; a < kPowers; ++a) {
          const int at = kLanes * (kPowers * b + a);
          for (int m = 0; m < kLanes; ++m) {
            moments[at + m] =
                own[at + m] + half * (right[kLanes * b + m] * kWhole[a] + passing[kLanes * b + m] * part[a]);
          }
        }
      }
      for (std::size_t i = 0; i < kPassing; ++i) right[i] += passing[i];
      double across[kPowers][3][kLanes];  // by power along x: sums with the shape functions along y
      for (int a = 0; a < kPowers; ++a) on_shapes(moments + kLanes * a, kLanes * kPowers, across[a]);
      for (std::size_t k = 0; k < 3; ++k) {
        double sums[3][kLanes];
        on_shapes(across[0][k], 3 * kLanes, sums);
        double* to = forces + ((2 * row + k) * width + 2 * column) * kForces;
        for (std::size_t l = 0; l < 3; ++l, to += kForces) {
          for (std::size_t m = 0; m < kForces; ++m) to[m] += sums[l][m];
        }
      }
    }
  }
}

}  // namespace mjtactile
