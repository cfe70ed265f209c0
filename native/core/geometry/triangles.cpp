#include "geometry/triangles.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "geometry/point_grid.hpp"
#include "linalg/kernels.hpp"
#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

// Points this far outside a triangle, relative to its size, still count as inside, so that no gaps open at shared
// edges.
constexpr double kSeam = 1e-9;
// Triangles whose normal has a cosine with the pad's below this are vertical and are ignored.
constexpr double kSteep = 1e-9;
// Possible numbers of buckets along each side. Each bucket consists of a whole number of the finest ones.
constexpr std::size_t kBuckets[] = {4, 6, 8, 12, 16, 24, 32, 48, 96};
// Least number of buckets per cluster. More take longer to fill, and fewer have more triangles to test per point.
constexpr std::size_t kBucketsEach = 4;
// A mesh of more triangles than this has clusters of kTriangles triangles, or of more, so that there are about this
// many.
constexpr std::size_t kClusters = 12288;
// Buckets along each side of the grid that thins candidates for a first touch.
constexpr std::size_t kCandidates = 16;
// Heights of vertices that differ by less than this are equal, because rounding must not choose between them [m].
constexpr double kLevel = 1e-12;
// A candidate this far above another part of the mesh is hidden by it [m].
constexpr double kHidden = 1e-7;
// Rounding of a box's place, relative to the mesh's size and its distance from the pad's origin.
constexpr double kRounding = 1e-14;
// Up to this many entries in the buckets, each triangle is tested against all points. That is as fast as looking up the
// bucket of each point.
constexpr std::size_t kFewEntries = 64;
// Eight points are looked up together if they lie over at most this many buckets.
constexpr std::size_t kMostBuckets = 16;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

using Spot = std::array<double, 3>;

// A triangle clipped at a rectangle: a convex polygon.
struct ClippedTriangle {
  Spot corners[7];
  std::size_t count = 0;

