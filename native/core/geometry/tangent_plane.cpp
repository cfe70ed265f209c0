#include "geometry/tangent_plane.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

// Largest number of steps of Newton's iteration, and length of the last one over the sheet's size. The remaining error
// decreases with its square: some picometres on a sheet of 12 mm with radii of 3 mm.
constexpr int kSteps = 12;
constexpr double kConverged = 1e-5;
// The same for the point where a line enters the surface, from far away.
constexpr double kSame = 1e-13;
// Distance of the points from which curvatures are computed, over the sheet's size.
constexpr double kNearBy = 0.02;
// Least cosine between the surface's normal and the plane's; steeper parts are treated as not met.
constexpr double kSeen = 0.1;
// Bounds of a piece are found on a grid of so many points along each side, with a margin over the result.
constexpr int kLines = 9;
constexpr double kMargin = 0.02;

// Find the point where a line enters a surface. `along`: its unit direction; `nearest`: a point of it. Sets the point
// of the pad's plane below, and the surface there. False if the line does not run into the surface.
bool goes_in(const OuterSurface& surface, const double* along, const double* nearest, double size, Point& found,
             SurfacePoint& under) {
  const Rectangle& sheet = surface.sheet();
  const Point middle = sheet.middle();
  // Start outside, above the surface. If the surface is convex, Newton's iteration then approaches the entry point
  // without overshooting.
  double at = -(along[0] * (nearest[0] - middle.x) + along[1] * (nearest[1] - middle.y) + along[2] * nearest[2]) - size;
  for (int step = 0; step < 4 * kSteps; ++step) {
    found = {nearest[0] + at * along[0], nearest[1] + at * along[1]};
    under = surface.at(found.x, found.y);
    const double above = nearest[2] + at * along[2] - under.z;
    const double closing = along[2] - under.slopes[0] * along[0] - under.slopes[1] * along[1];
    if (!(closing < 0.0)) return false;
    const double move = -above / closing;
    at += std::min(std::max(move, -size), size);
    if (std::abs(move) <= kSame * size) break;
  }
  found = {nearest[0] + at * along[0], nearest[1] + at * along[1]};
  return true;
}

}  // namespace

// Solve a w^2 + 2 b w + c = 0 on the line over (u, v).
inline TangentPlane::Quadric::Meeting TangentPlane::Quadric::meet(double u, double v) const {
  const double a = forms[2], b = middle + forms[4] * u + forms[5] * v;
  const double c = forms[0] * u * u + forms[1] * v * v + 2.0 * forms[3] * u * v;
  const double square = b * b - a * c, root = std::sqrt(std::max(square, 0.0));
  const bool ahead = b > 0.0, upright = square > kSeen * kSeen * b * b;
  return {-c / (b + root), root, ahead && upright};
}

void TangentPlane::touch(const OuterSurface& surface, const Point& foot) {
  surface_ = &surface;
  const SurfacePoint at = surface.at(foot.x, foot.y);
  origin_[0] = foot.x, origin_[1] = foot.y, origin_[2] = at.z;
  double *along = axes_, *across = axes_ + 3, *normal = axes_ + 6;
  const double upright[3] = {-at.slopes[0], -at.slopes[1], 1.0}, size = std::sqrt(dot(upright, upright));
  for (int k = 0; k < 3; ++k) normal[k] = upright[k] / size;
  // The pad's axes, turned the shortest way. Cells lie along them, so that a contact that is turned or mirrored with
  // its pad keeps its cells.
  const double x = normal[0], y = normal[1], less = 1.0 / (1.0 + normal[2]), shared = -x * y * less;
  along[0] = 1.0 - x * x * less, along[1] = shared, along[2] = -x;
  across[0] = shared, across[1] = 1.0 - y * y * less, across[2] = -y;
  if (surface.is_quadric()) {
    const double* numbers = surface.numbers();
    const double weights[3] = {numbers[0], numbers[1], 1.0 / (numbers[2] * numbers[2])};
    const auto form = [&](const double* a, const double* b) {
      return weights[0] * a[0] * b[0] + weights[1] * a[1] * b[1] + weights[2] * a[2] * b[2];
    };
    const double from_middle[3] = {origin_[0], origin_[1], origin_[2] + numbers[2]};
    const double forms[6] = {form(along, along), form(across, across), form(normal, normal),
                             form(along, across), form(along, normal), form(across, normal)};
    std::copy(forms, forms + 6, quadric_.forms);
    quadric_.middle = form(normal, from_middle);
  }
  const Rectangle& sheet = surface.sheet();
  size_ = std::max(sheet.east - sheet.west, sheet.north - sheet.south);
  if (!surface.is_quadric()) find_bends();
  whole_ = piece(sheet);
  whole_.highest = std::max(whole_.highest, 0.0);   // height of the point where the plane touches
}

