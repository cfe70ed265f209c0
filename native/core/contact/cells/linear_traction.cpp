#include "contact/cells/linear_traction.hpp"

#include <algorithm>
#include <utility>

#include "influence/edge_pieces.hpp"

namespace mjtactile {
namespace {

constexpr std::size_t kPowers = 4;  // powers of a local coordinate: quadratic shape function times linear traction
constexpr std::size_t kOwn = kPowers * kPowers;
// Number of Gauss points on [0, 1]. Four are exact, because an integrand along an edge has degree 7.
constexpr int kNodes = 4;
constexpr double kShapes[3][3] = {{0.0, -0.5, 0.5}, {1.0, 0.0, -1.0}, {0.0, 0.5, 0.5}};
// Integrals of xi^a over [-1, 1].
constexpr double kWhole[kPowers] = {2.0, 0.0, 2.0 / 3.0, 0.0};

constexpr double kPlaces[kNodes] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970262};
constexpr double kWeights[kNodes] = {0.17392742256872692, 0.3260725774312731, 0.3260725774312731, 0.17392742256872692};

}  // namespace

void LinearTraction::cover(const Face& face, const Placement& placement) {
  find_outline(face, placement, edges_);
  hull_.clear();
  for (const Point& corner : face.corners) hull_.push_back(placement(corner));
  integrals_ = integrals_of(edges_, edges_.front().start);
}

void LinearTraction::cover(std::vector<Segment> edges) {
  edges_ = std::move(edges);
  hull_.clear();
  integrals_ = edges_.empty() ? AreaIntegrals{} : integrals_of(edges_, edges_.front().start);
}

AreaIntegrals integrals_of(const std::vector<Segment>& edges, const Point& near) {
  AreaIntegrals own = {};
  for (const Segment& edge : edges) {
    own.add(triangle_integrals({edge.start.x - near.x, edge.start.y - near.y},
                               {edge.end.x - near.x, edge.end.y - near.y}));
  }
  return {own.area,
          own.x + near.x * own.area,
          own.y + near.y * own.area,
          own.xx + 2 * near.x * own.x + near.x * near.x * own.area,
          own.xy + near.x * own.y + near.y * own.x + near.x * near.y * own.area,
          own.yy + 2 * near.y * own.y + near.y * near.y * own.area};
}

void cut_where(const std::vector<Segment>& edges, const double* function, std::vector<Point>& meets,
               std::vector<Segment>& part) {
  part.clear();
  meets.clear();
  for (const Segment& edge : edges) {
    const double first = function[0] + function[1] * edge.start.x + function[2] * edge.start.y;
    const double second = function[0] + function[1] * edge.end.x + function[2] * edge.end.y;
    if (first < 0.0 && second < 0.0) continue;
    if ((first < 0.0) == (second < 0.0)) {
      part.push_back(edge);
      continue;
    }
    const Point meet = between(edge.start, edge.end, first / (first - second));
    meets.push_back(meet);
    part.push_back(first < 0.0 ? Segment{meet, edge.end} : Segment{edge.start, meet});
  }
  // The part's edges on the line itself, with the area on their left: from every second meeting point to the next.
  std::sort(meets.begin(), meets.end(), [&](const Point& a, const Point& b) {
    return function[2] * (a.x - b.x) - function[1] * (a.y - b.y) < 0.0;
  });
  for (std::size_t i = 0; i + 1 < meets.size(); i += 2) part.push_back({meets[i], meets[i + 1]});
}

void LinearTraction::keep_where(const double* function) {
  cut_where(edges_, function, meets_, cut_);
  edges_.swap(cut_);
  integrals_ = edges_.empty() ? AreaIntegrals{} : integrals_of(edges_, edges_.front().start);
}

bool LinearTraction::carry(const double* wrench, double* coefficients) const {
  if (!fit(wrench, coefficients)) return false;
  const double* pressure = coefficients + 6;
  for (const Point& corner : hull_) {
    if (pressure[0] + pressure[1] * corner.x + pressure[2] * corner.y > 0.0) return false;
  }
  return true;
}

