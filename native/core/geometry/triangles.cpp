#include "geometry/triangles.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "linalg/kernels.hpp"

namespace mjtactile {
namespace {

// Points this far outside a triangle, relative to its size, still count as inside, so that no gaps open at shared
// edges.
constexpr double kSeam = 1e-9;
// Triangles whose normal has a cosine with the pad's below this are vertical and are ignored.
constexpr double kSteep = 1e-9;
// Possible numbers of buckets along each side. Each bucket consists of a whole number of the finest ones.
constexpr std::size_t kBuckets[] = {4, 6, 8, 12, 16, 24, 32, 48, 96};
// Least number of buckets per triangle. More take longer to fill, and fewer have more triangles to test per point.
constexpr std::size_t kBucketsEach = 4;
// A box that is entirely over the part is not searched further if it has at most this many triangles.
constexpr std::uint32_t kFew = 32;
// Buckets along each side of the grid that thins candidates for a first touch.
constexpr std::size_t kCandidates = 16;
// Heights of vertices that differ by less than this are equal, because rounding must not choose between them [m].
constexpr double kLevel = 1e-12;
// A candidate this far above another part of the mesh is hidden by it [m].
constexpr double kHidden = 1e-7;
// Rounding of a box's place, relative to the mesh's size and its distance from the pad's origin.
constexpr double kRounding = 1e-14;
constexpr std::ptrdiff_t kEight = 8;
// Up to this many entries in the buckets, each triangle is tested against all points. That is as fast as looking up the
// bucket of each point.
constexpr std::size_t kFewEntries = 64;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

using Spot = std::array<double, 3>;

// A triangle clipped at a rectangle: a convex polygon.
struct Polygon {
  Spot corners[7];
  std::size_t count = 0;

  Polygon(const double corner[3][3], const Rectangle& part) {
    for (std::size_t k = 0; k < 3; ++k) corners[count++] = {corner[k][0], corner[k][1], corner[k][2]};
    cut(0, part.west, 1.0), cut(0, part.east, -1.0), cut(1, part.south, 1.0), cut(1, part.north, -1.0);
  }

 private:
  // Keep the part where sign * (coordinate - line) >= 0.
  void cut(std::size_t axis, double line, double sign) {
    Spot kept[7];
    std::size_t left = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const Spot &here = corners[k], &next = corners[k + 1 < count ? k + 1 : 0];
      const double inside = sign * (here[axis] - line), inside_next = sign * (next[axis] - line);
      if (inside >= 0.0 && left < 7) kept[left++] = here;
      if ((inside < 0.0) == (inside_next < 0.0) || left == 7) continue;
      const double share = inside / (inside - inside_next);
      Spot crossing;
      for (std::size_t i = 0; i < 3; ++i) crossing[i] = here[i] + share * (next[i] - here[i]);
      crossing[axis] = line;
      kept[left++] = crossing;
    }
    std::copy(kept, kept + left, corners);
    count = left;
  }
};

// A regular grid, not necessarily along x and y, on which points lie row by row.
struct PointGrid {
  std::size_t counts[2] = {};   // points in a row, and rows
  Point first = {0.0, 0.0};
  double per[2][2] = {};         // places along rows and across them per length along x and y [1/m]

  // Fit the grid to points. False if they do not form one, or are too few.
  bool fit(const std::vector<Point>& points) {
    if (points.size() < kFewPoints) return false;
    first = points.front();
    const double along[2] = {points[1].x - first.x, points[1].y - first.y};
    const double near = kOffGrid * std::hypot(along[0], along[1]);
    std::size_t columns = 1;
    const auto goes_on = [&](const Point& from, const Point& to) {
      return std::abs(to.x - from.x - along[0]) + std::abs(to.y - from.y - along[1]) <= near;
    };
    while (columns < points.size() && goes_on(points[columns - 1], points[columns])) ++columns;
    const std::size_t rows = points.size() / columns;
    if (columns < 2 || rows < 2 || rows * columns != points.size()) return false;
    const Point &right = points[columns - 1], &top = points[(rows - 1) * columns];
    const double a[2] = {(right.x - first.x) / static_cast<double>(columns - 1),
                         (right.y - first.y) / static_cast<double>(columns - 1)};
    const double b[2] = {(top.x - first.x) / static_cast<double>(rows - 1),
                         (top.y - first.y) / static_cast<double>(rows - 1)};
    bool fits = true;
    for (std::size_t row = 0; row < rows; ++row) {
      const double x = first.x + static_cast<double>(row) * b[0], y = first.y + static_cast<double>(row) * b[1];
      for (std::size_t column = 0; column < columns; ++column) {
        const Point& at = points[row * columns + column];
        const auto step = static_cast<double>(column);
        fits &= std::abs(at.x - x - step * a[0]) + std::abs(at.y - y - step * a[1]) <= near;
      }
    }
    const double turn = a[0] * b[1] - a[1] * b[0];
    if (!fits || !(std::abs(turn) > near * near)) return false;
    counts[0] = columns, counts[1] = rows;
    per[0][0] = b[1] / turn, per[0][1] = -b[0] / turn;
    per[1][0] = -a[1] / turn, per[1][1] = a[0] / turn;
    return true;
  }

