#include "lattice.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// As the readable reference has them: mjtactile/region.py and mjtactile/lattice.py.
constexpr double kElongated = 1.5;
constexpr double kLongest = 5.0;
constexpr double kFar = 16.0, kFarFromCut = 6.0;
constexpr double kMostRounding = 1e-9;
// Cells of which the sheet leaves less than this share are dropped.
constexpr double kLeastShare = 1e-2;

// a b^2 asinh(a / |b|), and its limit 0 where b vanishes.
double half(double a, double b) {
  b = std::abs(b);
  return b > 0.0 ? a * b * b * std::asinh(a / b) : 0.0;
}

// 1/r integrated twice along each axis.
double antiderivative(double x, double y) {
  const double r = std::hypot(x, y);
  return 0.5 * (half(x, y) + half(y, x)) - r * r * r / 6.0;
}

// Taylor series about the distance of the middles, for rectangles that lie far apart.
double far_integral(double x, double y, const double* a, const double* b) {
  const double square = x * x + y * y;
  const double bend = ((a[0] * a[0] + a[1] * a[1]) * (3.0 * x * x - square) +
                       (b[0] * b[0] + b[1] * b[1]) * (3.0 * y * y - square)) /
                      (24.0 * square * square);
  return a[0] * a[1] * b[0] * b[1] / std::sqrt(square) * (1.0 + bend);
}

// How far a point lies to the left of the line through two others, times their distance.
double left_of(const Point& a, const Point& b, const Point& point) {
  return (b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x);
}

}  // namespace

double inverse_distance(double x, double y, const double* a, const double* b) {
  const double away = kFarFromCut * std::max({a[0], a[1], b[0], b[1]});
  if (x * x + y * y > away * away) return far_integral(x, y, a, b);
  const double along[4] = {(a[0] + a[1]) / 2, -(a[0] + a[1]) / 2, (a[0] - a[1]) / 2, -(a[0] - a[1]) / 2};
  const double across[4] = {(b[0] + b[1]) / 2, -(b[0] + b[1]) / 2, (b[0] - b[1]) / 2, -(b[0] - b[1]) / 2};
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      const double sign = (i < 2) == (j < 2) ? 1.0 : -1.0;
      sum += sign * antiderivative(x + along[i], y + across[j]);
    }
  }
  return sum;
}

void inverse_distance_by_offset(std::size_t columns, std::size_t rows, double width, double height,
                                std::vector<double>& table) {
  constexpr double kSecondDifference[3] = {1.0, -2.0, 1.0};
  const double a[2] = {width, width}, b[2] = {height, height}, away = kFar * std::max(width, height);
  // Neighbours share the points of their differences.
  std::vector<double> values((columns + 2) * (rows + 2));
  for (std::size_t row = 0; row < rows + 2; ++row) {
    for (std::size_t column = 0; column < columns + 2; ++column) {
      values[row * (columns + 2) + column] =
          antiderivative((static_cast<double>(column) - 1.0) * width, (static_cast<double>(row) - 1.0) * height);
    }
  }
  table.resize(columns * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const double x = static_cast<double>(column) * width, y = static_cast<double>(row) * height;
      double& entry = table[row * columns + column];
      if (x * x + y * y > away * away) {
        entry = far_integral(x, y, a, b);
        continue;
      }
      entry = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          entry += kSecondDifference[i] * kSecondDifference[j] * values[(row + j) * (columns + 2) + column + i];
        }
      }
    }
  }
}

Point Lattice::at(double column, double row) const {
  const double x = (column - static_cast<double>(columns) / 2) * size;
  const double y = (row - static_cast<double>(rows) / 2) * width();
  return {cosine * x - sine * y + centre.x, sine * x + cosine * y + centre.y};
}

bool Lattice::cell_at(const Point& point, std::uint32_t& cell) const {
  const double x = cosine * (point.x - centre.x) + sine * (point.y - centre.y);
  const double y = -sine * (point.x - centre.x) + cosine * (point.y - centre.y);
  const double column = std::floor(x / size + static_cast<double>(columns) / 2);
  const double row = std::floor(y / width() + static_cast<double>(rows) / 2);
  if (!(column >= 0.0 && row >= 0.0 && column < static_cast<double>(columns) && row < static_cast<double>(rows))) {
    return false;
  }
  cell = static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(columns) + static_cast<std::uint32_t>(column);
  return true;
}

