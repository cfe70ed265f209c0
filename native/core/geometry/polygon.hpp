// Convex polygons in the plane, their corners counter-clockwise.
#pragma once

#include <vector>

namespace mjtactile {

struct Point {
  double x, y;
};

// How far a point lies to the left of the line through two others, times their distance.
inline double left_of(const Point& a, const Point& b, const Point& point) {
  return (b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x);
}

// The point of the segment from a to b that is nearest to another.
Point nearest_on(const Point& a, const Point& b, const Point& point);

// The convex hull of points, counter-clockwise, collinear ones left out.
std::vector<Point> convex_hull(std::vector<Point> points);

// The point of a counter-clockwise convex polygon nearest to another, at least `margin` [m] from its sides: that one
// itself where it is. False where the polygon is too narrow for the margin.
bool nearest_inside(const std::vector<Point>& polygon, const Point& point, double margin, Point& nearest);

// Whether a point lies in a counter-clockwise convex polygon, its sides included, or at least `margin` [m] from them.
bool holds(const std::vector<Point>& outline, const Point& point, double margin = 0.0);

}  // namespace mjtactile