SeenPiece TangentPlane::piece(const Rectangle& above) const {
  Rectangle seen = kNoRectangle;
  double lowest = INFINITY, highest = -INFINITY;
  for (int row = 0; row < kLines; ++row) {
    for (int column = 0; column < kLines; ++column) {
      const double x = above.west + (above.east - above.west) * column / (kLines - 1);
      const double y = above.south + (above.north - above.south) * row / (kLines - 1);
      const double point[3] = {x, y, surface_->at(x, y).z};
      double here[3];
      into(point, here);
      seen = around(seen, Point{here[0], here[1]});
      lowest = std::min(lowest, here[2]), highest = std::max(highest, here[2]);
    }
  }
  const double more = kMargin * std::max(seen.east - seen.west, seen.north - seen.south);
  const double higher = kMargin * (highest - lowest);
  return {{seen.west - more, seen.south - more, seen.east + more, seen.north + more},
          lowest - higher, highest + higher};
}

bool TangentPlane::look(double u, double v, SeenSurface& seen) const {
  return meets(u, v, seen) && surface_->sheet().holds(seen.x, seen.y);
}

void TangentPlane::heights(const std::vector<Point>& points, std::vector<double>& to) const {
  to.resize(points.size());
  if (!surface_->is_quadric()) {
    SeenSurface seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
      to[i] = look(points[i].x, points[i].y, seen) ? seen.height : INFINITY;
    }
    return;
  }
  const Rectangle sheet = surface_->sheet();
  const Quadric quadric = quadric_;
  const Point origin = {origin_[0], origin_[1]};
  const double along[3] = {axes_[0], axes_[3], axes_[6]}, across[3] = {axes_[1], axes_[4], axes_[7]};
  // Without branches, so that the compiler vectorises the loop.
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double u = points[i].x, v = points[i].y;
    const Quadric::Meeting meets = quadric.meet(u, v);
    const double x = origin.x + u * along[0] + v * along[1] + meets.w * along[2];
    const double y = origin.y + u * across[0] + v * across[1] + meets.w * across[2];
    to[i] = meets.seen && sheet.holds(x, y) ? meets.w : INFINITY;
  }
}

SeenSurface TangentPlane::beyond(double u, double v) const {
  SeenSurface seen;
  if (meets(u, v, seen)) return seen;
  return {0.0, {0.0, 0.0}, origin_[0] + u * axes_[0] + v * axes_[3], origin_[1] + u * axes_[1] + v * axes_[4]};
}

bool TangentPlane::meets(double u, double v, SeenSurface& seen) const {
  return surface_->is_quadric() ? look_at_quadric(u, v, seen) : look_at_patch(u, v, seen);
}

bool TangentPlane::look_at_quadric(double u, double v, SeenSurface& seen) const {
  const Quadric::Meeting meets = quadric_.meet(u, v);
  if (!meets.seen) return false;
  const double w = meets.w, *forms = quadric_.forms;
  seen.height = w;
  seen.slopes[0] = -(forms[4] * w + forms[0] * u + forms[3] * v) / meets.root;
  seen.slopes[1] = -(forms[5] * w + forms[1] * v + forms[3] * u) / meets.root;
  seen.x = origin_[0] + u * axes_[0] + v * axes_[3] + w * axes_[6];
  seen.y = origin_[1] + u * axes_[1] + v * axes_[4] + w * axes_[7];
  return true;
}

// Newton's iteration along the line over (u, v). It starts from a circle with the surface's curvature in the direction
// of (u, v).
bool TangentPlane::look_at_patch(double u, double v, SeenSurface& seen) const {
  const double *along = axes_, *across = axes_ + 3, *normal = axes_ + 6;
  const double base[3] = {origin_[0] + u * along[0] + v * across[0], origin_[1] + u * along[1] + v * across[1],
                          origin_[2] + u * along[2] + v * across[2]};
  const double bent = (bends_[0] * u + bends_[1] * v) * u + bends_[2] * v * v, square = u * u + v * v;
  double w = square > 0.0 ? bent + bent * bent * bent / square : 0.0;
  for (int step = 0; step < kSteps; ++step) {
    const double x = base[0] + w * normal[0], y = base[1] + w * normal[1];
    const SurfacePoint at = surface_->at(x, y);
    const double rises = normal[2] - at.slopes[0] * normal[0] - at.slopes[1] * normal[1];
    const double move = (at.z - base[2] - w * normal[2]) / rises;
    if (!(rises > 0.0) || !(std::abs(move) < size_)) return false;
    w += move;
    if (std::abs(move) > kConverged * size_) continue;
    seen.height = w;
    seen.slopes[0] = (at.slopes[0] * along[0] + at.slopes[1] * along[1] - along[2]) / rises;
    seen.slopes[1] = (at.slopes[0] * across[0] + at.slopes[1] * across[1] - across[2]) / rises;
    seen.x = base[0] + w * normal[0], seen.y = base[1] + w * normal[1];
    return rises * rises > kSeen * kSeen * (1.0 + at.slopes[0] * at.slopes[0] + at.slopes[1] * at.slopes[1]);
  }
  return false;
}