  ClippedTriangle(const double corner[3][3], const Rectangle& part) {
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

bool within(const double corner[3][3], const Rectangle& part) {
  return part.holds(corner[0][0], corner[0][1]) && part.holds(corner[1][0], corner[1][1]) &&
         part.holds(corner[2][0], corner[2][1]);
}

TriangleBlock without_triangles() {
  TriangleBlock none;
  for (std::size_t k = 0; k < kTriangles; ++k) {
    for (std::size_t i = 0; i < 3; ++i) none.second[i][k] = none.third[i][k] = 0.0;
    none.second_rise[k] = none.third_rise[k] = 0.0;
    none.height[k] = std::numeric_limits<double>::quiet_NaN();
  }
  return none;
}

// Least height, at the floor or above, of a triangle over a rectangle [m]; infinite if it has none.
double lowest_over(const double corner[3][3], const Rectangle& part, double floor) {
  double low = kInfinite, high = -kInfinite;
  if (within(corner, part)) {
    low = std::min({corner[0][2], corner[1][2], corner[2][2]});
    high = std::max({corner[0][2], corner[1][2], corner[2][2]});
  } else {
    const ClippedTriangle cut(corner, part);
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
  clusters_.clear();
  blocks_.clear();
  bounds_.clear();
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

// Whether bounds are not over the part.
bool TriangleShadow::is_beside(const Span& x, const Span& y) const {
  return x.low > part_.east || x.high < part_.west || y.low > part_.north || y.high < part_.south;
}

// Whether a triangle of a box may face down.
bool TriangleShadow::may_face_down(const MeshBox& box) const {
  if (!mesh_->closed) return true;
  return box.normals.least_along(pose_.rotation + 6) <= 0.0;
}

// Compute the coordinates of a triangle's corners along an axis of the pad [m]. Returns their bounds.
TriangleShadow::Span TriangleShadow::corner_span(std::uint32_t triangle, int axis, double corner[3][3]) const {
  const double* row = pose_.rotation + 3 * axis;
  for (std::size_t k = 0; k < 3; ++k) {
    const double* from = mesh_->corner(triangle, k);
    corner[k][axis] = pose_.position[axis] + row[0] * from[0] + row[1] * from[1] + row[2] * from[2];
  }
  const double first = corner[0][axis], second = corner[1][axis], third = corner[2][axis];
  return {std::min(std::min(first, second), third), std::max(std::max(first, second), third)};
}

void TriangleShadow::corners_of(std::uint32_t triangle, double corner[3][3]) const {
  for (int axis = 0; axis < 3; ++axis) corner_span(triangle, axis, corner);
}

bool TriangleShadow::faces_down(const double corner[3][3]) const {
  double a[3], b[3], normal[3];
  for (int i = 0; i < 3; ++i) a[i] = corner[1][i] - corner[0][i], b[i] = corner[2][i] - corner[0][i];
  cross(a, b, normal);
  return normal[2] * normal[2] > kSteep * kSteep * dot(normal, normal) && !(mesh_->closed && normal[2] > 0.0);
}

// Best-first search for the lowest point. Boxes are searched in order of the least height that they may have, until
// none can be below the lowest point found by more than rounding.
void TriangleShadow::find_lowest() {
  const auto& boxes = mesh_->boxes;
  queue_.clear();
  const auto add = [&](std::uint32_t number) {
    const MeshBox& box = boxes[number];
    const Span z = span(box, 2);
    const double low = std::max(z.low, floor_);
    if (!(z.high >= floor_) || !(low < lowest_ - 2 * slack_) || !may_face_down(box)) return;
    if (is_beside(span(box, 0), span(box, 1))) return;
    queue_.emplace_back(low, number);
    std::push_heap(queue_.begin(), queue_.end(), std::greater<>());
  };
  add(0);
  while (!queue_.empty() && queue_.front().first < lowest_ - 2 * slack_) {
    const std::uint32_t number = queue_.front().second;
    std::pop_heap(queue_.begin(), queue_.end(), std::greater<>());
    queue_.pop_back();
    const MeshBox& box = boxes[number];
    if (box.second != 0) {
      add(number + 1), add(box.second);
      continue;
    }
    for (std::uint32_t t = box.first; t < box.first + box.count; ++t) {
      double corner[3][3];
      const Span z = corner_span(t, 2, corner);
      if (!(z.low < lowest_) || !(z.high >= floor_)) continue;
      corners_of(t, corner);
      if (faces_down(corner)) lowest_ = std::min(lowest_, lowest_over(corner, part_, floor_));
    }
  }
}

bool TriangleShadow::left_out_below(const InclinedPlane& plane) {
  if (!cut_ || std::isinf(plane.height)) return cut_;  // everything is below an infinitely high plane
  // Height over the plane is linear in the mesh's own coordinates, so its least value over a box is known exactly.
  double row[3];
  for (int i = 0; i < 3; ++i) {
    row[i] = pose_.rotation[6 + i] - plane.slopes[0] * pose_.rotation[i] - plane.slopes[1] * pose_.rotation[3 + i];
  }
  const double origin = pose_.position[2] - plane.over(pose_.position[0], pose_.position[1]);
  const auto enters = [&](const MeshBox& box) {
    return origin + box.least_along(row) < slack_ && span(box, 2).high > ceiling_ && may_face_down(box) &&
           !is_beside(span(box, 0), span(box, 1));
  };
  return mesh_->any_box(enters, [&](const MeshBox& box) {
    for (std::uint32_t t = box.first; t < box.first + box.count; ++t) {
      double corner[3][3];
      if (corner_span(t, 2, corner).low <= ceiling_) continue;
      corners_of(t, corner);
      if (!faces_down(corner)) continue;
      for (auto& at : corner) at[2] -= plane.over(at[0], at[1]);
      if (lowest_over(corner, part_, -kInfinite) < 0.0) return true;
    }
    return false;
  });
}

void TriangleShadow::gather() {
  const std::size_t all = mesh_->boxes.front().count;
  fine_ = all > kClusters;
  Span x, y, z;   // of the box that was entered last
  const auto enters = [&](const MeshBox& box) {
    z = span(box, 2);
    if (!(z.high >= floor_) || !may_face_down(box)) return false;
    x = span(box, 0), y = span(box, 1);
    if (is_beside(x, y)) return false;
    cut_ |= z.low > ceiling_;
    return !(z.low > ceiling_);
  };
  mesh_->any_box(enters, [&](const MeshBox& box) {
    cut_ |= z.high > ceiling_;
    if (fine_) {
      clusters_.push_back({x, y, z.low, box.first, box.count, kNotPlaced, 0, {}, {}, is_inside(x, y),
                           may_be_lowest(box.ring_normals)});
    } else {
      add_triangles(box);
    }
    return false;
  }, std::max<std::size_t>(kTriangles, all / kClusters));
}

// Place up to kTriangles triangles of a box, and add those that count as clusters of one.
void TriangleShadow::add_triangles(const MeshBox& box) {
  const auto block = static_cast<std::uint32_t>(blocks_.size());
  place(box.first, box.count);
  const TriangleBounds& bounds = bounds_.back();
  const bool turns_up = may_be_lowest(box.ring_normals);
  for (std::uint8_t k = 0; k < box.count; ++k) {
    if (std::isnan(blocks_.back().height[k])) continue;
    const Span x = {bounds.west[k], bounds.east[k]}, y = {bounds.south[k], bounds.north[k]};
    clusters_.push_back({widened(x), widened(y), bounds.low[k], box.first + k, 1, block, k, {}, {}, is_inside(x, y),
                         turns_up});
  }
}

bool TriangleShadow::is_inside(const Span& x, const Span& y) const {
  return x.low >= part_.west && x.high <= part_.east && y.low >= part_.south && y.high <= part_.north;
}

// A cluster with its triangles placed, and bounded by those that count.
const TriangleShadow::Cluster& TriangleShadow::placed(std::uint32_t number) const {
  Cluster& cluster = clusters_[number];
  if (cluster.placed != kNotPlaced) return cluster;
  cluster.placed = static_cast<std::uint32_t>(blocks_.size());
  cluster.x = cluster.y = {kInfinite, -kInfinite};
  cluster.low = kInfinite;
  const std::uint32_t end = cluster.first + cluster.count;
  for (std::uint32_t first = cluster.first; first < end; first += kTriangles) {
    place(first, std::min<std::uint32_t>(end - first, kTriangles));
    const TriangleBounds& bounds = bounds_.back();
    for (std::size_t k = 0; k < kTriangles; ++k) {
      cluster.x = {std::min(cluster.x.low, bounds.west[k]), std::max(cluster.x.high, bounds.east[k])};
      cluster.y = {std::min(cluster.y.low, bounds.south[k]), std::max(cluster.y.high, bounds.north[k])};
      cluster.low = std::min(cluster.low, bounds.low[k]);
    }
  }
  cluster.x = widened(cluster.x), cluster.y = widened(cluster.y);
  return cluster;
}

// Place up to kTriangles triangles in a new block.
void TriangleShadow::place(std::uint32_t first, std::uint32_t count) const {
  double corners[3][3][kTriangles];
  for (std::uint32_t k = 0; k < kTriangles; ++k) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const double* from = mesh_->corner(first + std::min(k, count - 1), corner);
      for (std::size_t axis = 0; axis < 3; ++axis) corners[corner][axis][k] = from[axis];
    }
  }
  blocks_.emplace_back();
  bounds_.emplace_back();
  const TriangleWindow window = {part_.west, part_.east, part_.south, part_.north,
                                 floor_,     ceiling_,   kSteep,      mesh_->closed ? 0.0 : kInfinite};
  kernels().place_triangles(corners[0][0], count, pose_.rotation, pose_.position, window, blocks_.back(),
                            bounds_.back());
}

// Visit the placed triangles of a cluster that count: number of the block, place in it, and number in the mesh.
template <typename Visit>
void TriangleShadow::each_triangle(const Cluster& cluster, Visit&& visit) const {
  for (std::uint32_t t = 0; t < cluster.count; ++t) {
    const std::size_t block = cluster.placed + t / kTriangles, k = cluster.lane + t % kTriangles;
    if (!std::isnan(blocks_[block].height[k])) visit(block, k, cluster.first + t);
  }
}

// Buckets cover only the part of the area under clusters, so that they are finer under a small body.
void TriangleShadow::place_buckets() {
  grid_ = kNoRectangle;
  for (const Cluster& cluster : clusters_) {
    grid_ = around(grid_, {cluster.x.low, cluster.y.low, cluster.x.high, cluster.y.high});
  }
  grid_ = common(grid_, part_);
  per_[0] = static_cast<double>(kFinest) / (grid_.east - grid_.west);
  per_[1] = static_cast<double>(kFinest) / (grid_.north - grid_.south);
  for (Cluster& cluster : clusters_) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const Span& span = axis == 0 ? cluster.x : cluster.y;
      cluster.from[axis] = finest_bucket(span.low, axis);
      cluster.to[axis] = finest_bucket(span.high, axis);
    }
  }
}

