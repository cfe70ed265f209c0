#include "geometry/shape.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Directions whose sine with a face is below this count as parallel to it (mjtactile/gap.py).
constexpr double kParallel = 1e-12;
// How far above its lowest point a mesh is looked at, over the ceiling.
constexpr double kReach = 0.3;
// Points along the edges and generators on which shapes may touch.
constexpr std::size_t kAlong = 17;

// Where a line is inside something convex; empty where enter > leave.
struct Interval {
  double enter, leave;
};
constexpr Interval kMissed = {kNowhere, -kNowhere}, kAlways = {-kNowhere, kNowhere};

Interval common(const Interval& a, const Interval& b) {
  return {std::max(a.enter, b.enter), std::min(a.leave, b.leave)};
}

double entry_of(const Interval& inside) { return inside.enter <= inside.leave ? inside.enter : kNowhere; }

Interval around(double nearest, double within, double square) {
  if (!(within >= 0.0)) return kMissed;
  const double half = std::sqrt(within / square);
  return {nearest - half, nearest + half};
}

Interval through_ball(const double* origin, const double* direction) {
  double square = 0.0, along = 0.0;
  for (int i = 0; i < 3; ++i) square += direction[i] * direction[i], along += origin[i] * direction[i];
  const double nearest = -along / square;
  double distance = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double at = origin[i] + nearest * direction[i];
    distance += at * at;
  }
  return around(nearest, 1.0 - distance, square);
}

// An endless cylinder about z.
Interval through_barrel(const double* origin, const double* direction, double radius) {
  const double square = direction[0] * direction[0] + direction[1] * direction[1];
  if (square < kParallel * kParallel) {
    return origin[0] * origin[0] + origin[1] * origin[1] > radius * radius ? kMissed : kAlways;
  }
  const double nearest = -(origin[0] * direction[0] + origin[1] * direction[1]) / square;
  const double x = origin[0] + nearest * direction[0], y = origin[1] + nearest * direction[1];
  return around(nearest, radius * radius - (x * x + y * y), square);
}

// |coordinate| <= half.
Interval through_slab(double origin, double direction, double half) {
  if (std::abs(direction) < kParallel) return std::abs(origin) > half ? kMissed : kAlways;
  const double reach = half / std::abs(direction), middle = -origin / direction;
  return {middle - reach, middle + reach};
}

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

void PlacedShape::place(const Shape& shape, const Pose& body, const Rectangle& part, double floor,
                        double ceiling) {
  kind_ = shape.kind;
  std::copy(shape.size, shape.size + 3, size_);
  pose_ = composed(body, shape.local);
  mesh_ = shape.mesh.get();
  find_box();
  if (kind_ == ShapeKind::triangles) {
    const bool over = low_[0] < part.east && high_[0] > part.west && low_[1] < part.north && high_[1] > part.south;
    if (over) shadow_.cast(*mesh_, pose_, part, floor, kReach * ceiling);
    return;
  }
  for (int i = 0; i < 3; ++i) {
    from_[i] = 0.0;
    for (int k = 0; k < 3; ++k) from_[i] -= pose_.rotation[3 * k + i] * pose_.position[k];
  }
}

void PlacedShape::find_box() {
  for (int i = 0; i < 3; ++i) {
    const double* row = pose_.rotation + 3 * i;
    double reach = kNowhere, middle = pose_.position[i];
    switch (kind_) {
      case ShapeKind::ellipsoid:
        reach = std::sqrt(row[0] * row[0] * size_[0] * size_[0] + row[1] * row[1] * size_[1] * size_[1] +
                          row[2] * row[2] * size_[2] * size_[2]);
        break;
      case ShapeKind::capsule:
        reach = std::abs(row[2]) * size_[1] + size_[0];
        break;
      case ShapeKind::cylinder:
        reach = std::abs(row[2]) * size_[1] + std::hypot(row[0], row[1]) * size_[0];
        break;
      case ShapeKind::box:
        reach = std::abs(row[0]) * size_[0] + std::abs(row[1]) * size_[1] + std::abs(row[2]) * size_[2];
        break;
      case ShapeKind::triangles:
        reach = mesh_->boxes.empty() ? -kNowhere : 0.0;
        for (int k = 0; k < 3 && !mesh_->boxes.empty(); ++k) {
          const MeshBox& box = mesh_->boxes.front();
          middle += row[k] * (box.low[k] + box.high[k]) / 2;
          reach += std::abs(row[k]) * (box.high[k] - box.low[k]) / 2;
        }
        break;
      default:
        break;
    }
    low_[i] = middle - reach;
    high_[i] = middle + reach;
  }
}

