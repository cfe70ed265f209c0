#include "gap_map.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Points along each side of the grid that looks at the sheet, and of the closer looks for the lowest one.
constexpr int kLines = 33, kCloseLines = 7, kLooks = 5, kBisections = 12;

double along(double low, double high, int place, int lines) {
  return low + (high - low) * place / (lines - 1);
}

}  // namespace

bool GapMap::place(const RigidBody& body, const Pose& pose, const Rectangle& sheet, const GapLimits& limits) {
  sheet_ = sheet;
  limits_ = limits;
  count_ = body.shapes.size();
  if (shapes_.size() < count_) shapes_.resize(count_);
  for (std::size_t i = 0; i < count_; ++i) shapes_[i].place(body.shapes[i], pose, sheet);
  floor_ = -limits.depth;
  look();
  const double rim = limits.facing_gap / 2;
  touch_ = lowest_over({sheet.west + rim, sheet.south + rim, sheet.east - rim, sheet.north - rim});
  if (!(touch_ <= limits.depth)) return false;
  const double floor = std::max(touch_ - limits.facing_gap, -limits.depth);
  const bool beside = std::any_of(grid_.begin(), grid_.end(), [floor](double height) { return height < floor; });
  floor_ = floor;
  if (beside) look();
  touch_ = std::min(touch_, lowest_over(sheet));
  find_covered();
  return true;
}

double GapMap::height(double x, double y) const {
  if (!sheet_.holds(x, y)) return kNowhere;
  const double above = lowest_of_shapes(x, y) - touch_;
  return above <= limits_.reach ? above : kNowhere;
}

double GapMap::lowest_of_shapes(double x, double y) const {
  double lowest = kNowhere;
  for (std::size_t i = 0; i < count_; ++i) lowest = std::min(lowest, shapes_[i].height(x, y, floor_));
  return lowest;
}

Point GapMap::grid_point(int column, int row) const {
  return {along(sheet_.west, sheet_.east, column, kLines), along(sheet_.south, sheet_.north, row, kLines)};
}

void GapMap::look() {
  grid_.clear();
  for (int row = 0; row < kLines; ++row) {
    for (int column = 0; column < kLines; ++column) {
      const Point at = grid_point(column, row);
      grid_.push_back(lowest_of_shapes(at.x, at.y));
    }
  }
}

// The least height over a rectangle: at the lowest point of a shape, or by closer looks about the grid's lowest.
double GapMap::lowest_over(const Rectangle& part) const {
  double lowest = kNowhere;
  for (std::size_t i = 0; i < count_; ++i) {
    double points[2][3];
    const std::size_t found = shapes_[i].bottoms(points);
    for (std::size_t k = 0; k < found; ++k) {
      const double* at = points[k];
      if (part.holds(at[0], at[1]) && at[2] >= floor_) lowest = std::min(lowest, at[2]);
    }
  }
  Point best = {0.0, 0.0};
  bool closer = false;
  for (int row = 0; row < kLines; ++row) {
    for (int column = 0; column < kLines; ++column) {
      const Point at = grid_point(column, row);
      const double here = grid_[static_cast<std::size_t>(row * kLines + column)];
      if (here < lowest && part.holds(at.x, at.y)) lowest = here, best = at, closer = true;
    }
  }
  double reach_x = (sheet_.east - sheet_.west) / (kLines - 1), reach_y = (sheet_.north - sheet_.south) / (kLines - 1);
  for (int look = 0; closer && look < kLooks; ++look) {
    const Rectangle window = {std::max(best.x - reach_x, part.west), std::max(best.y - reach_y, part.south),
                              std::min(best.x + reach_x, part.east), std::min(best.y + reach_y, part.north)};
    for (int row = 0; row < kCloseLines; ++row) {
      for (int column = 0; column < kCloseLines; ++column) {
        const Point at = {along(window.west, window.east, column, kCloseLines),
                          along(window.south, window.north, row, kCloseLines)};
        const double here = lowest_of_shapes(at.x, at.y);
        if (here < lowest) lowest = here, best = at;
      }
    }
    reach_x *= 2.0 / (kCloseLines - 1), reach_y *= 2.0 / (kCloseLines - 1);
  }
  return lowest;
}

void GapMap::find_covered() {
  bottoms_.clear();
  for (std::size_t i = 0; i < count_; ++i) {
    double points[2][3];
    const std::size_t found = shapes_[i].bottoms(points);
    for (std::size_t k = 0; k < found; ++k) {
      const Point at = {points[k][0], points[k][1]};
      if (std::isfinite(height(at.x, at.y))) bottoms_.push_back(at);
    }
  }
  double low_x = 0.0, low_y = 0.0, high_x = 0.0, high_y = 0.0;
  const bool seen = bound(0, false, low_x) && bound(0, true, high_x) && bound(1, false, low_y) && bound(1, true, high_y);
  if (!seen) {
    // What slips between the grid's points is about its lowest ones.
    const double step_x = (sheet_.east - sheet_.west) / (kLines - 1), step_y = (sheet_.north - sheet_.south) / (kLines - 1);
    low_x = low_y = kNowhere, high_x = high_y = -kNowhere;
    for (const Point& at : bottoms_) {
      low_x = std::min(low_x, std::max(at.x - step_x, sheet_.west));
      low_y = std::min(low_y, std::max(at.y - step_y, sheet_.south));
      high_x = std::max(high_x, std::min(at.x + step_x, sheet_.east));
      high_y = std::max(high_y, std::min(at.y + step_y, sheet_.north));
    }
  }
  covered_ = {{(low_x + high_x) / 2, (low_y + high_y) / 2}, 0.0, high_x - low_x, high_y - low_y};
}

// The greatest or least coordinate along an axis that the body covers, by bisection from the grid's outermost points;
// false where it covers none of these.
bool GapMap::bound(int axis, bool greatest, double& bound) const {
  const auto at = [&](int along_axis, int other) {
    const int place = greatest ? kLines - 1 - along_axis : along_axis;
    return axis == 0 ? grid_point(place, other) : grid_point(other, place);
  };
  const auto covered = [&](int along_axis, int other) {
    const int place = greatest ? kLines - 1 - along_axis : along_axis;
    const int column = axis == 0 ? place : other, row = axis == 0 ? other : place;
    return grid_[static_cast<std::size_t>(row * kLines + column)] - touch_ <= limits_.reach;
  };
  const auto first_of = [&](int other) {
    int first = 0;
    while (first < kLines && !covered(first, other)) ++first;
    return first;
  };
  int least = kLines;
  for (int other = 0; other < kLines; ++other) least = std::min(least, first_of(other));
  if (least == kLines) return false;
  bound = greatest ? -kNowhere : kNowhere;
  for (int other = 0; other < kLines; ++other) {
    const int first = first_of(other);
    if (first > std::min(least + 1, kLines - 1)) continue;
    Point inside = at(first, other), outside = at(std::max(first - 1, 0), other);
    for (int step = 0; step < kBisections; ++step) {
      const Point middle = {(inside.x + outside.x) / 2, (inside.y + outside.y) / 2};
      (std::isfinite(height(middle.x, middle.y)) ? inside : outside) = middle;
    }
    const double found = axis == 0 ? inside.x : inside.y;
    bound = greatest ? std::max(bound, found) : std::min(bound, found);
  }
  return true;
}

}  // namespace mjtactile
