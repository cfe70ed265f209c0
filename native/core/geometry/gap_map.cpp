#include "geometry/gap_map.hpp"

#include <algorithm>
#include <cmath>

#include "geometry/outline.hpp"

namespace mjtactile {
namespace {

// Largest number of edges of a convex face against whose sides every point is tested. Edges are counted and not sides,
// because rounding may make two sides of edges on a straight line.
constexpr std::size_t kFewEdges = 64;
// Number of strips into which the edges of other outlines are sorted.
constexpr std::size_t kStrips = 64;
// Candidates at corners are moved inside the outline by these distances along an edge and across it, over its length.
constexpr double kInside = 1e-9, kAcross = 1e-11;
// Largest rounding error of a point's distance to a side on which it lies, over the face's size.
constexpr double kOnSide = 1e-12;
// The same of points on the sheet's rim, over the sheet's size. Rows of cells often end there, and rounding must not
// decide whether their last points count.
constexpr double kOnRim = 1e-12;
// Area of notches that do not count, over the square of the face's size. Corners of meshes may be off by 1e-12 m.
constexpr double kNoNotch = 1e-9;
// A direction is replaced by that of a side if it is within this angle [rad], and if sides of other directions are
// farther off by the factor kClearly.
constexpr double kNearSide = 0.05, kClearly = 1.5;

// Set heights over points beside the sheet and heights above the ceiling to kNowhere.
void clip(const std::vector<Point>& points, const Rectangle& to_sheet, double to_ceiling, double* heights) {
  // Local copies, so that the compiler knows that writing heights does not change them and vectorises the loop.
  const Rectangle sheet = to_sheet;
  const double ceiling = to_ceiling;
  const Point* const at = points.data();
  const std::size_t count = points.size();
  for (std::size_t i = 0; i < count; ++i) {
    const bool on =
        (at[i].x >= sheet.west) & (at[i].x <= sheet.east) & (at[i].y >= sheet.south) & (at[i].y <= sheet.north);
    heights[i] = (on & (heights[i] <= ceiling)) ? heights[i] : kNowhere;
  }
}

void keep_within(const Rectangle& sheet, const Segment& line, SegmentPart& part) {
  const auto& [from, to] = line;
  part.keep_positive(from.x - sheet.west, to.x - sheet.west);
  part.keep_positive(sheet.east - from.x, sheet.east - to.x);
  part.keep_positive(from.y - sheet.south, to.y - sheet.south);
  part.keep_positive(sheet.north - from.y, sheet.north - to.y);
}

}  // namespace

bool GapMap::place(const std::vector<Shape>& shapes, const Pose& pose, const Rectangle& sheet,
                   const HeightRange& range) {
  sheet_ = sheet.larger(kOnRim);
  floor_ = range.floor;
  ceiling_ = range.ceiling;
  count_ = 0;
  whole_ = kNoRectangle;
  candidates_.clear();
  if (placed_.size() < shapes.size()) placed_.resize(shapes.size());
  for (const Shape& shape : shapes) {
    PlacedShape& placed = placed_[count_];
    placed.place(shape, pose, sheet, range);
    const double *low = placed.low(), *high = placed.high();
    if (!placed.is_over(sheet) || !(low[2] <= ceiling_) || !(high[2] >= floor_)) continue;
    ++count_;
    whole_ = around(whole_, {low[0], low[1], high[0], high[1]});
    placed.add_bottoms(candidates_);
  }
  // Where a shape's lowest point is beside the sheet, the point of the sheet nearest to it may touch.
  for (Point& at : candidates_) at = sheet.nearest(at);
  bounds_ = common(whole_, sheet);
  return count_ > 0;
}

bool GapMap::part_below(const Segment& line, const double (&plane)[2], SegmentPart& part) const {
  if (count_ != 1 || !placed_.front().is_box_above(floor_)) return false;
  part = {};
  keep_within(sheet_, line, part);
  placed_.front().keep_below(line, plane, part);
  placed_.front().keep_below(line, {ceiling_, ceiling_}, part);
  return true;
}

bool GapMap::left_out_below(const InclinedPlane& plane) {
  const auto end = placed_.begin() + static_cast<std::ptrdiff_t>(count_);
  return std::any_of(placed_.begin(), end, [&](PlacedShape& shape) { return shape.left_out_below(plane); });
}

double GapMap::height(double x, double y) const {
  if (!sheet_.holds(x, y)) return kNowhere;
  double lowest = kNowhere;
  for (std::size_t i = 0; i < count_; ++i) {
    const PlacedShape& shape = placed_[i];
    if (shape.low()[2] < lowest) lowest = std::min(lowest, shape.height(x, y, floor_));
  }
  return lowest <= ceiling_ ? lowest : kNowhere;
}

void GapMap::heights(const std::vector<Point>& points, std::vector<double>& to) const {
  to.assign(points.size(), kNowhere);
  for (std::size_t i = 0; i < count_; ++i) placed_[i].lower(points, floor_, to.data());
  clip(points, sheet_, ceiling_, to.data());
}

void FlatMap::place(const std::vector<Segment>& outline, const Rectangle& sheet) {
  sheet_ = sheet.larger(kOnRim);
  starts_.clear();
  ends_.clear();
  corners_.clear();
  for (const auto& [corner, end] : outline) {
    starts_.push_back(corner);
    ends_.push_back(end);
    const double x = end.x - corner.x, y = end.y - corner.y;
    const Point inside = {corner.x + kInside * x - kAcross * y, corner.y + kInside * y + kAcross * x};
    if (sheet.holds(inside.x, inside.y)) corners_.push_back(inside);
  }
  const Rectangle all = around(starts_);
  bounds_ = common(all, sheet);
  rounding_ = kOnSide * std::hypot(all.east - all.west, all.north - all.south);
  convex_ = set_sides();
  if (!convex_) fill_strips();
}

// Set the sides of a convex face of few edges. Consecutive edges on a straight line become one side. False if the face
// is another one.
bool FlatMap::set_sides() {
  sides_.clear();
  if (starts_.size() > kFewEdges) return false;
  const std::vector<Point> hull = convex_hull(starts_);
  if (hull.size() < 3) return false;
  // Notches and holes are what the face's area lacks of its hull's.
  const Point& first = starts_.front();
  double size = 0.0, area = 0.0;
  for (std::size_t i = 0; i < starts_.size(); ++i) {
    size = std::max(size, std::hypot(starts_[i].x - first.x, starts_[i].y - first.y));
    area += left_of(first, starts_[i], ends_[i]) / 2;
  }
  if (!(std::abs(area - signed_area(hull)) <= kNoNotch * size * size)) return false;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point &from = hull[i], &to = hull[(i + 1) % hull.size()];
    const double length = std::hypot(to.x - from.x, to.y - from.y);
    const double x = (to.x - from.x) / length, y = (to.y - from.y) / length;
    sides_.push_back({-y, x, x * from.y - y * from.x - rounding_});
  }
  return true;
}

