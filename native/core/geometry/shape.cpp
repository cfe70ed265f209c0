#include "geometry/shape.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Directions whose sine with a face is below this count as parallel to it (mjtactile/geometry/primitives.py).
constexpr double kParallel = 1e-12;
// Axes whose sine with the pad is below this are level, and both of their ends are lowest.
constexpr double kLevel = 1e-9;
// Number of candidates along each edge or generator on which a shape may touch.
constexpr std::size_t kAlong = 17;
// Fraction by which candidates are moved inside, because rounding would decide whether the shape is over its own rim.
constexpr double kInside = 1e-9;

// The segment of a line that is inside a convex shape; empty if enter > leave.
struct Interval {
  double enter, leave;
};
constexpr Interval kMissed = {kNowhere, -kNowhere}, kAlways = {-kNowhere, kNowhere};

Interval common(const Interval& a, const Interval& b) {
  return {std::max(a.enter, b.enter), std::min(a.leave, b.leave)};
}

double entry_of(const Interval& inside) { return inside.enter <= inside.leave ? inside.enter : kNowhere; }

}  // namespace

Pose composed(const Pose& body, const Pose& local) {
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    pose.position[i] = body.position[i];
    for (int k = 0; k < 3; ++k) pose.position[i] += body.rotation[3 * i + k] * local.position[k];
    for (int j = 0; j < 3; ++j) {
      double sum = 0.0;
      for (int k = 0; k < 3; ++k) sum += body.rotation[3 * i + k] * local.rotation[3 * k + j];
      pose.rotation[3 * i + j] = sum;
    }
  }
  return pose;
}

double reach_along(ShapeKind kind, const double* size, const double* direction) {
  const double x = direction[0], y = direction[1], z = direction[2];
  switch (kind) {
    case ShapeKind::ellipsoid:
      return std::sqrt(x * x * size[0] * size[0] + y * y * size[1] * size[1] + z * z * size[2] * size[2]);
    case ShapeKind::capsule: return std::abs(z) * size[1] + size[0];
    case ShapeKind::cylinder: return std::abs(z) * size[1] + std::hypot(x, y) * size[0];
    case ShapeKind::box: return std::abs(x) * size[0] + std::abs(y) * size[1] + std::abs(z) * size[2];
    default: return kNowhere;
  }
}

namespace {

struct BoundingBox {
  Rectangle seen;   // from above
  double highest;   // [m]
};

// Bounding box in the pad frame of a shape, other than a half space, at a pose there. It is empty for an empty mesh.
BoundingBox bounding_box(const Shape& shape, const Pose& pose) {
  double middle[3] = {}, half[3] = {shape.size[0], shape.size[1], shape.size[2]};
  switch (shape.kind) {
    case ShapeKind::capsule: half[1] = half[0], half[2] = half[0] + shape.size[1]; break;
    case ShapeKind::cylinder: half[1] = half[0], half[2] = shape.size[1]; break;
    case ShapeKind::triangles:
      if (shape.mesh->boxes.empty()) return {kNoRectangle, -kNowhere};
      for (int k = 0; k < 3; ++k) {
        middle[k] = (shape.mesh->boxes[0].low[k] + shape.mesh->boxes[0].high[k]) / 2;
        half[k] = (shape.mesh->boxes[0].high[k] - shape.mesh->boxes[0].low[k]) / 2;
      }
      break;
    default: break;
  }
  double low[3], high[3];
  for (int i = 0; i < 3; ++i) {
    double at = pose.position[i], around = 0.0;
    for (int k = 0; k < 3; ++k) {
      at += pose.rotation[3 * i + k] * middle[k];
      around += std::abs(pose.rotation[3 * i + k]) * half[k];
    }
    low[i] = at - around, high[i] = at + around;
  }
  return {{low[0], low[1], high[0], high[1]}, high[2]};
}

}  // namespace

Rectangle part_under(const Shape& shape, const Pose& body, const Rectangle& over, double floor) {
  const Pose pose = composed(body, shape.local);
  if (shape.kind == ShapeKind::half_space) {
    const double normal[3] = {pose.rotation[2], pose.rotation[5], pose.rotation[8]};
    if (!(normal[2] > 0.0)) return over;
    // It is highest at the corner to which it rises.
    const double x = (normal[0] < 0.0 ? over.east : over.west) - pose.position[0];
    const double y = (normal[1] < 0.0 ? over.north : over.south) - pose.position[1];
    return pose.position[2] - (normal[0] * x + normal[1] * y) / normal[2] >= floor ? over : kNoRectangle;
  }
  const BoundingBox box = bounding_box(shape, pose);
  return box.highest >= floor ? common(over, box.seen) : kNoRectangle;
}