std::uint8_t TriangleShadow::finest_bucket(double at, std::size_t axis) const {
  const double place = (at - (axis == 0 ? grid_.west : grid_.south)) * per_[axis];
  if (!(place > 0.0)) return 0;  // a grid of no extent has one bucket
  return static_cast<std::uint8_t>(place < static_cast<double>(kFinest) ? static_cast<std::size_t>(place)
                                                                        : kFinest - 1);
}

// List the clusters of each bucket that their bounds overlap.
void TriangleShadow::fill_buckets() {
  side_ = kFinest;
  for (const std::size_t side : kBuckets) {
    if (side * side >= kBucketsEach * clusters_.size()) {
      side_ = side;
      break;
    }
  }
  starts_.assign(side_ * side_ + 1, 0);
  packed_.clear();
  packed_firsts_.assign(side_ * side_, kNotPlaced);
  const std::size_t finer = kFinest / side_;
  for (std::size_t finest = 0; finest < kFinest; ++finest) coarser_[finest] = static_cast<std::uint8_t>(finest / finer);
  const auto over_each = [this](const Cluster& cluster, auto&& visit) {
    const std::size_t west = coarser_[cluster.from[0]], east = coarser_[cluster.to[0]];
    const std::size_t south = coarser_[cluster.from[1]], north = coarser_[cluster.to[1]];
    for (std::size_t row = south; row <= north; ++row) {
      for (std::size_t column = west; column <= east; ++column) visit(row * side_ + column);
    }
  };
  for (const Cluster& cluster : clusters_) over_each(cluster, [this](std::size_t at) { ++starts_[at + 1]; });
  for (std::size_t i = 0; i < side_ * side_; ++i) starts_[i + 1] += starts_[i];
  entries_.resize(starts_.back());
  fill_.assign(starts_.begin(), starts_.end() - 1);
  for (std::size_t i = 0; i < clusters_.size(); ++i) {
    over_each(clusters_[i], [this, i](std::size_t at) { entries_[fill_[at]++] = static_cast<std::uint32_t>(i); });
  }
}