  // Ranges of columns and rows that contain all grid points in a rectangle, from `from` to before `end`.
  void find(double west, double east, double south, double north, std::size_t from[2], std::size_t end[2]) const {
    const double x = (west + east) / 2 - first.x, y = (south + north) / 2 - first.y;
    for (int axis = 0; axis < 2; ++axis) {
      const double middle = per[axis][0] * x + per[axis][1] * y;
      const double half =
          (std::abs(per[axis][0]) * (east - west) + std::abs(per[axis][1]) * (north - south)) / 2 + kMargin;
      const auto most = static_cast<double>(counts[axis]);
      from[axis] = static_cast<std::size_t>(std::min(std::max(middle - half, -1.0) + 1.0, most));
      end[axis] = static_cast<std::size_t>(std::min(std::max(middle + half, -1.0) + 1.0, most));
    }
  }

 private:
  // Least number of points; largest distance of a point from its place on the grid, over the spacing; and margin around
  // rectangles, in spacings.
  static constexpr std::size_t kFewPoints = 32;
  static constexpr double kOffGrid = 1e-4, kMargin = 1e-2;
};

bool within(const double corner[3][3], const Rectangle& part) {
  return part.holds(corner[0][0], corner[0][1]) && part.holds(corner[1][0], corner[1][1]) &&
         part.holds(corner[2][0], corner[2][1]);
}

// Least height, at the floor or above, of a triangle over a rectangle [m]; infinite if it has none.
double lowest_over(const double corner[3][3], const Rectangle& part, double floor) {
  double low = kInfinite, high = -kInfinite;
  if (within(corner, part)) {
    low = std::min({corner[0][2], corner[1][2], corner[2][2]});
    high = std::max({corner[0][2], corner[1][2], corner[2][2]});
  } else {
    const Polygon cut(corner, part);
    for (std::size_t k = 0; k < cut.count; ++k) {
      low = std::min(low, cut.corners[k][2]);
      high = std::max(high, cut.corners[k][2]);
    }
  }
  return high >= floor ? std::max(low, floor) : kInfinite;
}

}  // namespace

void TriangleShadow::cast(const TriangleMesh& mesh, const Pose& pose, const Rectangle& part, double floor,
                          double reach, double level) {
  mesh_ = &mesh, pose_ = pose, part_ = part, floor_ = floor;
  cut_ = false;
  triangles_.clear();
  spans_.clear();
  lowest_ = kInfinite;
  if (!mesh.boxes.empty()) {
    slack_ = 0.0;
    for (int i = 0; i < 3; ++i) {
      const MeshBox& all = mesh.boxes.front();
      slack_ += kRounding * (std::abs(pose.position[i]) + std::max(std::abs(all.low[i]), std::abs(all.high[i])));
    }
    find_lowest();
    ceiling_ = std::max(lowest_, level) + reach;
    if (std::isfinite(lowest_)) gather();
  }
  place_buckets();
  fill_buckets();
}

// Bounds of a box along an axis of the pad, widened by rounding errors [m].
TriangleShadow::Span TriangleShadow::span(const MeshBox& box, int axis) const {
  const double* row = pose_.rotation + 3 * axis;
  double low = pose_.position[axis] - slack_, high = pose_.position[axis] + slack_;
  for (int i = 0; i < 3; ++i) {
    const double one = row[i] * box.low[i], other = row[i] * box.high[i];
    low += one < other ? one : other;
    high += one < other ? other : one;
  }
  return {low, high};
}

