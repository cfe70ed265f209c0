#include "contact/solvers/bearing.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "geometry/polygon.hpp"

namespace mjtactile {
namespace {

constexpr int kSupports = 32;        // directions tried, at most
constexpr double kNothing = 1e-9;    // moment that counts as none, over the force times the cells' length
constexpr double kClose = 1e-12;     // the search ends where a direction brings no more of the distance's square
constexpr double kSafe = 1.01;       // how far beyond a load the loads that can be borne must reach, over the load

// Moments of the cells full that lie farthest along a direction, until they bear the force.
Point farthest(const double* most, const double* modes, double force, const Point& along,
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

// Moments of the force if all cells bear the same share of their most.
Point even_moments(const RigidProblem& problem, const double* most) {
  const double force = problem.resultants[0], all = std::accumulate(most, most + problem.cells(), 0.0);
  Point even = {0.0, 0.0};
  for (std::size_t i = 0; i < problem.cells(); ++i) {
    const double share = force * most[i] / all;
    even.x += share * problem.modes[3 * i + 1], even.y += share * problem.modes[3 * i + 2];
  }
  return even;
}

void reset(const RigidProblem& problem, std::vector<std::size_t>& order) {
  order.resize(problem.cells());
  std::iota(order.begin(), order.end(), std::size_t{0});
}

Point minus(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y}; }
double product(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y; }

bool in_triangle(const Point& a, const Point& b, const Point& c, const Point& at) {
  const double first = left_of(a, b, at), second = left_of(b, c, at), third = left_of(c, a, at);
  return (first >= 0.0 && second >= 0.0 && third >= 0.0) || (first <= 0.0 && second <= 0.0 && third <= 0.0);
}

}  // namespace

bool bring_within_bearing(const RigidProblem& problem, const double* most, std::vector<std::size_t>& order,
                          double* nearer) {
  std::copy(problem.resultants, problem.resultants + problem.motions, nearer);
  if (problem.motions < 3) return false;
  const double force = problem.resultants[0];
  const Point wanted = {problem.resultants[1], problem.resultants[2]}, even = even_moments(problem, most);
  reset(problem, order);
  // Loads that can be borne form a convex set, whose support in a direction is a sum over the farthest cells. Its nearest
  // point is found on segments between such points (Gilbert, Johnson, Keerthi, IEEE J. Robotics Automation 4, 1988).
  const auto support = [&](const Point& along) {
    const Point found = farthest(most, problem.modes, force, along, order);
    return Point{even.x + (found.x - even.x) / kSafe, even.y + (found.y - even.y) / kSafe};
  };
  Point near = even, first = even, second = even;
  for (int trial = 0; trial < kSupports; ++trial) {
    const Point away = minus(wanted, near);
    const double square = product(away, away);
    if (square <= kNothing * kNothing * force * force) return false;
    const Point next = support(away);
    if (product(away, minus(next, near)) <= kClose * square) break;
    if (in_triangle(first, second, next, wanted)) return false;
    const Point over_first = nearest_on(first, next, wanted), over_second = nearest_on(second, next, wanted);
    const Point to_first = minus(wanted, over_first), to_second = minus(wanted, over_second);
    const bool keeps_first = product(to_first, to_first) <= product(to_second, to_second);
    near = keeps_first ? over_first : over_second;
    (keeps_first ? second : first) = next;
  }
  nearer[1] = near.x;
  nearer[2] = near.y;
  return true;
}

bool lies_beyond_bearing(const RigidProblem& problem, const double* most, std::vector<std::size_t>& order) {
  if (problem.motions < 3) return false;
  const double force = problem.resultants[0];
  const Point even = even_moments(problem, most);
  const Point away = minus({problem.resultants[1], problem.resultants[2]}, even);
  const double wanted = product(away, away) * kSafe;
  // Cells beyond the middle, pressed alike, bring the force at least this far if they bear all of it.
  double borne = 0.0, brought = 0.0;
  for (std::size_t i = 0; i < problem.cells(); ++i) {
    const Point at = {problem.modes[3 * i + 1] - even.x / force, problem.modes[3 * i + 2] - even.y / force};
    const double far = product(away, at);
    if (far > 0.0) borne += most[i], brought += most[i] * far;
  }
  if (borne >= force && brought * force >= wanted * borne) return false;
  reset(problem, order);
  return product(away, minus(farthest(most, problem.modes, force, away, order), even)) < wanted;
}

}  // namespace mjtactile