void PlacedShape::place(const Shape& shape, const Pose& body, const Rectangle& part, const HeightRange& range) {
  kind_ = shape.kind;
  std::copy(shape.size, shape.size + 3, size_);
  pose_ = composed(body, shape.local);
  mesh_ = shape.mesh.get();
  find_box();
  if (kind_ == ShapeKind::triangles) {
    if (is_over(part)) shadow_.cast(*mesh_, pose_, part, range.floor, range.reach, range.surface);
    return;
  }
  const double per[3] = {1.0 / size_[0], 1.0 / size_[0], 1.0 / size_[0]};
  const double semi[3] = {1.0 / size_[0], 1.0 / size_[1], 1.0 / size_[2]};
  switch (kind_) {
    case ShapeKind::ellipsoid:
      rounds_[0] = round(semi, 3, pose_.position);
      break;
    case ShapeKind::capsule:
      for (int end = 0; end < 2; ++end) {
        double centre[3];
        for (int i = 0; i < 3; ++i) {
          centre[i] = pose_.position[i] + (end == 0 ? -size_[1] : size_[1]) * pose_.rotation[3 * i + 2];
        }
        rounds_[end] = round(per, 3, centre);
      }
      [[fallthrough]];
    case ShapeKind::cylinder:
      rounds_[2] = round(per, 2, pose_.position);
      slabs_[0] = slab(2, size_[1]);
      break;
    case ShapeKind::box:
      for (int i = 0; i < 3; ++i) slabs_[i] = slab(i, size_[i]);
      break;
    default:
      break;
  }
}

// The part where scaled coordinates along the first `axes` axes, from a centre, are in the unit ball: an ellipsoid for
// three axes, a cylinder for two.
PlacedShape::Round PlacedShape::round(const double* scales, int axes, const double* centre) const {
  Round made = {{centre[0], centre[1], centre[2]}, {0.0, 0.0}, 0.0, 0.0, 0.0, 0.0, false};
  double along[3][3] = {}, square = 0.0, straight = 0.0;  // the pad's axes in the scaled frame
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < axes; ++i) along[k][i] = pose_.rotation[3 * k + i] * scales[i];
  }
  for (int i = 0; i < axes; ++i) {
    square += along[2][i] * along[2][i];
    straight += pose_.rotation[6 + i] * pose_.rotation[6 + i];
  }
  made.upright = straight < kParallel * kParallel;
  for (int k = 0; k < 2 && !made.upright; ++k) {
    for (int i = 0; i < axes; ++i) made.slope[k] -= along[k][i] * along[2][i] / square;
    for (int i = 0; i < axes; ++i) along[k][i] += made.slope[k] * along[2][i];
  }
  const double per = made.upright ? 1.0 : 1.0 / square;
  made.square = per;
  for (int i = 0; i < axes; ++i) {
    made.xx += along[0][i] * along[0][i] * per;
    made.xy += along[0][i] * along[1][i] * per;
    made.yy += along[1][i] * along[1][i] * per;
  }
  return made;
}

// The part where |coordinate| <= half along one of the shape's axes.
PlacedShape::Slab PlacedShape::slab(int axis, double half) const {
  const double x = pose_.rotation[axis], y = pose_.rotation[3 + axis], direction = pose_.rotation[6 + axis];
  if (std::abs(direction) < kParallel) return {{x, y}, kNowhere, half};
  return {{-x / direction, -y / direction}, half / std::abs(direction), kNowhere};
}

void PlacedShape::find_box() {
  for (int i = 0; i < 3; ++i) {
    const double* row = pose_.rotation + 3 * i;
    double reach = 0.0, middle = pose_.position[i];
    if (kind_ != ShapeKind::triangles) {
      reach = reach_along(kind_, size_, row);
    } else if (mesh_->boxes.empty()) {
      reach = -kNowhere;
    } else {
      const MeshBox& box = mesh_->boxes.front();
      for (int k = 0; k < 3; ++k) {
        middle += row[k] * (box.low[k] + box.high[k]) / 2;
        reach += std::abs(row[k]) * (box.high[k] - box.low[k]) / 2;
      }
    }
    low_[i] = middle - reach;
    high_[i] = middle + reach;
  }
}

double PlacedShape::height(double x, double y, double floor) const {
  // The box is no test for triangles: rounding would decide whether one of its corners is beside it.
  if (kind_ == ShapeKind::triangles) return shadow_.height(x, y, floor);
  if (x < low_[0] || x > high_[0] || y < low_[1] || y > high_[1]) return kNowhere;
  const double found = entry(x, y);
  return found >= floor ? found : kNowhere;
}

