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

bool surely_inside(const std::vector<Point>& polygon, const Point& point, double margin) {
  if (polygon.size() < 3) return false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point& a = polygon[i];
    const Point& b = polygon[(i + 1) % polygon.size()];
    if (cross(a, b, point) <= margin * std::hypot(b.x - a.x, b.y - a.y)) return false;
  }
  return true;
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

}  // namespace mjtactile
