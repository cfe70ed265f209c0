#include "shape.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Directions whose sine with a face is below this count as parallel to it (mjtactile/gap.py).
constexpr double kParallel = 1e-12;

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

void PlacedShape::place(const Shape& shape, const Pose& body, const Rectangle& part) {
  kind_ = shape.kind;
  std::copy(shape.size, shape.size + 3, size_);
  pose_ = composed(body, shape.local);
  if (kind_ == ShapeKind::triangles) {
    shadow_.cast(*shape.mesh, pose_, part);
    return;
  }
  for (int i = 0; i < 3; ++i) {
    from_[i] = 0.0;
    for (int k = 0; k < 3; ++k) from_[i] -= pose_.rotation[3 * k + i] * pose_.position[k];
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

std::size_t PlacedShape::bottoms(double points[2][3]) const {
  const double* up = pose_.rotation + 6;  // the pad's normal in the shape's frame
  double local[3] = {};
  switch (kind_) {
    case ShapeKind::ellipsoid: {
      double length = 0.0;
      for (int i = 0; i < 3; ++i) length += size_[i] * size_[i] * up[i] * up[i];
      for (int i = 0; i < 3; ++i) local[i] = -size_[i] * size_[i] * up[i] / std::sqrt(length);
      in_pad(local, points[0]);
      return 1;
    }
    case ShapeKind::capsule:
    case ShapeKind::cylinder: {
      const bool level = std::abs(up[2]) < kParallel;
      if (kind_ == ShapeKind::capsule) {
        for (int i = 0; i < 3; ++i) local[i] = -size_[0] * up[i];
      } else if (const double length = std::hypot(up[0], up[1]); length >= kParallel) {
        local[0] = -size_[0] * up[0] / length;
        local[1] = -size_[0] * up[1] / length;
      }
      const double across = local[2];
      for (std::size_t end = 0; end < 2; ++end) {
        local[2] = across + ((end == 0) == (up[2] > 0.0) ? -size_[1] : size_[1]);
        in_pad(local, points[end]);
      }
      return level ? 2 : 1;
    }
    case ShapeKind::box:
      for (int i = 0; i < 3; ++i) local[i] = up[i] > 0.0 ? -size_[i] : size_[i];
      in_pad(local, points[0]);
      return 1;
    case ShapeKind::triangles:
      std::copy(shadow_.bottom(), shadow_.bottom() + 3, points[0]);
      return 1;
    default:
      return 0;
  }
}

void PlacedShape::in_pad(const double* local, double* point) const {
  for (int i = 0; i < 3; ++i) {
    point[i] = pose_.position[i];
    for (int k = 0; k < 3; ++k) point[i] += pose_.rotation[3 * i + k] * local[k];
  }
}

}  // namespace mjtactile
