#include "geometry/gap_map.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

constexpr std::size_t kFewEdges = 32;
// How far corners that are looked at lie inside their outline, along an edge and across it, over the edge's length.
constexpr double kInside = 1e-9, kAcross = 1e-11;

}  // namespace

bool GapMap::place(const std::vector<Shape>& shapes, const Pose& pose, const Rectangle& sheet, double floor,
                   double ceiling) {
  sheet_ = sheet;
  floor_ = floor;
  ceiling_ = ceiling;
  count_ = 0;
  bottom_ = kNowhere;
  bounds_ = {kNowhere, kNowhere, -kNowhere, -kNowhere};
  candidates_.clear();
  if (placed_.size() < shapes.size()) placed_.resize(shapes.size());
  for (const Shape& shape : shapes) {
    PlacedShape& placed = placed_[count_];
    placed.place(shape, pose, sheet, floor, ceiling);
    const double *low = placed.low(), *high = placed.high();
    const bool over = low[0] < sheet.east && high[0] > sheet.west && low[1] < sheet.north && high[1] > sheet.south;
    if (over) bottom_ = std::min(bottom_, placed.bottom());
    if (!over || !(low[2] <= ceiling) || !(high[2] >= floor)) continue;
    ++count_;
    bounds_ = {std::min(bounds_.west, low[0]), std::min(bounds_.south, low[1]), std::max(bounds_.east, high[0]),
               std::max(bounds_.north, high[1])};
    const std::size_t first = candidates_.size();
    placed.add_bottoms(candidates_);
    candidates_.erase(std::remove_if(candidates_.begin() + static_cast<std::ptrdiff_t>(first), candidates_.end(),
                                     [&](const Point& at) { return !sheet.holds(at.x, at.y); }),
                      candidates_.end());
  }
  bounds_ = {std::max(bounds_.west, sheet.west), std::max(bounds_.south, sheet.south),
             std::min(bounds_.east, sheet.east), std::min(bounds_.north, sheet.north)};
  return count_ > 0;
}

double GapMap::height(double x, double y) const {
  if (!sheet_.holds(x, y)) return kNowhere;
  double lowest = kNowhere;
  for (std::size_t i = 0; i < count_; ++i) {
    const PlacedShape& shape = placed_[i];
    if (shape.low()[2] >= lowest || x < shape.low()[0] || x > shape.high()[0] || y < shape.low()[1] ||
        y > shape.high()[1]) {
      continue;
    }
    lowest = std::min(lowest, shape.height(x, y, floor_));
  }
  return lowest <= ceiling_ ? lowest : kNowhere;
}

void GapMap::heights(const std::vector<Point>& points, std::vector<double>& to) const {
  to.assign(points.size(), kNowhere);
  for (std::size_t i = 0; i < count_; ++i) placed_[i].lower(points, floor_, to.data());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(to[i] <= ceiling_) || !sheet_.holds(points[i].x, points[i].y)) to[i] = kNowhere;
  }
}

void FlatMap::place(const std::vector<Point>& starts, const std::vector<Point>& ends, const Rectangle& sheet) {
  sheet_ = sheet;
  starts_ = starts;
  ends_ = ends;
  bounds_ = {kNowhere, kNowhere, -kNowhere, -kNowhere};
  candidates_.clear();
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const Point& corner = starts[i];
    bounds_ = {std::min(bounds_.west, corner.x), std::min(bounds_.south, corner.y), std::max(bounds_.east, corner.x),
               std::max(bounds_.north, corner.y)};
    const double x = ends[i].x - corner.x, y = ends[i].y - corner.y;
    const Point inside = {corner.x + kInside * x - kAcross * y, corner.y + kInside * y + kAcross * x};
    if (sheet.holds(inside.x, inside.y)) candidates_.push_back(inside);
  }
  bounds_ = {std::max(bounds_.west, sheet.west), std::max(bounds_.south, sheet.south),
             std::min(bounds_.east, sheet.east), std::min(bounds_.north, sheet.north)};
  // No more edges than are worth a look at all of their corners.
  convex_ = starts.size() <= kFewEdges;
  for (std::size_t i = 0; i < starts.size() && convex_; ++i) {
    for (const Point& corner : starts) convex_ = convex_ && left_of(starts[i], ends[i], corner) >= 0.0;
  }
}

void FlatMap::heights(const std::vector<Point>& points, std::vector<double>& to) const {
  if (!convex_) {
    HeightMap::heights(points, to);
    return;
  }
  to.assign(points.size(), 0.0);
  for (std::size_t edge = 0; edge < starts_.size(); ++edge) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      to[i] = left_of(starts_[edge], ends_[edge], points[i]) >= 0.0 ? to[i] : kNowhere;
    }
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!sheet_.holds(points[i].x, points[i].y)) to[i] = kNowhere;
  }
}

// Inside is what the outline winds around, its edges included.
double FlatMap::height(double x, double y) const {
  if (!sheet_.holds(x, y)) return kNowhere;
  if (convex_) {
    for (std::size_t edge = 0; edge < starts_.size(); ++edge) {
      if (!(left_of(starts_[edge], ends_[edge], {x, y}) >= 0.0)) return kNowhere;
    }
    return 0.0;
  }
  int winding = 0;
  for (std::size_t i = 0; i < starts_.size(); ++i) {
    const Point &a = starts_[i], &b = ends_[i];
    const double left = left_of(a, b, {x, y});
    if (left == 0.0 && x >= std::min(a.x, b.x) && x <= std::max(a.x, b.x) && y >= std::min(a.y, b.y) &&
        y <= std::max(a.y, b.y)) {
      return 0.0;
    }
    if (a.y <= y) {
      if (b.y > y && left > 0.0) ++winding;
    } else if (b.y <= y && left < 0.0) {
      --winding;
    }
  }
  return winding != 0 ? 0.0 : kNowhere;
}

}  // namespace mjtactile
