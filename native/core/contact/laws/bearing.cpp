#include "contact/laws/bearing.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/polygon.hpp"

namespace mjtactile {
namespace {

constexpr int kSupports = 16;
// Of the moments: what counts as nothing.
constexpr double kNothing = 1e-9;
// Of how far the set reaches: where the search ends, and how much farther than a load it has to reach.
constexpr double kClose = 1e-3, kSafe = 1.01;

// Moments of the cells full that lie farthest along a direction, until they bear the force.
Point farthest(const std::vector<double>& most, const double* modes, double force, const Point& along,
               std::vector<std::size_t>& order) {
  const auto at = [&](std::size_t i) { return Point{modes[3 * i + 1], modes[3 * i + 2]}; };
  const auto far = [&](std::size_t i) { return along.x * at(i).x + along.y * at(i).y; };
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
    const double first = far(i), second = far(j);
    return first != second ? first > second : i < j;
  });
  Point moments = {0.0, 0.0};
  for (const std::size_t i : order) {
    const double share = std::min(most[i], force);
    moments.x += share * at(i).x, moments.y += share * at(i).y;
    force -= share;
    if (!(force > 0.0)) break;
  }
  return moments;
}

// How far along a ray from the even load's moments those reach that can be borne, over the ray's length, as far as it
// matters: loads that can be borne form a convex set, whose support in a direction is a sum over the farthest cells. The
// ray leaves the set between two of its points, which come nearer by turns.
double reach(const std::vector<double>& most, const double* modes, double force, const Point& even, const Point& ray,
             std::vector<std::size_t>& order) {
  const auto support = [&](const Point& along) {
    const Point found = farthest(most, modes, force, along, order);
    return Point{found.x - even.x, found.y - even.y};
  };
  const double length = std::hypot(ray.x, ray.y);
  Point left = support({-ray.y, ray.x}), right = support({ray.y, -ray.x});
  double share = 0.0;
  for (int trial = 0; trial < kSupports && share < kSafe; ++trial) {
    const Point side = {left.x - right.x, left.y - right.y}, outward = {-side.y, side.x};
    const double along = outward.x * ray.x + outward.y * ray.y;
    if (!(std::abs(along) > kNothing * length * std::hypot(side.x, side.y))) break;
    share = (outward.x * right.x + outward.y * right.y) / along;
    const double sign = along > 0.0 ? 1.0 : -1.0;
    const Point next = support({sign * outward.x, sign * outward.y});
    if ((outward.x * next.x + outward.y * next.y) / along - share <= kClose) break;
    (ray.x * next.y - ray.y * next.x > 0.0 ? left : right) = next;
  }
  return share;
}

}  // namespace

bool bring_within_bearing(const std::vector<double>& most, const double* modes, std::size_t motions,
                          const double* resultants, std::vector<std::size_t>& order, double* nearer) {
  std::copy(resultants, resultants + motions, nearer);
  if (motions < 3) return false;
  order.resize(most.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const double force = resultants[0], all = std::accumulate(most.begin(), most.end(), 0.0);
  Point even = {0.0, 0.0};
  for (std::size_t i = 0; i < most.size(); ++i) {
    const double share = force * most[i] / all;
    even.x += share * modes[3 * i + 1], even.y += share * modes[3 * i + 2];
  }
  const Point ray = {resultants[1] - even.x, resultants[2] - even.y};
  if (std::hypot(ray.x, ray.y) <= kNothing * force) return false;
  const double share = reach(most, modes, force, even, ray, order);
  if (share >= kSafe) return false;
  nearer[1] = even.x + share / kSafe * ray.x;
  nearer[2] = even.y + share / kSafe * ray.y;
  return true;
}

}  // namespace mjtactile