// Whether no triangle of a box is over the part.
bool TriangleShadow::is_beside(const MeshBox& box) const {
  const Span x = span(box, 0), y = span(box, 1);
  return x.low > part_.east || x.high < part_.west || y.low > part_.north || y.high < part_.south;
}

// Whether a triangle of a box may face down.
bool TriangleShadow::may_face_down(const MeshBox& box) const {
  if (!mesh_->closed) return true;
  double most = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double up = pose_.rotation[6 + i];
    most -= up * static_cast<double>(up > 0.0 ? box.least_normal[i] : box.most_normal[i]);
  }
  return most >= 0.0;
}

// Compute the coordinates of a triangle's corners along an axis of the pad [m]. Returns their bounds.
TriangleShadow::Span TriangleShadow::corner_span(std::uint32_t triangle, int axis, double corner[3][3]) const {
  const double* row = pose_.rotation + 3 * axis;
  const std::int32_t* face = mesh_->faces.data() + 3 * std::size_t{triangle};
  for (int k = 0; k < 3; ++k) {
    const double* from = mesh_->vertices.data() + 3 * static_cast<std::size_t>(face[k]);
    corner[k][axis] = pose_.position[axis] + row[0] * from[0] + row[1] * from[1] + row[2] * from[2];
  }
  const double first = corner[0][axis], second = corner[1][axis], third = corner[2][axis];
  return {std::min(std::min(first, second), third), std::max(std::max(first, second), third)};
}

void TriangleShadow::corners_of(std::uint32_t triangle, double corner[3][3]) const {
  for (int axis = 0; axis < 3; ++axis) corner_span(triangle, axis, corner);
}

bool TriangleShadow::faces_down(const double corner[3][3], double normal[3]) const {
  double a[3], b[3];
  for (int i = 0; i < 3; ++i) a[i] = corner[1][i] - corner[0][i], b[i] = corner[2][i] - corner[0][i];
  normal[0] = a[1] * b[2] - a[2] * b[1];
  normal[1] = a[2] * b[0] - a[0] * b[2];
  normal[2] = a[0] * b[1] - a[1] * b[0];
  const double square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
  return normal[2] * normal[2] > kSteep * kSteep * square && !(mesh_->closed && normal[2] > 0.0);
}

// Best-first search for the lowest point. Boxes are searched in order of the least height that they may have, until
// none can be below `lowest` by more than rounding. `reach(box)`: this least height, infinite if the box does not
// count. `visit(triangle)`: called for the triangles of the smallest boxes; may decrease `lowest`.
template <typename Reach, typename Visit>
void TriangleShadow::walk_down(const double& lowest, Reach&& reach, Visit&& visit) {
  const auto& boxes = mesh_->boxes;
  queue_.clear();
  const auto add = [&](std::uint32_t number) {
    const double low = reach(boxes[number]);
    if (!(low < lowest - 2 * slack_)) return;
    queue_.emplace_back(low, number);
    std::push_heap(queue_.begin(), queue_.end(), std::greater<>());
  };
  add(0);
  while (!queue_.empty() && queue_.front().first < lowest - 2 * slack_) {
    const std::uint32_t number = queue_.front().second;
    std::pop_heap(queue_.begin(), queue_.end(), std::greater<>());
    queue_.pop_back();
    const MeshBox& box = boxes[number];
    if (box.second != 0) {
      add(number + 1), add(box.second);
      continue;
    }
    for (std::uint32_t t = box.first; t < box.first + box.count; ++t) visit(t);
  }
}

std::array<double, 3> TriangleShadow::bottom() {
  std::array<double, 3> found = {0.0, 0.0, kInfinite};
  if (mesh_->boxes.empty()) return found;
  walk_down(
      found[2], [&](const MeshBox& box) { return span(box, 2).low; },
      [&](std::uint32_t t) {
        double corner[3][3];
        if (!(corner_span(t, 2, corner).low < found[2])) return;
        corners_of(t, corner);
        for (const auto& one : corner) {
          if (one[2] < found[2]) std::copy(one, one + 3, found.begin());
        }
      });
  return found;
}

