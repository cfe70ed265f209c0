#include "contact/solvers/bearing.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {
namespace {

constexpr int kSupports = 32;        // largest number of directions tried
constexpr double kNothing = 1e-9;    // moments below this, over the force times the cells' length, count as zero, and
                                     // so do areas between three moments, over the square
constexpr double kClose = 1e-12;     // least decrease of the squared distance by a direction; else the search ends
constexpr double kSafe = 1.01;       // factor by which loads that can be borne must exceed the load

// Support of the set of loads that can be borne: the moments if the cells that lie farthest along a direction carry the
// force, each with its largest force.
Point farthest(const RigidProblem& problem, const double* most, const Point& along) {
  // Kept between calls so that a step allocates nothing.
  static thread_local std::vector<std::pair<double, std::size_t>> cells;
  const auto at = [&](std::size_t i) { return Point{problem.modes[3 * i + 1], problem.modes[3 * i + 2]}; };
  cells.clear();
  for (std::size_t i = 0; i < problem.cells(); ++i) cells.emplace_back(along.x * at(i).x + along.y * at(i).y, i);
  const auto farther = [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  };
  Point moments = {0.0, 0.0};
  double force = problem.resultants[0];
  const auto press = [&](std::size_t i) {
    const double share = std::min(most[i], force);
    moments.x += share * at(i).x, moments.y += share * at(i).y;
    force -= share;
  };
  // The cells beyond one of them either bear what is left of the force, or are full.
  auto first = cells.begin(), end = cells.end();
  while (force > 0.0 && end - first > 1) {
    std::iter_swap(first + (end - first) / 2, end - 1);
    const auto beyond = std::partition(first, end - 1, [&](const auto& cell) { return farther(cell, *(end - 1)); });
    std::iter_swap(beyond, end - 1);
    double borne = 0.0;
    for (auto cell = first; cell != beyond; ++cell) borne += most[cell->second];
    if (borne >= force) {
      end = beyond;
    } else {
      for (; first <= beyond; ++first) press(first->second);
    }
  }
  if (first != end) press(first->second);
  return moments;
}

// Moments if all cells bear the same share of their largest force.
Point even_moments(const RigidProblem& problem, const double* most) {
  const double force = problem.resultants[0], all = std::accumulate(most, most + problem.cells(), 0.0);
  Point even = {0.0, 0.0};
  for (std::size_t i = 0; i < problem.cells(); ++i) {
    const double share = force * most[i] / all;
    even.x += share * problem.modes[3 * i + 1], even.y += share * problem.modes[3 * i + 2];
  }
  return even;
}

Point minus(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y}; }
double product(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y; }

// Whether a point is in a triangle with more than a given area, doubled. In a flatter one, rounding would decide.
bool in_triangle(const Point& a, const Point& b, const Point& c, const Point& at, double twice_area) {
  if (std::abs(left_of(a, b, c)) <= twice_area) return false;
  const double first = left_of(a, b, at), second = left_of(b, c, at), third = left_of(c, a, at);
  return (first >= 0.0 && second >= 0.0 && third >= 0.0) || (first <= 0.0 && second <= 0.0 && third <= 0.0);
}

}  // namespace

bool bring_within_bearing(const RigidProblem& problem, const double* most, double* nearer) {
  std::copy(problem.resultants, problem.resultants + problem.motions, nearer);
  if (problem.motions < 3) return false;
  const double force = problem.resultants[0];
  const Point wanted = {problem.resultants[1], problem.resultants[2]}, even = even_moments(problem, most);
  // The loads that can be borne form a convex set. Its support in a direction is a sum over the cells farthest along
  // it. The nearest point of the set is found on segments between supports (Gilbert, Johnson, Keerthi, IEEE J. Robotics
  // Automation 4, 1988).
  const auto support = [&](const Point& along) {
    const Point found = farthest(problem, most, along);
    return Point{even.x + (found.x - even.x) / kSafe, even.y + (found.y - even.y) / kSafe};
  };
  Point near = even, first = even, second = even;
  for (int trial = 0; trial < kSupports; ++trial) {
    const Point away = minus(wanted, near);
    const double square = product(away, away);
    if (square <= kNothing * kNothing * force * force) return false;
    const Point next = support(away);
    if (product(away, minus(next, near)) <= kClose * square) break;
    if (in_triangle(first, second, next, wanted, kNothing * force * force)) return false;
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

bool lies_beyond_bearing(const RigidProblem& problem, const double* most) {
  if (problem.motions < 3) return false;
  const double force = problem.resultants[0];
  const Point even = even_moments(problem, most);
  const Point away = minus({problem.resultants[1], problem.resultants[2]}, even);
  const double wanted = product(away, away) * kSafe;
  // If all cells beyond the middle, pressed alike, can bear the force, the support reaches at least this far.
  double borne = 0.0, brought = 0.0;
  for (std::size_t i = 0; i < problem.cells(); ++i) {
    const Point at = {problem.modes[3 * i + 1] - even.x / force, problem.modes[3 * i + 2] - even.y / force};
    const double beyond = product(away, at);
    if (beyond > 0.0) borne += most[i], brought += most[i] * beyond;
  }
  if (borne >= force && brought * force >= wanted * borne) return false;
  return product(away, minus(farthest(problem, most, away), even)) < wanted;
}

}  // namespace mjtactile
