#include "geometry/surface_map.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Distances from the surface below this are zero, because faces with the pad's own curvature lie on it up to rounding
// [m].
constexpr double kOnSurface = 1e-10;
// Steps from the surface to the body: of the secant method, which may leap to and fro at a body's edges; of it without
// two trials between which the body's lower side lies; and in all, halving. Length of the last step over the body's
// width.
constexpr int kSecants = 6, kSearches = 16, kSteps = 48;
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
  bounds_ = plane.piece(common(upright.bounds(), plane.surface().sheet())).bounds;
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

TurnedMap::Line::Outcome TurnedMap::Line::step(double misses, int number, double near) {
  if (misses == 0.0) return Outcome::found;
  // A line that was never above the lower side passes beside the body. One that was leaves it through its side.
  if (!std::isfinite(misses) && !(above < kNowhere)) return Outcome::none;
  if (misses > 0.0) {
    below = std::max(below, w);
  } else {
    above = std::min(above, w);
  }
  const double slope = number == 0 ? rises : (missed - misses) / (w - last);
  double next = w + misses / slope;
  const bool between = below > -kNowhere && above < kNowhere;
  if (between && (number >= kSecants || !(next > below && next < above))) next = (below + above) / 2.0;
  if (!std::isfinite(next) || (!between && number >= kSearches)) return Outcome::none;
  last = w, missed = misses, w = next;
  return std::abs(w - last) <= near ? Outcome::found : Outcome::goes_on;
}

// Find the point on the line over (u, v) where it is as high as the body, by the secant method. The first step assumes
// that the body is parallel to the surface. At a body's edges, where its height rises steeply, the interval that holds
// the point is halved.
void TurnedMap::heights(const std::vector<Point>& points, std::vector<double>& to) const {
  const double *origin = plane_->origin(), *axes = plane_->axes();
  to.assign(points.size(), kNowhere);
  lines_.clear();
  for (std::size_t i = 0; i < points.size(); ++i) {
    SeenSurface seen;
    if (!plane_->look(points[i].x, points[i].y, seen)) continue;
    const SurfacePoint under = plane_->surface().at(seen.x, seen.y);
    const double rises = axes[8] - under.slopes[0] * axes[6] - under.slopes[1] * axes[7];
    lines_.push_back({i, rises, seen.height, seen.height, 0.0});
  }
  const double near = kSame * (bounds_.east - bounds_.west);
  for (int number = 0; number < kSteps && !lines_.empty(); ++number) {
    look(points);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      Line line = lines_[i];
      const Point& at = points[line.place];
      const double here = origin[2] + at.x * axes[2] + at.y * axes[5] + line.w * axes[8];
      const Line::Outcome outcome = line.step(found_[i] - here, number, near);
      if (outcome == Line::Outcome::found) to[line.place] = line.w;
      if (outcome == Line::Outcome::goes_on) lines_[kept++] = line;
    }
    lines_.resize(kept);
  }
}

}  // namespace mjtactile
