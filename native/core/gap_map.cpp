#include "gap_map.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Points along each side of the grid that looks at the sheet, and of the closer looks for the lowest one.
constexpr int kLines = 33, kCloseLines = 7, kLooks = 5;

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
  double low_x = kNowhere, low_y = kNowhere, high_x = -kNowhere, high_y = -kNowhere;
  const auto cover = [&](const Point& at) {
    low_x = std::min(low_x, at.x), low_y = std::min(low_y, at.y);
    high_x = std::max(high_x, at.x), high_y = std::max(high_y, at.y);
  };
  for (int row = 0; row < kLines; ++row) {
    for (int column = 0; column < kLines; ++column) {
      if (grid_[static_cast<std::size_t>(row * kLines + column)] - touch_ <= limits_.reach) cover(grid_point(column, row));
    }
  }
  bottoms_.clear();
  for (std::size_t i = 0; i < count_; ++i) {
    double points[2][3];
    const std::size_t found = shapes_[i].bottoms(points);
    for (std::size_t k = 0; k < found; ++k) {
      const Point at = {points[k][0], points[k][1]};
      if (std::isfinite(height(at.x, at.y))) bottoms_.push_back(at);
    }
  }
  // What slips between the grid's points is about its lowest ones.
  if (low_x > high_x) std::for_each(bottoms_.begin(), bottoms_.end(), cover);
  // The boundary is somewhere between the last point that is covered and the next.
  const double step_x = (sheet_.east - sheet_.west) / (kLines - 1), step_y = (sheet_.north - sheet_.south) / (kLines - 1);
  low_x = std::max(low_x - step_x, sheet_.west), high_x = std::min(high_x + step_x, sheet_.east);
  low_y = std::max(low_y - step_y, sheet_.south), high_y = std::min(high_y + step_y, sheet_.north);
  covered_ = {{(low_x + high_x) / 2, (low_y + high_y) / 2}, 0.0, high_x - low_x, high_y - low_y};
}

}  // namespace mjtactile
