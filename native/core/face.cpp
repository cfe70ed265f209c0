#include "face.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

double cross(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

}  // namespace

// Andrew's monotone chain.
std::vector<Point> convex_hull(std::vector<Point> points) {
  std::sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  if (points.size() < 3) return points;
  std::vector<Point> hull;
  for (int half = 0; half < 2; ++half) {
    const std::size_t base = hull.size();
    for (const Point& point : points) {
      while (hull.size() >= base + 2 && cross(hull[hull.size() - 2], hull.back(), point) <= 0.0) hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

bool nearest_inside(const std::vector<Point>& polygon, const Point& point, double margin, Point& nearest) {
  nearest = point;
  if (polygon.size() < 3) return false;
  const auto depth = [margin](const Point& a, const Point& b, const Point& at) {
    return cross(a, b, at) - margin * std::hypot(b.x - a.x, b.y - a.y);
  };
  bool inside = true;
  for (std::size_t i = 0; i < polygon.size() && inside; ++i) {
    inside = depth(polygon[i], polygon[(i + 1) % polygon.size()], point) > 0.0;
  }
  if (inside) return true;
  // The polygon without what lies within the margin of its sides.
  std::vector<Point> inner = polygon, before;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    before.swap(inner);
    inner.clear();
    for (std::size_t k = 0; k < before.size(); ++k) {
      const Point &from = before[k], &to = before[(k + 1) % before.size()];
      const double here = depth(a, b, from), there = depth(a, b, to);
      if (here >= 0.0) inner.push_back(from);
      if ((here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0)) {
        const double part = here / (here - there);
        inner.push_back({from.x + part * (to.x - from.x), from.y + part * (to.y - from.y)});
      }
    }
  }
  double least = INFINITY;
  for (std::size_t k = 0; k < inner.size(); ++k) {
    const Point &a = inner[k], &b = inner[(k + 1) % inner.size()];
    const double x = b.x - a.x, y = b.y - a.y, square = x * x + y * y;
    const double along = square > 0.0 ? ((point.x - a.x) * x + (point.y - a.y) * y) / square : 0.0;
    const double part = std::min(std::max(along, 0.0), 1.0);
    const Point at = {a.x + part * x, a.y + part * y};
    const double distance = std::hypot(point.x - at.x, point.y - at.y);
    if (distance < least) least = distance, nearest = at;
  }
  return least < INFINITY;
}

bool place(const Face& face, const Pose& pose, Placement& placement) {
  double turn[9];  // face's frame to the pad's: pose.rotation * face.rotation^T
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double sum = 0.0;
      for (int k = 0; k < 3; ++k) sum += pose.rotation[3 * i + k] * face.rotation[3 * j + k];
      turn[3 * i + j] = sum;
    }
  }
  if (!(turn[8] > 0.0) || std::hypot(turn[6], turn[7]) > face.most_slope * turn[8]) return false;
  const double c = turn[0] + turn[4], s = turn[3] - turn[1], size = std::hypot(c, s);
  placement.cosine = c / size;
  placement.sine = s / size;
  for (int i = 0; i < 2; ++i) placement.shift[i] = pose.position[i] + turn[3 * i + 2] * face.height;
  return true;
}

double plane_height(const Face& face, const Pose& pose, double x, double y) {
  double normal[3], point[3];
  for (int i = 0; i < 3; ++i) {
    normal[i] = 0.0;
    for (int k = 0; k < 3; ++k) normal[i] += pose.rotation[3 * i + k] * face.rotation[6 + k];
    point[i] = pose.position[i] + normal[i] * face.height;
  }
  return point[2] - (normal[0] * (x - point[0]) + normal[1] * (y - point[1])) / normal[2];
}

}  // namespace mjtactile