void FlatMap::fill_strips() {
  double north = -kNowhere;
  south_ = kNowhere;
  for (const Point& corner : starts_) south_ = std::min(south_, corner.y), north = std::max(north, corner.y);
  per_ = static_cast<double>(kStrips) / (north - south_);
  const auto over_each = [this](std::size_t edge, auto&& visit) {
    const double from = starts_[edge].y, to = ends_[edge].y;
    const std::size_t last = strip(std::max(from, to) + rounding_);
    for (std::size_t k = strip(std::min(from, to) - rounding_); k <= last; ++k) visit(k);
  };
  firsts_.assign(kStrips + 1, 0);
  for (std::size_t i = 0; i < starts_.size(); ++i) over_each(i, [this](std::size_t k) { ++firsts_[k + 1]; });
  for (std::size_t k = 0; k < kStrips; ++k) firsts_[k + 1] += firsts_[k];
  edges_.resize(firsts_.back());
  fill_.assign(firsts_.begin(), firsts_.end() - 1);
  for (std::size_t i = 0; i < starts_.size(); ++i) {
    over_each(i, [this, i](std::size_t k) { edges_[fill_[k]++] = static_cast<std::uint32_t>(i); });
  }
}

std::size_t FlatMap::strip(double y) const {
  const double place = (y - south_) * per_;
  if (!(place > 0.0)) return 0;
  return place < static_cast<double>(kStrips) ? static_cast<std::size_t>(place) : kStrips - 1;
}