// The kernel processes eight points at once. At the end of a row, it continues into the next row or the padding.
void TriangleShadow::PaddedPoints::set(const std::vector<Point>& points, const double* given) {
  const std::size_t count = points.size(), room = count + std::size_t{kEight};
  x.resize(room), y.resize(room), heights.resize(room);
  for (std::size_t i = 0; i < count; ++i) x[i] = points[i].x, y[i] = points[i].y;
  std::copy(given, given + count, heights.begin());
  for (std::size_t i = count; i < room; ++i) x[i] = y[i] = 0.0, heights[i] = -kInfinite;
}

PointRows TriangleShadow::PaddedPoints::row(std::size_t from, std::size_t end) const {
  return {x.data() + from, y.data() + from, 1, end - from, end - from};
}

// The first block of a bucket's triangles, which are packed when a height over the bucket is asked for again. Tested
// together they are much faster than where they were placed.
std::uint32_t TriangleShadow::packed(std::size_t bucket) const {
  std::uint32_t& first = packed_firsts_[bucket];
  if (first != kAsked) return first;
  static const TriangleBlock none = without_triangles();
  first = static_cast<std::uint32_t>(packed_.size());
  for (std::uint32_t entry = starts_[bucket]; entry < starts_[bucket + 1]; ++entry) {
    const std::size_t lane = (entry - starts_[bucket]) % kTriangles;
    if (lane == 0) packed_.push_back(none);
    const Cluster& one = clusters_[entries_[entry]];
    packed_.back().copy(lane, blocks_[one.placed], one.lane);
  }
  return first;
}