double Region::stretch() const {
  return std::exp2(std::min(std::max(std::floor(std::log2(width / height) + kMostRounding), 0.0), kLongest));
}

Lattice Region::lattice(std::size_t count) const {
  const double longer = stretch(), stretched = height * longer;
  const double size = std::sqrt(width * stretched / static_cast<double>(count));
  const auto cells = [size](double extent) {
    return std::max(std::size_t{2}, static_cast<std::size_t>(std::ceil(extent / size - kMostRounding)));
  };
  const std::size_t columns = cells(width), rows = cells(stretched);
  const double fitting = std::max(width / static_cast<double>(columns), stretched / static_cast<double>(rows));
  return {centre, angle, fitting, longer, columns, rows, std::cos(angle), std::sin(angle)};
}

Region Region::around(const Lattice& lattice, const std::vector<Point>& pressed) const {
  const double count = static_cast<double>(pressed.size());
  const double sides[2] = {lattice.size, lattice.width()};
  const double c = lattice.cosine, s = lattice.sine;
  Point middle = {0.0, 0.0};
  for (const Point& point : pressed) middle.x += point.x / count, middle.y += point.y / count;
  double xx = (c * c * sides[0] * sides[0] + s * s * sides[1] * sides[1]) / 12;
  double yy = (s * s * sides[0] * sides[0] + c * c * sides[1] * sides[1]) / 12;
  double xy = c * s * (sides[0] * sides[0] - sides[1] * sides[1]) / 12;
  for (const Point& point : pressed) {
    const double x = point.x - middle.x, y = point.y - middle.y;
    xx += x * x / count, xy += x * y / count, yy += y * y / count;
  }
  const double mean = (xx + yy) / 2, apart = std::hypot((xx - yy) / 2, xy);
  double turned = angle;
  if (mean + apart > kElongated * kElongated * (mean - apart)) turned = 0.5 * std::atan2(2.0 * xy, xx - yy);
  const double cosine = std::cos(turned), sine = std::sin(turned);
  // Half extents of one cell, seen along the new axes, and as much again.
  const double along = std::abs(cosine * c + sine * s), across = std::abs(cosine * s - sine * c);
  const double margin[2] = {1.5 * (along * sides[0] + across * sides[1]), 1.5 * (across * sides[0] + along * sides[1])};
  double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
  for (const Point& point : pressed) {
    const double place[2] = {cosine * point.x + sine * point.y, -sine * point.x + cosine * point.y};
    for (int i = 0; i < 2; ++i) {
      low[i] = std::min(low[i], place[i] - margin[i]);
      high[i] = std::max(high[i], place[i] + margin[i]);
    }
  }
  const double x = (low[0] + high[0]) / 2, y = (low[1] + high[1]) / 2;
  return {{cosine * x - sine * y, sine * x + cosine * y}, turned, high[0] - low[0], high[1] - low[1]};
}

bool holds(const std::vector<Point>& outline, const Point& point, double margin) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Point &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double least = margin > 0.0 ? margin * std::hypot(b.x - a.x, b.y - a.y) : 0.0;
    if (!(left_of(a, b, point) >= least)) return false;
  }
  return true;
}

// Sutherland and Hodgman's way, one side after the other.
void clip(const std::vector<Point>& corners, const std::vector<Point>& outline, std::vector<Point>& result) {
  std::vector<Point> before;
  result = corners;
  for (std::size_t side = 0; side < outline.size() && !result.empty(); ++side) {
    const Point &from = outline[side], &to = outline[(side + 1) % outline.size()];
    before.swap(result);
    result.clear();
    for (std::size_t i = 0; i < before.size(); ++i) {
      const Point &a = before[i], &b = before[(i + 1) % before.size()];
      const double in_a = left_of(from, to, a), in_b = left_of(from, to, b);
      if (in_a >= 0.0) result.push_back(a);
      if ((in_a > 0.0 && in_b < 0.0) || (in_a < 0.0 && in_b > 0.0)) {
        const double part = in_a / (in_a - in_b);
        result.push_back({a.x + part * (b.x - a.x), a.y + part * (b.y - a.y)});
      }
    }
  }
}

