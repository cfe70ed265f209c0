#include "geometry/polygon.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// The part of a polygon that lies more than a margin to the left of a line (Sutherland and Hodgman).
void clip_side(const std::vector<Point>& polygon, const Point& a, const Point& b, double margin,
               std::vector<Point>& result) {
  const double least = margin * std::hypot(b.x - a.x, b.y - a.y);
  result.clear();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Point &from = polygon[k], &to = polygon[(k + 1) % polygon.size()];
    const double here = left_of(a, b, from) - least, there = left_of(a, b, to) - least;
    if (here >= 0.0) result.push_back(from);
    if ((here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0)) {
      result.push_back(between(from, to, here / (here - there)));
    }
  }
}

}  // namespace

Rectangle around(const std::vector<Point>& points) {
  constexpr std::size_t kBeside = 4;  // four independent bounds for speed
  double west[kBeside], south[kBeside], east[kBeside], north[kBeside];
  std::fill(west, west + kBeside, kNoRectangle.west), std::fill(south, south + kBeside, kNoRectangle.south);
  std::fill(east, east + kBeside, kNoRectangle.east), std::fill(north, north + kBeside, kNoRectangle.north);
  const auto widen = [&](std::size_t k, const Point& at) {
    west[k] = std::min(west[k], at.x), south[k] = std::min(south[k], at.y);
    east[k] = std::max(east[k], at.x), north[k] = std::max(north[k], at.y);
  };
  std::size_t i = 0;
  for (; i + kBeside <= points.size(); i += kBeside) {
    for (std::size_t k = 0; k < kBeside; ++k) widen(k, points[i + k]);
  }
  for (; i < points.size(); ++i) widen(0, points[i]);
  Rectangle all = kNoRectangle;
  for (std::size_t k = 0; k < kBeside; ++k) all = around(all, {west[k], south[k], east[k], north[k]});
  return all;
}

Point nearest_on(const Point& a, const Point& b, const Point& point) {
  const double x = b.x - a.x, y = b.y - a.y, square = x * x + y * y;
  const double along = square > 0.0 ? ((point.x - a.x) * x + (point.y - a.y) * y) / square : 0.0;
  const double part = std::min(std::max(along, 0.0), 1.0);
  return {a.x + part * x, a.y + part * y};
}

// Andrew's monotone chain.
std::vector<Point> convex_hull(std::vector<Point> points) {
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
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
  bool inside = true;
  for (std::size_t i = 0; i < polygon.size() && inside; ++i) {
    const Point &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    inside = left_of(a, b, point) > margin * std::hypot(b.x - a.x, b.y - a.y);
  }
  if (inside) return true;
  // Shrink the polygon by the margin.
  std::vector<Point> inner = polygon, before;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    before.swap(inner);
    clip_side(before, polygon[i], polygon[(i + 1) % polygon.size()], margin, inner);
  }
  double least = INFINITY;
  for (std::size_t k = 0; k < inner.size(); ++k) {
    const Point at = nearest_on(inner[k], inner[(k + 1) % inner.size()], point);
    const double distance = std::hypot(point.x - at.x, point.y - at.y);
    if (distance < least) least = distance, nearest = at;
  }
  return least < INFINITY;
}

Point nearest_along(const std::vector<Point>& corners, const Point& point, double margin) {
  Point from = corners.front(), to = from;
  double length = 0.0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = i + 1; j < corners.size(); ++j) {
      const double apart = std::hypot(corners[j].x - corners[i].x, corners[j].y - corners[i].y);
      if (apart > length) length = apart, from = corners[i], to = corners[j];
    }
  }
  if (!(length > 0.0)) return from;
  const double share = std::min(margin / length, 0.5), x = share * (to.x - from.x), y = share * (to.y - from.y);
  return nearest_on({from.x + x, from.y + y}, {to.x - x, to.y - y}, point);
}

bool holds(const std::vector<Point>& outline, const Point& point, double margin) {
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Point &a = outline[i], &b = outline[(i + 1) % outline.size()];
    const double least = margin != 0.0 ? margin * std::hypot(b.x - a.x, b.y - a.y) : 0.0;
    if (!(left_of(a, b, point) >= least)) return false;
  }
  return true;
}

}  // namespace mjtactile