double TriangleShadow::height(double x, double y, double floor) const {
  double lowest = kInfinite;
  if (!grid_.holds(x, y)) return lowest;
  const auto lower_to = [&](const TriangleBlock& block) {
    lowest = kernels().lowest_of_triangles(block, x, y, -kSeam, floor, lowest);
  };
  const std::size_t bucket = std::size_t{coarser_[finest_bucket(y, 1)]} * side_ + coarser_[finest_bucket(x, 0)];
  const std::uint32_t first = starts_[bucket], end = starts_[bucket + 1];
  if (!fine_ && packed_firsts_[bucket] == kNotPlaced) {
    packed_firsts_[bucket] = kAsked;
    std::uint32_t last = kNotPlaced;
    for (std::uint32_t entry = first; entry < end; ++entry) {
      const std::uint32_t block = clusters_[entries_[entry]].placed;
      if (block != last) lower_to(blocks_[block]);
      last = block;
    }
    return lowest;
  }
  if (!fine_) {
    const std::size_t block = packed(bucket);
    for (std::size_t k = 0; k * kTriangles < end - first; ++k) lower_to(packed_[block + k]);
    return lowest;
  }
  for (std::uint32_t entry = first; entry < end; ++entry) {
    const Cluster& bounds = clusters_[entries_[entry]];
    const bool beside = (x < bounds.x.low) | (x > bounds.x.high) | (y < bounds.y.low) | (y > bounds.y.high);
    if (beside | (bounds.low >= lowest)) continue;
    const Cluster& cluster = placed(entries_[entry]);
    for (std::size_t k = 0; k < cluster.blocks(); ++k) lower_to(blocks_[cluster.placed + k]);
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

// Visit every cluster of a range of buckets exactly once, in the first of its buckets.
template <typename Visit>
void TriangleShadow::over(const BucketRange& range, Visit&& visit) const {
  if (range.count() == side_ * side_) {
    for (std::uint32_t number = 0; number < clusters_.size(); ++number) visit(number);
    return;
  }
  for (std::size_t row = range.first[1]; row <= range.last[1]; ++row) {
    for (std::size_t column = range.first[0]; column <= range.last[0]; ++column) {
      const std::size_t bucket = row * side_ + column;
      for (std::uint32_t entry = starts_[bucket]; entry < starts_[bucket + 1]; ++entry) {
        const Cluster& cluster = clusters_[entries_[entry]];
        if (std::max<std::size_t>(coarser_[cluster.from[0]], range.first[0]) == column &&
            std::max<std::size_t>(coarser_[cluster.from[1]], range.first[1]) == row) {
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
  const bool apart = !few && (points.size() < range.count() || !grid.fit(points));
  if (apart && fine_) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      heights[i] = std::min(heights[i], height(points[i].x, points[i].y, floor));
    }
    return;
  }
  static thread_local PaddedPoints padded;  // kept between calls so that a step allocates nothing
  padded.set(points, heights);
  if (apart) {
    lower_by_eights(floor, padded);
    std::copy(padded.heights.begin(), padded.heights.end() - kEight, heights);
    return;
  }
  const auto any = [&](const Rectangle& under, std::size_t from[2], std::size_t end[2]) {
    grid.find(under, from, end);
    return from[0] < end[0] && from[1] < end[1];
  };
  over(range, [&](std::uint32_t number) {
    std::size_t from[2], end[2];
    const Cluster& bounds = clusters_[number];
    if (!few && fine_ && !any({bounds.x.low, bounds.y.low, bounds.x.high, bounds.y.high}, from, end)) return;
    each_triangle(placed(number), [&](std::size_t block, std::size_t k, std::uint32_t) {
      PointRows rows = padded.row(0, points.size());
      std::size_t at = 0;
      if (!few) {
        const TriangleBounds& own = bounds_[block];
        if (!any({own.west[k], own.south[k], own.east[k], own.north[k]}, from, end)) return;
        at = from[1] * grid.counts[0] + from[0];
        rows = {padded.x.data() + at, padded.y.data() + at, end[1] - from[1], end[0] - from[0], grid.counts[0]};
      }
      kernels().lower_by_triangle(blocks_[block], k, -kSeam, floor, rows, padded.heights.data() + at);
    });
  });
  std::copy(padded.heights.begin(), padded.heights.end() - kEight, heights);
}

// Lower the heights of points eight at a time, because those that follow each other are mostly near each other. For
// meshes whose clusters are single triangles.
void TriangleShadow::lower_by_eights(double floor, PaddedPoints& points) const {
  BucketRange range;
  for (std::size_t first = 0; first < points.count(); first += kEight) {
    const std::size_t end = std::min(points.count(), first + std::size_t{kEight});
    Rectangle box = kNoRectangle;
    for (std::size_t i = first; i < end; ++i) box = around(box, Point{points.x[i], points.y[i]});
    if (!buckets_over(box, range)) continue;
    if (range.count() > kMostBuckets) {
      for (std::size_t i = first; i < end; ++i) {
        points.heights[i] = std::min(points.heights[i], height(points.x[i], points.y[i], floor));
      }
      continue;
    }
    over(range, [&](std::uint32_t number) {
      const Cluster& one = clusters_[number];
      kernels().lower_by_triangle(blocks_[one.placed], one.lane, -kSeam, floor, points.row(first, end),
                                  points.heights.data() + first);
    });
  }
}

void TriangleShadow::bottoms(std::vector<std::array<double, 3>>& points) {
  points.clear();
  if (clusters_.empty()) return;
  done_.resize(std::max(done_.size(), mesh_->vertices.size() / 3), 0);
  if (++calls_ == 0) {
    std::fill(done_.begin(), done_.end(), 0);
    calls_ = 1;
  }
  const Spot none = {0.0, 0.0, kInfinite};
  inner_.assign(kCandidates * kCandidates, none);
  rim_.assign(kCandidates * kCandidates, none);
  for (std::uint32_t number = 0; number < clusters_.size(); ++number) {
    if (clusters_[number].inside && !clusters_[number].turns_up) continue;
    const Cluster& cluster = placed(number);
    each_triangle(cluster, [&](std::size_t, std::size_t, std::uint32_t triangle) {
      if (cluster.turns_up) offer_vertices(triangle);
      if (!cluster.inside) offer_cuts(triangle);
    });
  }
  const auto visible = [this](const Spot& spot) {
    return std::isfinite(spot[2]) && !(height(spot[0], spot[1], floor_) < spot[2] - kHidden);
  };
  for (std::size_t at = 0; at < kCandidates * kCandidates; ++at) {
    if (visible(inner_[at])) points.push_back(inner_[at]);
    if (visible(rim_[at]) && is_lowest_on_rim(at)) points.push_back(rim_[at]);
  }
}

// Whether a surface with normals within bounds may have a lowest point: along the pad its normals must not all lean to
// the same side.
bool TriangleShadow::may_be_lowest(const NormalBounds& ring) const {
  if (!mesh_->closed) return true;
  for (int axis = 0; axis < 2; ++axis) {
    const double* along = pose_.rotation + 3 * axis;
    if (ring.least_along(along) > 0.0 || ring.most_along(along) < 0.0) return false;
  }
  return true;
}

// Whether no triangle around a vertex that faces down has a lower corner.
bool TriangleShadow::is_lowest_of_ring(std::size_t vertex) const {
  const double *up = pose_.rotation + 6, *here = mesh_->at(vertex);
  for (std::uint32_t k = mesh_->ring_starts[vertex]; k < mesh_->ring_starts[vertex + 1]; ++k) {
    const std::uint32_t triangle = mesh_->rings[k];
    for (std::size_t i = 0; i < 3; ++i) {
      const double* at = mesh_->corner(triangle, i);
      const double rise = up[0] * (at[0] - here[0]) + up[1] * (at[1] - here[1]) + up[2] * (at[2] - here[2]);
      if (rise >= -kLevel) continue;
      double corner[3][3];
      corners_of(triangle, corner);
      if (faces_down(corner)) return false;
    }
  }
  return true;
}

// Offer the vertices of a triangle that have no lower neighbour as candidates.
void TriangleShadow::offer_vertices(std::uint32_t triangle) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t number = mesh_->vertex(triangle, k);
    if (done_[number] == calls_) continue;
    done_[number] = calls_;
    if (!may_be_lowest(mesh_->ring_normals[number]) || !is_lowest_of_ring(number)) continue;
    double corner[3][3];
    corners_of(triangle, corner);
    if (part_.holds(corner[k][0], corner[k][1])) offer(inner_, {corner[k][0], corner[k][1], corner[k][2]});
  }
}

// If the part's rim cuts a triangle, offer the lowest points there.
void TriangleShadow::offer_cuts(std::uint32_t triangle) {
  double corner[3][3];
  corners_of(triangle, corner);
  if (within(corner, part_)) return;
  const ClippedTriangle cut(corner, part_);
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