void TriangleShadow::find_lowest() {
  const auto reach = [&](const MeshBox& box) {
    const Span z = span(box, 2);
    if (!(z.high >= floor_) || !(z.low < lowest_ - 2 * slack_) || !may_face_down(box)) return kInfinite;
    return is_beside(box) ? kInfinite : std::max(z.low, floor_);
  };
  walk_down(lowest_, reach, [&](std::uint32_t t) {
    double corner[3][3], normal[3];
    const Span z = corner_span(t, 2, corner);
    if (!(z.low < lowest_) || !(z.high >= floor_)) return;
    corners_of(t, corner);
    if (faces_down(corner, normal)) lowest_ = std::min(lowest_, lowest_over(corner, part_, floor_));
  });
}

bool TriangleShadow::left_out_below(const InclinedPlane& plane) {
  if (!cut_ || std::isinf(plane.height)) return cut_;  // everything is below an infinitely high plane
  // Height over the plane is linear in the mesh's own coordinates, so its least value over a box is known exactly.
  double row[3];
  for (int i = 0; i < 3; ++i) {
    row[i] = pose_.rotation[6 + i] - plane.slopes[0] * pose_.rotation[i] - plane.slopes[1] * pose_.rotation[3 + i];
  }
  const double origin = pose_.position[2] - plane.over(pose_.position[0], pose_.position[1]);
  stack_.assign(1, 0);
  while (!stack_.empty()) {
    const std::uint32_t number = stack_.back();
    stack_.pop_back();
    const MeshBox& box = mesh_->boxes[number];
    double least = origin;
    for (int i = 0; i < 3; ++i) least += std::min(row[i] * box.low[i], row[i] * box.high[i]);
    if (least >= slack_ || span(box, 2).high <= ceiling_ || !may_face_down(box) || is_beside(box)) continue;
    if (box.second != 0) {
      stack_.push_back(box.second);
      stack_.push_back(number + 1);
      continue;
    }
    for (std::uint32_t t = box.first; t < box.first + box.count; ++t) {
      double corner[3][3], normal[3];
      if (corner_span(t, 2, corner).low <= ceiling_) continue;
      corners_of(t, corner);
      if (!faces_down(corner, normal)) continue;
      for (auto& at : corner) at[2] -= plane.over(at[0], at[1]);
      if (lowest_over(corner, part_, -kInfinite) < 0.0) return true;
    }
  }
  return false;
}

void TriangleShadow::gather() {
  const auto& boxes = mesh_->boxes;
  stack_.assign(1, 0);
  while (!stack_.empty()) {
    const std::uint32_t number = stack_.back();
    stack_.pop_back();
    const MeshBox& box = boxes[number];
    const Span z = span(box, 2);
    if (!(z.high >= floor_) || !may_face_down(box)) continue;
    const Span x = span(box, 0), y = span(box, 1);
    if (x.low > part_.east || x.high < part_.west || y.low > part_.north || y.high < part_.south) continue;
    if (z.low > ceiling_) {
      cut_ = true;
      continue;
    }
    const bool inside = x.low >= part_.west && x.high <= part_.east && y.low >= part_.south && y.high <= part_.north;
    if (box.second != 0 && !(inside && box.count <= kFew)) {
      stack_.push_back(box.second);
      stack_.push_back(number + 1);
      continue;
    }
    for (std::uint32_t t = box.first; t < box.first + box.count; ++t) take(t);
  }
}

// Add a triangle if it faces down and may be over the part between the floor and the ceiling.
void TriangleShadow::take(std::uint32_t triangle) {
  double corner[3][3], normal[3];
  const Span z = corner_span(triangle, 2, corner);
  if (!(z.high >= floor_)) return;
  const Span x = corner_span(triangle, 0, corner);
  if (x.low > part_.east || x.high < part_.west) return;
  const Span y = corner_span(triangle, 1, corner);
  if (y.low > part_.north || y.high < part_.south) return;
  if (!faces_down(corner, normal)) return;
  if (z.low > ceiling_) {
    cut_ = true;
    return;
  }
  double a[3], b[3];
  for (int i = 0; i < 3; ++i) a[i] = corner[1][i] - corner[0][i], b[i] = corner[2][i] - corner[0][i];
  const double per = 1.0 / normal[2];
  triangles_.emplace_back();
  Triangle& made = triangles_.back();
  made.second[0] = b[1] * per, made.second[1] = -b[0] * per;
  made.third[0] = -a[1] * per, made.third[1] = a[0] * per;
  made.second[2] = -(made.second[0] * corner[0][0] + made.second[1] * corner[0][1]);
  made.third[2] = -(made.third[0] * corner[0][0] + made.third[1] * corner[0][1]);
  made.height = corner[0][2], made.second_rise = a[2], made.third_rise = b[2];
  made.number = triangle;
  spans_.push_back({x, y});
}