bool LatticeFace::make(const Lattice& lattice, const std::vector<std::uint32_t>& kept,
                       const std::vector<Point>& outline) {
  lattice_ = lattice;
  kept_.clear();
  face_.edges.clear();
  face_.centroids.clear();
  face_.areas.clear();
  quadrature_.clear();
  rims_.clear();
  rim_corners_.clear();
  cut_.clear();
  sides_.clear();
  place_.assign(lattice.cells(), -1);
  const double arms[2] = {lattice.size / std::sqrt(6.0), lattice.width() / std::sqrt(6.0)};
  double area = 0.0;
  for (const std::uint32_t cell : kept) {
    const auto column = static_cast<double>(cell % lattice.columns), row = static_cast<double>(cell / lattice.columns);
    corners_ = {lattice.at(column, row), lattice.at(column + 1, row), lattice.at(column + 1, row + 1),
                lattice.at(column, row + 1)};
    const bool whole = std::all_of(corners_.begin(), corners_.end(),
                                   [&outline](const Point& corner) { return holds(outline, corner); });
    if (whole) {
      const Point middle = lattice.at(column + 0.5, row + 0.5);
      face_.centroids.push_back(middle);
      face_.areas.push_back(lattice.size * lattice.width());
      sides_.insert(sides_.end(), {lattice.size, lattice.width()});
      const double along[2] = {lattice.cosine * arms[0], lattice.sine * arms[0]};
      const double across[2] = {-lattice.sine * arms[1], lattice.cosine * arms[1]};
      for (const double sign : {1.0, -1.0}) {
        quadrature_.push_back({middle.x + sign * along[0], middle.y + sign * along[1]});
        quadrature_.push_back({middle.x + sign * across[0], middle.y + sign * across[1]});
      }
    } else if (!add_cut_cell(outline)) {
      continue;
    }
    rims_.push_back(rim_corners_.size());
    if (!whole) rim_corners_.insert(rim_corners_.end(), clipped_.begin(), clipped_.end());
    place_[cell] = static_cast<std::int32_t>(kept_.size());
    kept_.push_back(cell);
    cut_.push_back(whole ? 0 : 1);
    area += face_.areas.back();
  }
  face_.length = std::sqrt(area);
  face_.hull = convex_hull(face_.centroids);
  integrate();
  return !kept_.empty();
}

bool LatticeFace::add_cut_cell(const std::vector<Point>& outline) {
  clip(corners_, outline, clipped_);
  // About the first corner, in the lattice's axes.
  const double c = lattice_.cosine, s = lattice_.sine;
  double area = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < clipped_.size(); ++i) {
    const Point &a = clipped_[i], &b = clipped_[(i + 1) % clipped_.size()];
    const double ax = c * (a.x - corners_[0].x) + s * (a.y - corners_[0].y);
    const double ay = -s * (a.x - corners_[0].x) + c * (a.y - corners_[0].y);
    const double bx = c * (b.x - corners_[0].x) + s * (b.y - corners_[0].y);
    const double by = -s * (b.x - corners_[0].x) + c * (b.y - corners_[0].y);
    const double cross = ax * by - bx * ay;
    area += cross / 2;
    x += (ax + bx) * cross / 6, y += (ay + by) * cross / 6;
    xx += (ax * ax + ax * bx + bx * bx) * cross / 12;
    yy += (ay * ay + ay * by + by * by) * cross / 12;
    xy += (ax * by + 2 * ax * ay + 2 * bx * by + bx * ay) * cross / 24;
  }
  if (!(area > kLeastShare * lattice_.size * lattice_.width())) return false;
  x /= area, y /= area;
  xx = xx / area - x * x, yy = yy / area - y * y, xy = xy / area - x * y;
  if (!(xx > 0.0 && yy > 0.0)) return false;
  const auto in_plane = [&](double u, double v) {
    return Point{corners_[0].x + c * u - s * v, corners_[0].y + s * u + c * v};
  };
  face_.centroids.push_back(in_plane(x, y));
  face_.areas.push_back(area);
  const double length = std::sqrt(area * std::sqrt(xx / yy));
  sides_.insert(sides_.end(), {length, area / length});
  // Four points on the principal axes of inertia.
  const double turn = 0.5 * std::atan2(2.0 * xy, xx - yy), mean = (xx + yy) / 2;
  const double apart = std::hypot((xx - yy) / 2, xy);
  const double u = std::cos(turn), v = std::sin(turn);
  const double longer = std::sqrt(2 * (mean + apart)), shorter = std::sqrt(2 * std::max(mean - apart, 0.0));
  for (const double sign : {1.0, -1.0}) {
    quadrature_.push_back(in_plane(x + sign * longer * u, y + sign * longer * v));
    quadrature_.push_back(in_plane(x - sign * shorter * v, y + sign * shorter * u));
  }
  return true;
}

