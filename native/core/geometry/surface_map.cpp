#include "geometry/surface_map.hpp"

#include <cmath>

namespace mjtactile {
namespace {

// Distances from the surface below this are zero, because faces with the pad's own curvature lie on it up to rounding
// [m].
constexpr double kOnSurface = 1e-10;
// Largest number of steps of the secant method from the surface to the body, and length of the last step over the
// body's width.
constexpr int kSteps = 6;
constexpr double kSame = 1e-9;

}  // namespace

void SurfaceMap::place(const HeightMap& body, const TangentPlane& plane, double floor, double ceiling) {
  body_ = &body;
  plane_ = &plane;
  floor_ = floor;
  ceiling_ = ceiling;
  bounds_ = common(body.bounds(), plane.whole().bounds);
  candidates_ = body.candidates();
  if (bounds_.holds(0.0, 0.0)) candidates_.push_back({0.0, 0.0});   // the force passes through the plane's origin
}

double SurfaceMap::over_surface(double height, double surface) const {
  double over = height - surface;
  if (std::abs(over) <= kOnSurface) over = 0.0;
  return std::isfinite(over) && over >= floor_ && over <= ceiling_ ? over : kNowhere;
}

double SurfaceMap::height(double u, double v) const {
  SeenSurface seen;
  return plane_->look(u, v, seen) ? over_surface(body_->height(u, v), seen.height) : kNowhere;
}

void SurfaceMap::heights(const std::vector<Point>& points, std::vector<double>& to) const {
  body_->heights(points, to);
  plane_->heights(points, surface_);
  for (std::size_t i = 0; i < points.size(); ++i) to[i] = over_surface(to[i], surface_[i]);
}

void TurnedMap::place(const HeightMap& upright, const TangentPlane& plane) {
  upright_ = &upright;
  plane_ = &plane;
  bounds_ = plane.piece(upright.bounds()).bounds;
}

double TurnedMap::height(double u, double v) const {
  one_.assign(1, {u, v});
  std::vector<double> found;
  heights(one_, found);
  return found[0];
}

// Look up the body's heights at the trial points of all lines.
void TurnedMap::look(const std::vector<Point>& points) const {
  const double *origin = plane_->origin(), *axes = plane_->axes();
  asked_.clear();
  for (const Line& line : lines_) {
    const Point& at = points[line.place];
    asked_.push_back({origin[0] + at.x * axes[0] + at.y * axes[3] + line.w * axes[6],
                      origin[1] + at.x * axes[1] + at.y * axes[4] + line.w * axes[7]});
  }
  upright_->heights(asked_, found_);
}

// Find the point on the line over (u, v) where it is as high as the body, by the secant method. The first step assumes
// that the body is parallel to the surface.
void TurnedMap::heights(const std::vector<Point>& points, std::vector<double>& to) const {
  const double *origin = plane_->origin(), *axes = plane_->axes();
  to.assign(points.size(), kNowhere);
  lines_.clear();
  for (std::size_t i = 0; i < points.size(); ++i) {
    SeenSurface seen;
    if (!plane_->look(points[i].x, points[i].y, seen)) continue;
    const SurfacePoint under = plane_->surface().at(seen.x, seen.y);
    const double rises = axes[8] - under.slopes[0] * axes[6] - under.slopes[1] * axes[7];
    lines_.push_back({i, seen.height, seen.height, 0.0, rises});
  }
  const double near = kSame * (bounds_.east - bounds_.west);
  for (int step = 0; step < kSteps && !lines_.empty(); ++step) {
    look(points);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      Line line = lines_[i];
      const Point& at = points[line.place];
      const double missed = found_[i] - (origin[2] + at.x * axes[2] + at.y * axes[5] + line.w * axes[8]);
      if (!std::isfinite(missed)) continue;
      const double slope = step == 0 ? line.rises : (line.missed - missed) / (line.w - line.last);
      line.last = line.w;
      line.missed = missed;
      if (missed != 0.0 && std::isfinite(slope) && slope != 0.0) line.w += missed / slope;
      if (std::abs(line.w - line.last) <= near) {
        to[line.place] = line.w;
        continue;
      }
      lines_[kept++] = line;
    }
    lines_.resize(kept);
  }
  for (const Line& line : lines_) to[line.place] = line.w;
}

}  // namespace mjtactile
