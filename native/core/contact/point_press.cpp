#include "contact/point_press.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Area of a square over the least area that bears its force at the pad's strength.
constexpr double kSpotArea = 1.5;

}  // namespace

bool PointPress::lay(const std::vector<ContactPoint>& points, const Options& options) {
  merge_close_points(points, options.least_side / 2);
  face_.areas.clear();
  face_.centroids.clear();
  face_.edges.clear();
  forces_.clear();
  area_ = 0.0;
  for (const ContactPoint& point : merged_) add_square(point, options);
  bound_stress(face_, options.strength, forces_.data());
  return !forces_.empty();
}

// Add up contact points at one place. MuJoCo gives several where triangles of a flex meet.
void PointPress::merge_close_points(const std::vector<ContactPoint>& points, double apart) {
  merged_.clear();
  for (const ContactPoint& point : points) {
    if (!(point.wrench[2] < 0.0)) continue;
    const auto same = std::find_if(merged_.begin(), merged_.end(), [&](const ContactPoint& one) {
      return std::hypot(one.x - point.x, one.y - point.y) < apart;
    });
    if (same == merged_.end()) {
      merged_.push_back(point);
      continue;
    }
    for (int k = 0; k < 6; ++k) same->wrench[k] += point.wrench[k];
  }
}

void PointPress::add_square(const ContactPoint& point, const Options& options) {
  const double* wrench = point.wrench;
  const Rectangle& sheet = options.sheet;
  const double area = options.strength > 0.0 ? kSpotArea * -wrench[2] / options.strength : 0.0;
  const double half = std::min({std::max(options.least_side, std::sqrt(area)) / 2, (sheet.east - sheet.west) / 2,
                                (sheet.north - sheet.south) / 2});
  const Rectangle room = {sheet.west + half, sheet.south + half, sheet.east - half, sheet.north - half};
  const auto [x, y] = room.nearest(centre_of_pressure(wrench));
  const auto own = static_cast<std::int32_t>(face_.areas.size());
  const Point corners[4] = {{x - half, y - half}, {x + half, y - half}, {x + half, y + half}, {x - half, y + half}};
  for (int k = 0; k < 4; ++k) face_.edges.push_back({corners[k], corners[(k + 1) % 4], own, -1});
  face_.centroids.push_back({x, y});
  face_.areas.push_back(4 * half * half);
  area_ += face_.areas.back();
  forces_.insert(forces_.end(), wrench, wrench + 3);
}

double PointPress::peak() const {
  double peak = 0.0;
  for (std::size_t i = 0; i < face_.cells(); ++i) peak = std::max(peak, -forces_[3 * i + 2] / face_.areas[i]);
  return peak;
}

void PointPress::nodal_forces(const SurfaceGrid& grid, const TangentPlane* plane, double* carried, double* nodal) {
  if (plane != nullptr) {
    bent_.lay(face_, *plane);
    turn_to_squares();
    bent_.nodal_forces(face_, grid, {forces_.data()}, carried, work_, nodal);
    return;
  }
  std::fill(carried, carried + 6, 0.0);
  for (std::size_t i = 0; i < face_.cells(); ++i) {
    const double* force = forces_.data() + 3 * i;
    const Point& at = face_.centroids[i];
    for (int k = 0; k < 3; ++k) carried[k] += force[k];
    carried[3] += at.y * force[2];
    carried[4] -= at.x * force[2];
    carried[5] += at.x * force[1] - at.y * force[0];
  }
  mjtactile::nodal_forces(face_, kUnmoved, grid, {forces_.data()}, work_, nodal);
}

// Decompose forces along the plane's axes into pressing along the square's own normal and shear in the square.
void PointPress::turn_to_squares() {
  for (std::size_t i = 0; i < face_.cells(); ++i) {
    const double* slopes = bent_.slopes().data() + 2 * i;
    double* force = forces_.data() + 3 * i;
    const double along = slopes[0] * force[0] + slopes[1] * force[1];
    force[2] = std::min((force[2] - along) / (1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1]), 0.0);
    for (int k = 0; k < 2; ++k) force[k] += slopes[k] * force[2];
  }
}

}  // namespace mjtactile