// Buckets cover only the part of the area under triangles, so that they are finer under a small body.
void TriangleShadow::place_buckets() {
  grid_ = kNoRectangle;
  for (const auto& [x, y] : spans_) grid_ = around(grid_, {x.low, y.low, x.high, y.high});
  grid_ = common(grid_, part_);
  per_[0] = static_cast<double>(kFinest) / (grid_.east - grid_.west);
  per_[1] = static_cast<double>(kFinest) / (grid_.north - grid_.south);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      triangles_[t].first[axis] = finest_bucket(spans_[t][axis].low, axis);
      triangles_[t].last[axis] = finest_bucket(spans_[t][axis].high, axis);
    }
  }
}

std::uint8_t TriangleShadow::finest_bucket(double at, std::size_t axis) const {
  const double place = (at - (axis == 0 ? grid_.west : grid_.south)) * per_[axis];
  if (!(place > 0.0)) return 0;  // a grid of no extent has one bucket
  return static_cast<std::uint8_t>(place < static_cast<double>(kFinest) ? static_cast<std::size_t>(place)
                                                                        : kFinest - 1);
}

// List the triangles of each bucket that their bounds overlap.
void TriangleShadow::fill_buckets() {
  side_ = kFinest;
  for (const std::size_t side : kBuckets) {
    if (side * side >= kBucketsEach * triangles_.size()) {
      side_ = side;
      break;
    }
  }
  starts_.assign(side_ * side_ + 1, 0);
  const std::size_t finer = kFinest / side_;
  for (std::size_t finest = 0; finest < kFinest; ++finest) coarser_[finest] = static_cast<std::uint8_t>(finest / finer);
  const auto over_each = [this](const Triangle& triangle, auto&& visit) {
    const std::size_t west = coarser_[triangle.first[0]], east = coarser_[triangle.last[0]];
    const std::size_t south = coarser_[triangle.first[1]], north = coarser_[triangle.last[1]];
    for (std::size_t row = south; row <= north; ++row) {
      for (std::size_t column = west; column <= east; ++column) visit(row * side_ + column);
    }
  };
  for (const Triangle& triangle : triangles_) over_each(triangle, [this](std::size_t at) { ++starts_[at + 1]; });
  for (std::size_t i = 0; i < side_ * side_; ++i) starts_[i + 1] += starts_[i];
  entries_.resize(starts_.back());
  fill_.assign(starts_.begin(), starts_.end() - 1);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    over_each(triangles_[t], [this, t](std::size_t at) { entries_[fill_[at]++] = static_cast<std::uint32_t>(t); });
  }
}

double TriangleShadow::height(double x, double y, double floor) const {
  double lowest = kInfinite;
  if (!grid_.holds(x, y)) return lowest;
  const std::size_t at = std::size_t{coarser_[finest_bucket(y, 1)]} * side_ + coarser_[finest_bucket(x, 0)];
  const std::uint32_t* const end = entries_.data() + starts_[at + 1];
  for (const std::uint32_t* entry = entries_.data() + starts_[at]; entry != end; ++entry) {
    const Triangle& triangle = triangles_[*entry];
    const double second = triangle.second[0] * x + triangle.second[1] * y + triangle.second[2];
    const double third = triangle.third[0] * x + triangle.third[1] * y + triangle.third[2];
    const double here = triangle.height + second * triangle.second_rise + third * triangle.third_rise;
    // One branch instead of four, because the processor cannot predict them.
    const double inside = std::min(std::min(second, third), 1.0 - (second + third));
    if ((inside >= -kSeam) & (here >= floor) & (here < lowest)) lowest = here;
  }
  return lowest;
}

bool TriangleShadow::buckets_over(const Rectangle& box, BucketRange& range) const {
  const double slack[2] = {kSeam * (grid_.east - grid_.west), kSeam * (grid_.north - grid_.south)};
  if (!(box.west <= grid_.east + slack[0] && box.east >= grid_.west - slack[0] &&
        box.south <= grid_.north + slack[1] && box.north >= grid_.south - slack[1])) {
    return false;
  }
  const double low[2] = {box.west - slack[0], box.south - slack[1]};
  const double high[2] = {box.east + slack[0], box.north + slack[1]};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    range.first[axis] = coarser_[finest_bucket(low[axis], axis)];
    range.last[axis] = coarser_[finest_bucket(high[axis], axis)];
  }
  return true;
}