// Whole cells share edges; one that is cut has its own.
void LatticeFace::add_edges() {
  const std::size_t columns = lattice_.columns, rows = lattice_.rows;
  const auto whole = [&](std::size_t column, std::size_t row) {
    const std::int32_t place = column < columns && row < rows ? place_[row * columns + column] : -1;
    return place >= 0 && !cut_[static_cast<std::size_t>(place)] ? place : -1;
  };
  const auto add = [&](const Point& start, const Point& end, std::int32_t left, std::int32_t right) {
    face_.edges.push_back({{start.x, start.y}, {end.x, end.y}, left, right});
  };
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    const auto own = static_cast<std::int32_t>(i);
    if (cut_[i]) {
      const std::size_t first = rims_[i], last = i + 1 < rims_.size() ? rims_[i + 1] : rim_corners_.size();
      for (std::size_t k = first; k < last; ++k) {
        add(rim_corners_[k], rim_corners_[k + 1 < last ? k + 1 : first], own, -1);
      }
      continue;
    }
    const std::size_t column = kept_[i] % columns, row = kept_[i] / columns;
    const auto x = static_cast<double>(column), y = static_cast<double>(row);
    const Point corners[4] = {lattice_.at(x, y), lattice_.at(x + 1, y), lattice_.at(x + 1, y + 1), lattice_.at(x, y + 1)};
    // Its right and upper edges, and the left and lower ones where no cell has them.
    add(corners[1], corners[2], own, whole(column + 1, row));
    add(corners[2], corners[3], own, whole(column, row + 1));
    if (column == 0 || whole(column - 1, row) < 0) add(corners[3], corners[0], own, -1);
    if (row == 0 || whole(column, row - 1) < 0) add(corners[0], corners[1], own, -1);
  }
}

void LatticeFace::integrate() {
  const std::size_t count = kept_.size();
  inverse_distance_by_offset(lattice_.columns, lattice_.rows, lattice_.size, lattice_.width(), offsets_);
  face_.inverse_distance.resize(count * count);
  const double c = lattice_.cosine, s = lattice_.sine;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t column = kept_[i] % lattice_.columns, row = kept_[i] / lattice_.columns;
    for (std::size_t j = i; j < count; ++j) {
      double integral;
      if (cut_[i] || cut_[j]) {
        const Point &p = face_.centroids[i], &q = face_.centroids[j];
        const double a[2] = {sides_[2 * i], sides_[2 * j]}, b[2] = {sides_[2 * i + 1], sides_[2 * j + 1]};
        integral = inverse_distance(c * (q.x - p.x) + s * (q.y - p.y), -s * (q.x - p.x) + c * (q.y - p.y), a, b);
      } else {
        const std::size_t to_column = kept_[j] % lattice_.columns, to_row = kept_[j] / lattice_.columns;
        const std::size_t across = to_column > column ? to_column - column : column - to_column;
        integral = offsets_[(to_row - row) * lattice_.columns + across];
      }
      face_.inverse_distance[i * count + j] = face_.inverse_distance[j * count + i] = integral;
    }
  }
}

}  // namespace mjtactile
