#include "polygon.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// How far a point lies to the left of the line through two others, times their distance.
double left_of(const Point& a, const Point& b, const Point& point) {
  return (b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x);
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
      while (hull.size() >= base + 2 && left_of(hull[hull.size() - 2], hull.back(), point) <= 0.0) hull.pop_back();
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
    return left_of(a, b, at) - margin * std::hypot(b.x - a.x, b.y - a.y);
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

bool holds(const std::vector<Point>& outline, const Point& point, double margin) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Point &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double least = margin > 0.0 ? margin * std::hypot(b.x - a.x, b.y - a.y) : 0.0;
    if (!(left_of(a, b, point) >= least)) return false;
  }
  return true;
}

// Sutherland and Hodgman's way, one side after the other.
void clip(const std::vector<Point>& corners, const std::vector<Point>& outline, std::vector<Point>& result) {
  std::vector<Point> before;
  result = corners;
  for (std::size_t side = 0; side < outline.size() && !result.empty(); ++side) {
    const Point &from = outline[side], &to = outline[(side + 1) % outline.size()];
    before.swap(result);
    result.clear();
    for (std::size_t i = 0; i < before.size(); ++i) {
      const Point &a = before[i], &b = before[(i + 1) % before.size()];
      const double in_a = left_of(from, to, a), in_b = left_of(from, to, b);
      if (in_a >= 0.0) result.push_back(a);
      if ((in_a > 0.0 && in_b < 0.0) || (in_a < 0.0 && in_b > 0.0)) {
        const double part = in_a / (in_a - in_b);
        result.push_back({a.x + part * (b.x - a.x), a.y + part * (b.y - a.y)});
      }
    }
  }
}

}  // namespace mjtactile
