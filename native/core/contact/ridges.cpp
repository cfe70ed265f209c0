#include "contact/ridges.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/angles.hpp"

namespace mjtactile {
namespace {

constexpr double kCrofton = kHalfTurn / 4;   // pi / 4

}  // namespace

bool Ridges::find(const HeightWindow& view, const Grid& grid, double tolerance, const Needed& needed) {
  crossings_.clear(), points_.clear();
  if (!find_candidates(view, grid, tolerance, needed)) return false;
  for (std::size_t number = 0, first = 0; number < lines_.size(); first = line_ends_[number++]) {
    const SampledLine& line = lines_[number];
    for (std::size_t k = first; k < line_ends_[number]; ++k) {
      add_crossing(view, line, candidates_[k], tolerance, crossings_);
    }
    if (crossings_.size() > needed.most) {
      crossings_.clear(), points_.clear();
      return false;
    }
    const double step = line.step.x + line.step.y;   // along one of the axes
    while (points_.size() < crossings_.size()) {
      const RidgeCrossing& one = crossings_[points_.size()];
      points_.push_back({one.at, one.height + view.highest, line.spacing, step, points_.size()});
    }
  }
  return length_below(needed.height) > needed.length;
}

bool Ridges::find_candidates(const HeightWindow& view, const Grid& grid, double tolerance, const Needed& needed) {
  const std::size_t lines = grid.lines;
  const double steps[2] = {(grid.bounds.east - grid.bounds.west) / static_cast<double>(lines),
                           (grid.bounds.north - grid.bounds.south) / static_cast<double>(lines)};
  const auto point = [&](double column, double row) {
    return Point{grid.bounds.west + steps[0] * (column + 0.5), grid.bounds.south + steps[1] * (row + 0.5)};
  };
  over_.resize(lines * lines);
  for (std::size_t row = 0; row < lines; ++row) {
    const double* const heights = grid.heights.data() + row * lines;
    double* const over = over_.data() + row * lines;
    const HeightWindow from = view;   // a local copy, so that the compiler vectorises the loop
    for (std::size_t column = 0; column < lines; ++column) {
      const Point at = point(static_cast<double>(column), static_cast<double>(row));
      over[column] = from.measured(at, heights[column]) - from.highest;
    }
  }
  lines_.clear(), line_ends_.clear(), candidates_.clear();
  const double low = needed.height - view.highest;
  double length = 0.0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    for (std::size_t line = 0; line < lines; ++line) {
      const auto across = static_cast<double>(line);
      const auto end = [&](std::size_t side) {
        const std::vector<double>* const heights = grid.ends[2 * axis + side];
        if (heights == nullptr) return SampledLine::kUnknown;
        const double along = side == 0 ? -0.5 : static_cast<double>(lines) - 0.5;
        return view.measured(axis == 0 ? point(along, across) : point(across, along), (*heights)[line]) - view.highest;
      };
      const Point step = axis == 0 ? Point{steps[0], 0.0} : Point{0.0, steps[1]};
      lines_.push_back({axis == 0 ? point(0.0, across) : point(across, 0.0), step, lines,
                        over_.data() + line * (axis == 0 ? lines : 1), axis == 0 ? 1 : lines, line, lines,
                        axis == 0 ? lines : 1, steps[1 - axis], end(0), end(1), true});
      const std::size_t first = candidates_.size();
      add_candidates(view, lines_.back(), tolerance, candidates_);
      line_ends_.push_back(candidates_.size());
      for (std::size_t k = first; k < candidates_.size(); ++k) {
        if (candidates_[k].least <= low) length += kCrofton * steps[1 - axis];
      }
    }
  }
  return length > needed.length;
}

double Ridges::length_below(double height) const {
  double sum = 0.0;
  for (const RidgePoint& one : points_) sum += one.height <= height ? kCrofton * one.spacing : 0.0;
  return sum;
}

double Ridges::area_of(const RidgePoint& point, double level) const {
  const RidgeCrossing& crossing = crossings_[point.number];
  return point.spacing * point.step * (crossing.reach(level, 1.0) + crossing.reach(level, -1.0)) / 2;
}

double Ridges::area_below(double height, double level) const {
  double sum = 0.0;
  for (const RidgePoint& one : points_) sum += one.height <= height ? area_of(one, level) : 0.0;
  return sum;
}

double Ridges::lowest() const {
  double least = kNowhere;
  for (const RidgePoint& one : points_) least = std::min(least, one.height);
  return least;
}

void Ridges::count_from(double height) {
  for (RidgePoint& one : points_) one.height -= height;
}

double Ridges::level_for(double product) {
  std::sort(points_.begin(), points_.end(),
            [](const RidgePoint& one, const RidgePoint& other) { return one.height < other.height; });
  double length = 0.0, level = 0.0;
  for (std::size_t k = 0; k < points_.size(); ++k) {
    length += kCrofton * points_[k].spacing;
    level = std::max(product / length, points_[k].height);
    if (k + 1 < points_.size() && level <= points_[k + 1].height) break;
  }
  return level;
}

Ridges::Stretch& Ridges::next_stretch() {
  if (count_ == stretches_.size()) stretches_.emplace_back();
  Stretch& stretch = stretches_[count_++];
  stretch.points.clear();
  stretch.area = stretch.length = stretch.narrow = 0.0;
  return stretch;
}

void Ridges::connect(double height, double near, double level) {
  const std::size_t count = points_.size();
  sets_.reset(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (std::max(points_[i].height, points_[j].height) > height) continue;
      const Point &one = points_[i].at, &other = points_[j].at;
      if (std::max(std::abs(one.x - other.x), std::abs(one.y - other.y)) < near) sets_.join(i, j);
    }
  }
  count_ = 0;
  numbers_.assign(count, count);
  for (std::size_t i = 0; i < count; ++i) {
    const RidgePoint& point = points_[i];
    if (point.height > height) continue;
    std::size_t& number = numbers_[sets_.root(i)];
    if (number == count) number = count_, next_stretch();
    Stretch& stretch = stretches_[number];
    stretch.length += kCrofton * point.spacing;
    stretch.area += area_of(point, level);
    stretch.points.push_back(point.at);
    if (crossings_[point.number].is_narrow(level)) stretch.narrow += kCrofton * point.spacing;
  }
}

}  // namespace mjtactile