// Visit every triangle of a range of buckets exactly once, in the first of its buckets.
template <typename Visit>
void TriangleShadow::over(const BucketRange& range, Visit&& visit) const {
  if (range.count() == side_ * side_) {
    for (std::uint32_t number = 0; number < triangles_.size(); ++number) visit(number);
    return;
  }
  for (std::size_t row = range.first[1]; row <= range.last[1]; ++row) {
    for (std::size_t column = range.first[0]; column <= range.last[0]; ++column) {
      const std::size_t bucket = row * side_ + column;
      for (std::uint32_t entry = starts_[bucket]; entry < starts_[bucket + 1]; ++entry) {
        const Triangle& triangle = triangles_[entries_[entry]];
        if (std::max<std::size_t>(coarser_[triangle.first[0]], range.first[0]) == column &&
            std::max<std::size_t>(coarser_[triangle.first[1]], range.first[1]) == row) {
          visit(entries_[entry]);
        }
      }
    }
  }
}

std::size_t TriangleShadow::entries_of(const BucketRange& range) const {
  std::size_t count = 0;
  for (std::size_t row = range.first[1]; row <= range.last[1]; ++row) {
    count += starts_[row * side_ + range.last[0] + 1] - starts_[row * side_ + range.first[0]];
  }
  return count;
}

void TriangleShadow::lower(const std::vector<Point>& points, double floor, double* heights) const {
  BucketRange range;
  if (!buckets_over(around(points), range)) return;
  // Few triangles are tested against all points. If there are fewer points than buckets, most triangles lie between the
  // points, and looking up each point is cheaper.
  PointGrid grid;
  const bool few = entries_of(range) <= kFewEntries && points.size() >= std::size_t{kEight};
  if (!few && (points.size() < range.count() || !grid.fit(points))) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double found = height(points[i].x, points[i].y, floor);
      if (found < heights[i]) heights[i] = found;
    }
    return;
  }
  static thread_local std::vector<double> x, y, lowest;  // kept between calls so that a step allocates nothing
  // The kernel processes eight points at once. At the end of a row, it continues into the next row or the padding.
  const std::size_t count = points.size(), room = count + std::size_t{kEight};
  x.resize(room), y.resize(room), lowest.resize(room);
  for (std::size_t i = 0; i < count; ++i) x[i] = points[i].x, y[i] = points[i].y;
  std::copy(heights, heights + count, lowest.begin());
  for (std::size_t i = count; i < room; ++i) x[i] = y[i] = 0.0, lowest[i] = -kInfinite;
  over(range, [&](std::uint32_t number) {
    const Triangle& triangle = triangles_[number];
    const double plane[9] = {triangle.second[0], triangle.second[1], triangle.second[2],
                             triangle.third[0], triangle.third[1], triangle.third[2],
                             triangle.height, triangle.second_rise, triangle.third_rise};
    PointRows rows = {x.data(), y.data(), 1, count, count};
    std::size_t at = 0;
    if (!few) {
      const auto& [along, across] = spans_[number];
      std::size_t first[2], end[2];
      grid.find(along.low, along.high, across.low, across.high, first, end);
      if (!(first[0] < end[0] && first[1] < end[1])) return;
      at = first[1] * grid.counts[0] + first[0];
      rows = {x.data() + at, y.data() + at, end[1] - first[1], end[0] - first[0], grid.counts[0]};
    }
    kernels().lower_by_triangle(plane, -kSeam, floor, rows, lowest.data() + at);
  });
  std::copy(lowest.begin(), lowest.end() - kEight, heights);
}

void TriangleShadow::bottoms(std::vector<std::array<double, 3>>& points) {
  points.clear();
  if (triangles_.empty()) return;
  pass_over_higher_vertices();
  const Spot none = {0.0, 0.0, kInfinite};
  inner_.assign(kCandidates * kCandidates, none);
  rim_.assign(kCandidates * kCandidates, none);
  for (const Triangle& triangle : triangles_) offer_lowest(triangle);
  const auto visible = [this](const Spot& spot) {
    return std::isfinite(spot[2]) && !(height(spot[0], spot[1], floor_) < spot[2] - kHidden);
  };
  for (std::size_t at = 0; at < kCandidates * kCandidates; ++at) {
    if (visible(inner_[at])) points.push_back(inner_[at]);
    if (visible(rim_[at]) && is_lowest_on_rim(at)) points.push_back(rim_[at]);
  }
}

