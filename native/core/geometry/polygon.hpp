// Points, rectangles and convex polygons in the plane. Corners of polygons run counter-clockwise.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace mjtactile {

struct Point {
  double x, y;
};

// The coordinate along an axis: 0 for x, 1 for y.
inline double& coordinate(Point& at, std::size_t axis) { return axis == 0 ? at.x : at.y; }
inline double coordinate(const Point& at, std::size_t axis) { return axis == 0 ? at.x : at.y; }

// A rectangle with sides along x and y [m].
struct Rectangle {
  double west, south, east, north;

  bool holds(double x, double y) const { return x >= west && x <= east && y >= south && y <= north; }
  // Whether they have a point in common.
  bool meets(const Rectangle& other) const {
    return west <= other.east && east >= other.west && south <= other.north && north >= other.south;
  }
  bool is_empty() const { return !(west <= east && south <= north); }
  double area() const { return (east - west) * (north - south); }
  Point middle() const { return {(west + east) / 2, (south + north) / 2}; }
  // Its point that is nearest to another one.
  Point nearest(const Point& at) const {
    return {std::min(std::max(at.x, west), east), std::min(std::max(at.y, south), north)};
  }
  // Larger on all sides by a share of its own size.
  Rectangle larger(double share) const {
    const double x = share * (east - west), y = share * (north - south);
    return {west - x, south - y, east + x, north + y};
  }
};

// Intersection of two rectangles.
inline Rectangle common(const Rectangle& a, const Rectangle& b) {
  return {std::max(a.west, b.west), std::max(a.south, b.south), std::min(a.east, b.east), std::min(a.north, b.north)};
}

// The least rectangle that contains two rectangles.
inline Rectangle around(const Rectangle& a, const Rectangle& b) {
  return {std::min(a.west, b.west), std::min(a.south, b.south), std::max(a.east, b.east), std::max(a.north, b.north)};
}

// The least rectangle that contains a rectangle and a point.
inline Rectangle around(const Rectangle& a, const Point& at) { return around(a, Rectangle{at.x, at.y, at.x, at.y}); }

// The empty rectangle, the neutral element of around().
constexpr Rectangle kNoRectangle = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                                    -std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};

// The least rectangle that contains all points.
Rectangle around(const std::vector<Point>& points);

struct Segment {
  Point start, end;
};

// A part of a segment: positions of its beginning and end, from 0 at the segment's start to 1 at its end.
struct SegmentPart {
  double low = 0.0, high = 1.0;

  bool is_empty() const { return !(low < high); }
  // Restrict the part to where a linear function is not negative, given its values at the segment's start and end.
  void keep_positive(double at_start, double at_end) {
    if (at_start < 0.0 && at_end < 0.0) high = low;
    if ((at_start < 0.0) == (at_end < 0.0)) return;
    const double crossing = at_start / (at_start - at_end);
    if (at_start < 0.0) {
      low = std::max(low, crossing);
    } else {
      high = std::min(high, crossing);
    }
  }
};

// Area of a polygon [m^2], and its integrals of x, y [m^3], x^2, x y and y^2 [m^4].
struct AreaIntegrals {
  double area = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, yy = 0.0;

  void add(const AreaIntegrals& part, double sign = 1.0) {
    area += sign * part.area;
    x += sign * part.x;
    y += sign * part.y;
    xx += sign * part.xx;
    xy += sign * part.xy;
    yy += sign * part.yy;
  }
};

// Integrals over the triangle of the origin and an edge; negative if the origin is on the edge's right. Summed over the
// edges of a polygon, they are the polygon's (Green's theorem). The origin should be close to the polygon, because
// cancellation is least there.
inline AreaIntegrals triangle_integrals(const Point& start, const Point& end) {
  const double ax = start.x, ay = start.y, bx = end.x, by = end.y, cross = ax * by - bx * ay;
  return {cross / 2,
          (ax + bx) * cross / 6,
          (ay + by) * cross / 6,
          (ax * ax + ax * bx + bx * bx) * cross / 12,
          (2 * ax * ay + ax * by + bx * ay + 2 * bx * by) * cross / 24,
          (ay * ay + ay * by + by * by) * cross / 12};
}

// The point of a segment from a to b at a share of the way, from 0 at a to 1 at b.
inline Point between(const Point& a, const Point& b, double share) {
  return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
}

// Distance of a point to the left of the line from a to b, times the distance from a to b.
inline double left_of(const Point& a, const Point& b, const Point& point) {
  return (b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x);
}

// What an edge from a to b adds to the number of times that a ring runs counter-clockwise around a point. `left`: that
// point's left_of() the edge.
inline int winding_of(const Point& a, const Point& b, const Point& point, double left) {
  if ((a.y <= point.y) == (b.y <= point.y)) return 0;
  if (a.y <= point.y) return left > 0.0 ? 1 : 0;
  return left < 0.0 ? -1 : 0;
}

// Distance between two points [m].
inline double distance(const Point& a, const Point& b) {
  const double x = b.x - a.x, y = b.y - a.y;
  return std::sqrt(x * x + y * y);
}

// The point of the segment from a to b that is nearest to a given point.
Point nearest_on(const Point& a, const Point& b, const Point& point);

// The convex hull of points, counter-clockwise, without corners on a straight side.
std::vector<Point> convex_hull(std::vector<Point> points);

// The nearest point to a given one that lies in a counter-clockwise convex polygon, at least `margin` [m] from its
// sides. False if the polygon is too narrow for the margin.
bool nearest_inside(const std::vector<Point>& polygon, const Point& point, double margin, Point& nearest);
// The nearest point to a given one on the line between the two corners that are farthest apart, at least `margin` [m]
// from both. `corners`: at least one, of a polygon that is hardly more than that line.
Point nearest_along(const std::vector<Point>& corners, const Point& point, double margin);

// Whether a point lies in a counter-clockwise convex polygon, at least `margin` [m] from its sides. Points on a side
// count as inside if the margin is 0, and those beside it by up to the margin if that is negative.
bool holds(const std::vector<Point>& outline, const Point& point, double margin = 0.0);

}  // namespace mjtactile
