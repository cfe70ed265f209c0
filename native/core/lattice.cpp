#include "lattice.hpp"

#include <algorithm>
#include <cmath>

#include "rectangle_integrals.hpp"

namespace mjtactile {
namespace {

// As the readable reference has them: mjtactile/region.py and mjtactile/lattice.py.
constexpr double kElongated = 1.5;
constexpr double kLongest = 5.0;
constexpr double kMostRounding = 1e-9;
// Cells of which the sheet leaves less than this share are dropped.
constexpr double kLeastShare = 1e-2;

}  // namespace

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