void PlacedShape::lower(const std::vector<Point>& points, double floor, double* heights) const {
  if (kind_ == ShapeKind::ellipsoid) {
    const Round& ball = rounds_[0];
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double x = points[i].x - ball.centre[0], y = points[i].y - ball.centre[1];
      const double within = ball.square - (ball.xx * x * x + 2.0 * ball.xy * x * y + ball.yy * y * y);
      const double found = ball.centre[2] + (ball.slope[0] * x + ball.slope[1] * y - std::sqrt(std::max(within, 0.0)));
      heights[i] = within >= 0.0 && found >= floor && found < heights[i] ? found : heights[i];
    }
    return;
  }
  if (kind_ == ShapeKind::triangles) return shadow_.lower(points, floor, heights);
  if (kind_ == ShapeKind::box) return lower_to_box(points, floor, heights);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (low_[2] < heights[i]) heights[i] = std::min(heights[i], height(points[i].x, points[i].y, floor));
  }
}

// The lower end of a line's segment inside all three slabs, given the line's place from the box's middle; kNowhere if
// there is none. Without branches, so that the compiler vectorises loops over it.
double PlacedShape::entry_of_box(const Slab (&slabs)[3], double x, double y, double z) {
  bool meets = true;
  double enter = -kNowhere, leave = kNowhere;
  for (int k = 0; k < 3; ++k) {
    const double middle = slabs[k].slope[0] * x + slabs[k].slope[1] * y;
    meets &= std::abs(middle) <= slabs[k].reach;
    enter = std::max(enter, z + (middle - slabs[k].half));
    leave = std::min(leave, z + (middle + slabs[k].half));
  }
  meets &= enter <= leave;
  return meets ? enter : kNowhere;
}

// The same as height() for each point.
void PlacedShape::lower_to_box(const std::vector<Point>& points, double floor, double* heights) const {
  // Local copies, so that the compiler vectorises the loop.
  const Point* const at = points.data();
  const std::size_t count = points.size();
  const Slab slabs[3] = {slabs_[0], slabs_[1], slabs_[2]};
  const Rectangle over = {low_[0], low_[1], high_[0], high_[1]};
  const double middle[3] = {pose_.position[0], pose_.position[1], pose_.position[2]};
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_over =
        (at[i].x >= over.west) & (at[i].x <= over.east) & (at[i].y >= over.south) & (at[i].y <= over.north);
    const double found = entry_of_box(slabs, at[i].x - middle[0], at[i].y - middle[1], middle[2]);
    heights[i] = (is_over & (found >= floor) & (found < heights[i])) ? found : heights[i];
  }
}

double PlacedShape::entry(double at_x, double at_y) const {
  const auto inside_round = [&](const Round& part) -> Interval {
    const double x = at_x - part.centre[0], y = at_y - part.centre[1];
    const double within = part.square - (part.xx * x * x + 2.0 * part.xy * x * y + part.yy * y * y);
    if (!(within >= 0.0)) return kMissed;
    if (part.upright) return kAlways;
    const double middle = part.slope[0] * x + part.slope[1] * y, half = std::sqrt(within);
    return {part.centre[2] + (middle - half), part.centre[2] + (middle + half)};
  };
  const double x = at_x - pose_.position[0], y = at_y - pose_.position[1], z = pose_.position[2];
  const auto inside_slab = [&](const Slab& part) -> Interval {
    const double middle = part.slope[0] * x + part.slope[1] * y;
    if (std::abs(middle) > part.reach) return kMissed;
    return {z + (middle - part.half), z + (middle + part.half)};
  };
  switch (kind_) {
    case ShapeKind::ellipsoid:
      return entry_of(inside_round(rounds_[0]));
    case ShapeKind::capsule:
      return std::min({entry_of(common(inside_round(rounds_[2]), inside_slab(slabs_[0]))),
                       entry_of(inside_round(rounds_[0])), entry_of(inside_round(rounds_[1]))});
    case ShapeKind::cylinder:
      return entry_of(common(inside_round(rounds_[2]), inside_slab(slabs_[0])));
    case ShapeKind::box:
      return entry_of_box(slabs_, x, y, z);
    default: {
      const double normal[3] = {pose_.rotation[2], pose_.rotation[5], pose_.rotation[8]};
      return normal[2] > -kParallel ? kNowhere : z - (normal[0] * x + normal[1] * y) / normal[2];
    }
  }
}