bool LinearTraction::fit(const double* wrench, double* coefficients) const {
  const double normal = -wrench[2], area = integrals_.area;
  if (!(normal > 0.0 && area > 0.0)) return false;
  const double x = integrals_.x / area, y = integrals_.y / area;  // the centroid
  const double xx = (integrals_.xx - x * integrals_.x) / area, yy = (integrals_.yy - y * integrals_.y) / area;
  const double xy = (integrals_.xy - x * integrals_.y) / area;
  // Integrals of p x and p y about the centroid.
  const double moment_x = wrench[4] - x * normal, moment_y = -wrench[3] - y * normal;
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 0.0)) return false;
  double* pressure = coefficients + 6;
  pressure[1] = -(yy * moment_x - xy * moment_y) / (determinant * area);
  pressure[2] = -(xx * moment_y - xy * moment_x) / (determinant * area);
  pressure[0] = -normal / area - pressure[1] * x - pressure[2] * y;
  // Shear is a constant plus a rotation about the centroid.
  const double turn = (wrench[5] - (x * wrench[1] - y * wrench[0])) / (area * (xx + yy));
  const double shear[2] = {wrench[0] / area, wrench[1] / area};
  const double parts[6] = {shear[0] + turn * y, 0.0, -turn, shear[1] - turn * x, turn, 0.0};
  std::copy(parts, parts + 6, coefficients);
  return true;
}

void LinearTraction::nodal_forces(const SurfaceGrid& grid, const double* coefficients, double* forces) {
  const std::size_t columns = grid.x().size() - 1, rows = grid.y().size() - 1, width = grid.nodes_x();
  own_.assign(columns * rows * kOwn, 0.0);
  passing_.assign(columns * rows * kPowers, 0.0);
  for (const Segment& edge : edges_) {
    visit_pieces(grid.x(), grid.y(), edge.start, edge.end,
                 [&](const double* from, const double* to, std::size_t column, std::size_t row) {
                   add_piece(grid, from, to, column, row);
                 });
  }
  std::fill(forces, forces + 3 * width * grid.nodes_y(), 0.0);
  for (std::size_t row = 0; row < rows; ++row) {
    double right[kPowers] = {};
    for (std::size_t column = columns; column-- > 0;) {
      const double half_x = (grid.x()[column + 1] - grid.x()[column]) / 2;
      const double half_y = (grid.y()[row + 1] - grid.y()[row]) / 2;
      const double middle_x = grid.x()[column] + half_x, middle_y = grid.y()[row] + half_y;
      const double* own = own_.data() + (row * columns + column) * kOwn;
      double moments[kPowers][kPowers];
      for (std::size_t b = 0; b < kPowers; ++b) {
        for (std::size_t a = 0; a < kPowers; ++a) moments[b][a] = own[b * kPowers + a] + right[b] * half_x * kWhole[a];
      }
      for (std::size_t b = 0; b < kPowers; ++b) right[b] += passing_[(row * columns + column) * kPowers + b];
      if (moments[0][0] == 0.0) continue;
      for (std::size_t component = 0; component < 3; ++component) {
        const double* c = coefficients + 3 * component;
        const double constant = c[0] + c[1] * middle_x + c[2] * middle_y, along = c[1] * half_x, across = c[2] * half_y;
        for (std::size_t k = 0; k < 3; ++k) {
          for (std::size_t l = 0; l < 3; ++l) {
            double force = 0.0;
            for (std::size_t b = 0; b < 3; ++b) {
              for (std::size_t a = 0; a < 3; ++a) {
                force += kShapes[k][b] * kShapes[l][a] *
                         (constant * moments[b][a] + along * moments[b][a + 1] + across * moments[b + 1][a]);
              }
            }
            forces[((2 * row + k) * width + 2 * column + l) * 3 + component] += force;
          }
        }
      }
    }
  }
}

void LinearTraction::add_piece(const SurfaceGrid& grid, const double* start, const double* end, std::size_t column,
                               std::size_t row) {
  const double half_x = (grid.x()[column + 1] - grid.x()[column]) / 2;
  const double per_y = 2.0 / (grid.y()[row + 1] - grid.y()[row]);
  const std::size_t place = row * (grid.x().size() - 1) + column;
  double* own = own_.data() + place * kOwn;
  double* passing = passing_.data() + place * kPowers;
  for (int g = 0; g < kNodes; ++g) {
    const double x = start[0] + kPlaces[g] * (end[0] - start[0]);
    const double y = start[1] + kPlaces[g] * (end[1] - start[1]);
    const double xi = std::min(1.0, std::max(-1.0, (x - grid.x()[column]) / half_x - 1.0));
    const double eta = (y - grid.y()[row]) * per_y - 1.0;
    // Integrals of xi^a from the element's left boundary.
    double left[kPowers], power = xi, sign = -1.0;
    for (std::size_t a = 0; a < kPowers; ++a, power *= xi, sign = -sign) {
      left[a] = half_x * (power - sign) / static_cast<double>(a + 1);
    }
    double weight = (end[1] - start[1]) * kWeights[g];
    for (std::size_t b = 0; b < kPowers; ++b, weight *= eta) {
      passing[b] += weight;
      for (std::size_t a = 0; a < kPowers; ++a) own[b * kPowers + a] += weight * left[a];
    }
  }
}

}  // namespace mjtactile