std::size_t TriangleShadow::vertex(const Triangle& triangle, std::size_t corner) const {
  return static_cast<std::size_t>(mesh_->faces[3 * std::size_t{triangle.number} + corner]);
}

// Mark vertices that have a lower neighbour, because they are no candidates.
void TriangleShadow::pass_over_higher_vertices() {
  done_.resize(std::max(done_.size(), mesh_->vertices.size() / 3), 0);
  if (++calls_ == 0) {
    std::fill(done_.begin(), done_.end(), 0);
    calls_ = 1;
  }
  for (const Triangle& triangle : triangles_) {
    const double heights[3] = {0.0, triangle.second_rise, triangle.third_rise};
    const double least = std::min({heights[0], heights[1], heights[2]});
    for (std::size_t k = 0; k < 3; ++k) {
      if (heights[k] > least + kLevel) done_[vertex(triangle, k)] = calls_;
    }
  }
}

// Offer the unmarked vertices of a triangle as candidates. If the part's rim cuts it, offer the lowest points there.
void TriangleShadow::offer_lowest(const Triangle& triangle) {
  double corner[3][3];
  const bool may_be_cut = triangle.first[0] == 0 || triangle.first[1] == 0 || triangle.last[0] == kFinest - 1 ||
                          triangle.last[1] == kFinest - 1;
  bool placed = may_be_cut;
  if (placed) corners_of(triangle.number, corner);
  for (std::size_t k = 0; k < 3; ++k) {
    std::uint32_t& looked_at = done_[vertex(triangle, k)];
    if (looked_at == calls_) continue;
    looked_at = calls_;
    if (!placed) corners_of(triangle.number, corner), placed = true;
    if (part_.holds(corner[k][0], corner[k][1])) offer(inner_, {corner[k][0], corner[k][1], corner[k][2]});
  }
  if (!may_be_cut || within(corner, part_)) return;
  const Polygon cut(corner, part_);
  if (cut.count == 0) return;
  double lowest = kInfinite;
  for (std::size_t k = 0; k < cut.count; ++k) lowest = std::min(lowest, cut.corners[k][2]);
  const auto on_rim = [this](const Spot& at) {
    return at[0] == part_.west || at[0] == part_.east || at[1] == part_.south || at[1] == part_.north;
  };
  for (std::size_t k = 0; k < cut.count; ++k) {
    const Spot& at = cut.corners[k];
    if (at[2] <= lowest + kLevel && on_rim(at)) offer(rim_, at);
  }
}

// Make a point the candidate of its bucket if it is lower than the present one.
void TriangleShadow::offer(std::vector<Spot>& candidates, const Spot& spot) {
  if (!(spot[2] >= floor_ && spot[2] <= ceiling_)) return;
  constexpr std::size_t finer = kFinest / kCandidates;
  const std::size_t column = finest_bucket(spot[0], 0) / finer, row = finest_bucket(spot[1], 1) / finer;
  Spot& kept = candidates[row * kCandidates + column];
  // Of equally low points, keep the one nearest to the bucket's middle, so that the order of triangles does not matter.
  const auto away = [&](const Spot& at) {
    return std::hypot(at[0] - grid_.west - (static_cast<double>(column) + 0.5) * finer / per_[0],
                      at[1] - grid_.south - (static_cast<double>(row) + 0.5) * finer / per_[1]);
  };
  if (spot[2] < kept[2] - kLevel || (spot[2] <= kept[2] + kLevel && away(spot) < away(kept))) kept = spot;
}

// Along the rim the surface continues into the next bucket, so only candidates without a lower neighbour count.
bool TriangleShadow::is_lowest_on_rim(std::size_t at) const {
  const std::size_t row = at / kCandidates, column = at % kCandidates;
  for (std::size_t r = row > 0 ? row - 1 : 0; r <= std::min(row + 1, kCandidates - 1); ++r) {
    for (std::size_t c = column > 0 ? column - 1 : 0; c <= std::min(column + 1, kCandidates - 1); ++c) {
      if (rim_[r * kCandidates + c][2] < rim_[at][2] - kLevel) return false;
    }
  }
  return true;
}

}  // namespace mjtactile