double PlacedShape::height(double x, double y, double floor) const {
  if (kind_ == ShapeKind::triangles) return shadow_.height(x, y, floor);
  const double found = entry(x, y);
  return found >= floor ? found : kNowhere;
}

double PlacedShape::entry(double x, double y) const {
  double origin[3];
  const double* direction = pose_.rotation + 6;
  for (int i = 0; i < 3; ++i) origin[i] = from_[i] + x * pose_.rotation[i] + y * pose_.rotation[3 + i];
  switch (kind_) {
    case ShapeKind::ellipsoid: {
      double scaled[3], along[3];
      for (int i = 0; i < 3; ++i) scaled[i] = origin[i] / size_[i], along[i] = direction[i] / size_[i];
      return entry_of(through_ball(scaled, along));
    }
    case ShapeKind::capsule: {
      double lowest = entry_of(common(through_barrel(origin, direction, size_[0]),
                                      through_slab(origin[2], direction[2], size_[1])));
      const double along[3] = {direction[0] / size_[0], direction[1] / size_[0], direction[2] / size_[0]};
      for (const double end : {-size_[1], size_[1]}) {
        const double scaled[3] = {origin[0] / size_[0], origin[1] / size_[0], (origin[2] - end) / size_[0]};
        lowest = std::min(lowest, entry_of(through_ball(scaled, along)));
      }
      return lowest;
    }
    case ShapeKind::cylinder:
      return entry_of(common(through_barrel(origin, direction, size_[0]),
                             through_slab(origin[2], direction[2], size_[1])));
    case ShapeKind::box: {
      Interval inside = kAlways;
      for (int i = 0; i < 3; ++i) inside = common(inside, through_slab(origin[i], direction[i], size_[i]));
      return entry_of(inside);
    }
    default: {
      const double normal[3] = {pose_.rotation[2], pose_.rotation[5], pose_.rotation[8]};
      if (normal[2] > -kParallel) return kNowhere;
      return pose_.position[2] -
             (normal[0] * (x - pose_.position[0]) + normal[1] * (y - pose_.position[1])) / normal[2];
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
      if (across < kParallel) return;
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
    case ShapeKind::box: {
      // Along the three edges from the lowest corner.
      double corner[3];
      for (int i = 0; i < 3; ++i) corner[i] = up[i] > 0.0 ? -size_[i] : size_[i];
      for (int axis = 0; axis < 3; ++axis) {
        std::copy(corner, corner + 3, local);
        for (std::size_t k = 0; k < kAlong; ++k) {
          local[axis] = size_[axis] * (2.0 * static_cast<double>(k) / (kAlong - 1) - 1.0);
          add_in_pad(local, points);
        }
      }
      return;
    }
    case ShapeKind::triangles:
      shadow_.bottoms(lowest_);
      for (const auto& at : lowest_) points.push_back({at[0], at[1]});
      return;
    default:
      return;
  }
}

void PlacedShape::add_in_pad(const double* local, std::vector<Point>& points) const {
  double at[2];
  for (int i = 0; i < 2; ++i) {
    at[i] = pose_.position[i];
    for (int k = 0; k < 3; ++k) at[i] += pose_.rotation[3 * i + k] * local[k];
  }
  points.push_back({at[0], at[1]});
}

}  // namespace mjtactile