void FlatMap::heights(const std::vector<Point>& points, std::vector<double>& to) const {
  if (!convex_) {
    HeightMap::heights(points, to);
    return;
  }
  to.assign(points.size(), 0.0);
  // Local copies, so that the compiler vectorises the loop.
  double* const heights = to.data();
  const Point* const at = points.data();
  const std::size_t count = points.size();
  for (const Side side : sides_) {
    for (std::size_t i = 0; i < count; ++i) heights[i] = side.inside(at[i].x, at[i].y) >= 0.0 ? heights[i] : kNowhere;
  }
  clip(points, sheet_, 0.0, heights);
}

bool FlatMap::part_below(const Segment& line, const double (&plane)[2], SegmentPart& part) const {
  const auto& [from, to] = line;
  part = {};
  for (const Side& side : sides_) part.keep_positive(side.inside(from.x, from.y), side.inside(to.x, to.y));
  keep_within(sheet_, line, part);
  part.keep_positive(plane[0], plane[1]);
  if (convex_ || part.is_empty()) return true;
  // Of a face with notches, the sheet and the plane cut the segment before its edges do: they may cut it in a notch.
  const double low = part.low, length = part.high - part.low;
  const Point start = {from.x + low * (to.x - from.x), from.y + low * (to.y - from.y)};
  const Point end = {start.x + length * (to.x - from.x), start.y + length * (to.y - from.y)};
  const SegmentPart inner = part_between_edges({start, end});
  part = {low + inner.low * length, low + inner.high * length};
  return true;
}

// The part of a segment from where it is first inside the outline to where it is last.
SegmentPart FlatMap::part_between_edges(const Segment& line) const {
  const auto& [from, to] = line;
  SegmentPart part = {1.0, 0.0};
  if (is_inside(from.x, from.y)) part.low = 0.0;
  if (is_inside(to.x, to.y)) part.high = 1.0;
  const std::size_t last = strip(std::max(from.y, to.y));
  for (std::uint32_t k = firsts_[strip(std::min(from.y, to.y))]; k < firsts_[last + 1]; ++k) {
    const Point &a = starts_[edges_[k]], &b = ends_[edges_[k]];
    if ((left_of(from, to, a) < 0.0) == (left_of(from, to, b) < 0.0)) continue;
    const double at_start = left_of(a, b, from), at_end = left_of(a, b, to);
    if ((at_start < 0.0) == (at_end < 0.0)) continue;
    const double crossing = at_start / (at_start - at_end);
    part.low = std::min(part.low, crossing);
    part.high = std::max(part.high, crossing);
  }
  return part;
}

double FlatMap::straightened(double angle) const {
  const double c = std::cos(angle), s = std::sin(angle);
  double nearest = kClearly * kNearSide, next = nearest;
  for (const Side& side : sides_) {
    // Angle from the given direction to the side's, whichever way the side points.
    const double turn = std::atan(-(side.x * c + side.y * s) / (side.y * c - side.x * s));
    if (std::abs(turn - nearest) <= kOnSide) continue;
    if (std::abs(turn) < std::abs(nearest)) {
      next = nearest;
      nearest = turn;
    } else if (std::abs(turn) < std::abs(next)) {
      next = turn;
    }
  }
  const bool clear = std::abs(nearest) <= kNearSide && std::abs(next) >= kClearly * std::abs(nearest);
  return clear ? angle + nearest : angle;
}

double FlatMap::height(double x, double y) const {
  return sheet_.holds(x, y) && is_inside(x, y) ? 0.0 : kNowhere;
}

// A point is inside if the outline's winding number about it is not zero, or if it is on an edge.
bool FlatMap::is_inside(double x, double y) const {
  if (convex_) {
    return std::none_of(sides_.begin(), sides_.end(), [x, y](const Side& side) { return side.inside(x, y) < 0.0; });
  }
  int winding = 0;
  const std::size_t beside = strip(y);
  for (std::uint32_t k = firsts_[beside]; k < firsts_[beside + 1]; ++k) {
    const Point &a = starts_[edges_[k]], &b = ends_[edges_[k]];
    const Point at = {x, y};
    const double left = left_of(a, b, at);
    if (std::abs(left) <= rounding_ * distance(a, b) && distance(nearest_on(a, b, at), at) <= rounding_) {
      return true;   // on the edge
    }
    winding += winding_of(a, b, at, left);
  }
  return winding != 0;
}

}  // namespace mjtactile