// Over each point the box is where all its slabs are. So its lower surface is the highest lower side of its slabs, and
// it exists where that is no higher than any upper side.
void PlacedShape::keep_below(const Segment& line, const double (&plane)[2], SegmentPart& part) const {
  double middles[3][2];
  for (int k = 0; k < 3; ++k) {
    for (int end = 0; end < 2; ++end) {
      const Point& at = end == 0 ? line.start : line.end;
      const double x = at.x - pose_.position[0], y = at.y - pose_.position[1];
      middles[k][end] = slabs_[k].slope[0] * x + slabs_[k].slope[1] * y;
    }
  }
  for (int k = 0; k < 3; ++k) {
    const double *middle = middles[k], half = slabs_[k].half, reach = slabs_[k].reach;
    if (slabs_[k].is_upright()) {
      part.keep_positive(reach - middle[0], reach - middle[1]);
      part.keep_positive(reach + middle[0], reach + middle[1]);
      continue;
    }
    const double lower[2] = {middle[0] - half, middle[1] - half};
    part.keep_positive(plane[0] - pose_.position[2] - lower[0], plane[1] - pose_.position[2] - lower[1]);
    for (int j = 0; j < 3; ++j) {
      if (j == k || slabs_[j].is_upright()) continue;
      part.keep_positive(middles[j][0] + slabs_[j].half - lower[0], middles[j][1] + slabs_[j].half - lower[1]);
    }
  }
}

void PlacedShape::add_bottoms(std::vector<Point>& points) {
  const double* up = pose_.rotation + 6;  // the pad's normal in the shape's frame
  double local[3] = {};
  switch (kind_) {
    case ShapeKind::ellipsoid: {
      double length = 0.0;
      for (int i = 0; i < 3; ++i) length += size_[i] * size_[i] * up[i] * up[i];
      for (int i = 0; i < 3; ++i) local[i] = -size_[i] * size_[i] * up[i] / std::sqrt(length);
      add_in_pad(local, points);
      return;
    }
    case ShapeKind::capsule:
    case ShapeKind::cylinder: {
      const double across = std::hypot(up[0], up[1]);
      if (across < kLevel) return;
      for (int i = 0; i < 2; ++i) local[i] = -size_[0] * up[i] / across;
      for (std::size_t k = 0; k < kAlong; ++k) {
        local[2] = size_[1] * (2.0 * static_cast<double>(k) / (kAlong - 1) - 1.0);
        add_in_pad(local, points);
      }
      if (kind_ == ShapeKind::cylinder) return;
      for (const double end : {-size_[1], size_[1]}) {
        for (int i = 0; i < 3; ++i) local[i] = -size_[0] * up[i];
        local[2] += end;
        add_in_pad(local, points);
      }
      return;
    }
    case ShapeKind::box:
      for (int axis = 0; axis < 3; ++axis) add_lowest_edges(axis, points);
      return;
    case ShapeKind::triangles:
      shadow_.bottoms(lowest_);
      for (const auto& at : lowest_) points.push_back({at[0], at[1]});
      return;
    default:
      return;
  }
}

// Add points along those edges of a box in one direction that end in a lowest corner. Vertical edges need none, because
// other edges have their lowest corners.
void PlacedShape::add_lowest_edges(int axis, std::vector<Point>& points) const {
  const double* up = pose_.rotation + 6;
  const int one = (axis + 1) % 3, other = (axis + 2) % 3;
  const auto level = [up](int i) { return std::abs(up[i]) < kLevel; };
  if (level(one) && level(other)) return;
  for (const double first : {-1.0, 1.0}) {
    if (!level(one) && first * up[one] > 0.0) continue;
    for (const double second : {-1.0, 1.0}) {
      if (!level(other) && second * up[other] > 0.0) continue;
      double local[3];
      local[one] = first * size_[one], local[other] = second * size_[other];
      for (std::size_t k = 0; k < kAlong; ++k) {
        local[axis] = size_[axis] * (2.0 * static_cast<double>(k) / (kAlong - 1) - 1.0);
        add_in_pad(local, points);
      }
    }
  }
}

void PlacedShape::add_in_pad(const double* local, std::vector<Point>& points) const {
  double at[2];
  for (int i = 0; i < 2; ++i) {
    at[i] = pose_.position[i];
    for (int k = 0; k < 3; ++k) at[i] += (1.0 - kInside) * pose_.rotation[3 * i + k] * local[k];
  }
  points.push_back({at[0], at[1]});
}

}  // namespace mjtactile