// Set bends_: half the second derivatives of w at the plane's origin, from slopes at nearby points.
void TangentPlane::find_bends() {
  const double step = kNearBy * size_;
  std::fill(bends_, bends_ + 3, 0.0);
  double found[3] = {0.0, 0.0, 0.0};
  for (const double sign : {1.0, -1.0}) {
    SeenSurface beside, above;
    if (!meets(sign * step, 0.0, beside) || !meets(0.0, sign * step, above)) return;
    found[0] += sign * beside.slopes[0] / (4.0 * step);
    found[1] += sign * (beside.slopes[1] + above.slopes[0]) / (4.0 * step);
    found[2] += sign * above.slopes[1] / (4.0 * step);
  }
  std::copy(found, found + 3, bends_);
}

void TangentPlane::into(const double* point, double* here) const {
  const double away[3] = {point[0] - origin_[0], point[1] - origin_[1], point[2] - origin_[2]};
  turn_into(away, here);
}

void TangentPlane::out_of(const double* here, double* point) const {
  turn_out_of(here, point);
  for (int k = 0; k < 3; ++k) point[k] += origin_[k];
}

void TangentPlane::turn_into(const double* vector, double* here) const {
  rotate(axes_, vector, here);
}

void TangentPlane::turn_out_of(const double* here, double* vector) const {
  rotate_back(axes_, here, vector);
}

Pose TangentPlane::into(const Pose& pose) const {
  Pose here;
  into(pose.position, here.position);
  for (int j = 0; j < 3; ++j) {
    const double column[3] = {pose.rotation[j], pose.rotation[3 + j], pose.rotation[6 + j]};
    double turned[3];
    turn_into(column, turned);
    for (int i = 0; i < 3; ++i) here.rotation[3 * i + j] = turned[i];
  }
  return here;
}

void TangentPlane::wrench_into(const double* wrench, double* here) const {
  double moved[3], arm[3];
  cross(origin_, wrench, arm);
  for (int k = 0; k < 3; ++k) moved[k] = wrench[3 + k] - arm[k];
  turn_into(wrench, here);
  turn_into(moved, here + 3);
}

void TangentPlane::wrench_out_of(const double* here, double* wrench) const {
  double arm[3];
  turn_out_of(here, wrench);
  turn_out_of(here + 3, wrench + 3);
  cross(origin_, wrench, arm);
  for (int k = 0; k < 3; ++k) wrench[3 + k] += arm[k];
}

bool centre_of_pressure(const OuterSurface& surface, const double* wrench, Point& centre) {
  const Rectangle& sheet = surface.sheet();
  const double force = std::sqrt(dot(wrench, wrench));
  const double size = std::max(sheet.east - sheet.west, sheet.north - sheet.south);
  if (!(force > 0.0)) return false;
  double along[3], torsion[3] = {0.0, 0.0, 0.0};   // the line's direction, and the moment along the normal
  for (int k = 0; k < 3; ++k) along[k] = wrench[k] / force;
  Point found = {0.0, 0.0};
  for (int round = 0; round < kSteps; ++round) {
    double moment[3], nearest[3];   // the line's point nearest to the origin
    for (int k = 0; k < 3; ++k) moment[k] = (wrench[3 + k] - torsion[k]) / force;
    cross(along, moment, nearest);
    SurfacePoint at;
    if (!goes_in(surface, along, nearest, size, found, at)) return false;
    const double normal[3] = {-at.slopes[0], -at.slopes[1], 1.0};
    // Subtract the torsion, so that the remaining moment is perpendicular to the force.
    const double turn = dot(wrench + 3, along) / dot(normal, along);
    double changed = 0.0;
    for (int k = 0; k < 3; ++k) {
      changed = std::max(changed, std::abs(turn * normal[k] - torsion[k]));
      torsion[k] = turn * normal[k];
    }
    if (changed <= kSame * size * force) break;
  }
  centre = sheet.nearest(found);
  return true;
}

}  // namespace mjtactile
