#include "contact/cells/ridge_crossings.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {

// The search for one lowest point, between a sample that is lower than those beside it and these.
class CrossingSearch {
 public:
  CrossingSearch(const HeightWindow& view, const SampledLine& line) : view_(view), line_(line) {}

  // Places [steps] and heights of three samples, of which the middle one is the lowest. False if the lowest point is
  // above the view's limit.
  bool halve(std::array<double, 3> places, std::array<double, 3> heights, double tolerance) {
    keep(places[0], heights[0]);
    keep(places[2], heights[2]);
    for (int halving = 0; halving < RidgeCrossing::kHalvings; ++halving) {
      if (std::max(heights[0], heights[2]) - heights[1] < tolerance) break;
      const double left = (places[0] + places[1]) / 2, right = (places[1] + places[2]) / 2;
      const double before = height(left), after = height(right);
      // Both sides are treated alike, so that the mirrored body has the mirrored crossing.
      if (std::min(before, after) >= heights[1]) {
        keep(left, before), keep(right, after);
        places = {left, places[1], right}, heights = {before, heights[1], after};
      } else if (before <= after) {
        keep(places[1], heights[1]), keep(right, after);
        places = {places[0], left, places[1]}, heights = {heights[0], before, heights[1]};
      } else {
        keep(left, before), keep(places[1], heights[1]);
        places = {places[1], right, places[2]}, heights = {heights[1], after, heights[2]};
      }
    }
    if (heights[1] > 0.0) return false;
    crossing.place = places[1], crossing.height = heights[1];
    crossing.at = at(places[1]);
    for (std::size_t k = 0; k < crossing.count_; ++k) {
      RidgeCrossing::Sample& one = crossing.samples_[k];
      one.away -= places[1], one.higher -= heights[1];
    }
    return true;
  }

  RidgeCrossing crossing;

 private:
  Point at(double place) const { return {line_.start.x + place * line_.step.x, line_.start.y + place * line_.step.y}; }
  double height(double place) const { return view_.height(at(place)) - view_.highest; }
  void keep(double place, double height) { crossing.samples_[crossing.count_++] = {place, height}; }

  const HeightWindow& view_;
  const SampledLine& line_;
};

void add_crossings(const HeightWindow& view, const SampledLine& line, double tolerance,
                   std::vector<RidgeCrossing>& to) {
  const auto search = [&](const std::array<double, 3>& places, const std::array<double, 3>& heights) {
    CrossingSearch found(view, line);
    if (found.halve(places, heights, tolerance)) to.push_back(found.crossing);
  };
  const double last_place = static_cast<double>(line.count) - 1.0;
  const double last_height = line.heights[(line.count - 1) * line.stride];
  if (line.cut_off && std::isfinite(line.before) && line.before <= std::min(line.heights[0], 0.0)) {
    search({-1.0, -0.5, 0.0}, {kNowhere, line.before, line.heights[0]});
  }
  if (line.cut_off && std::isfinite(line.after) && line.after <= std::min(last_height, 0.0)) {
    search({last_place, last_place + 0.5, last_place + 1.0}, {last_height, line.after, kNowhere});
  }
  for (std::size_t k = 0; k < line.count; ++k) {
    const bool first = k == 0, last = k + 1 == line.count;
    const double* const own = line.heights + k * line.stride;
    const double before = first ? line.before : *(own - line.stride), after = last ? line.after : own[line.stride];
    // Of two equal samples, the first one counts.
    if (!(*own < before && *own <= after)) continue;
    // A convex curve is above the continuations of its chords.
    const double rise = std::max((first ? 2.0 : 1.0) * (before - *own), (last ? 2.0 : 1.0) * (after - *own));
    if (*own - rise > 0.0) continue;
    const auto place = static_cast<double>(k);
    search({place - (first ? 0.5 : 1.0), place, place + (last ? 0.5 : 1.0)}, {before, *own, after});
  }
}

// Between two samples, the root of the height is taken to be linear. That is exact for a round ridge, and close for a
// sharp one.
double RidgeCrossing::reach(double level, double sign) const {
  Sample within = {0.0, 0.0}, beyond = {kNowhere, kNowhere};
  for (std::size_t k = 0; k < count_; ++k) {
    const double away = sign * samples_[k].away;
    if (away > within.away && samples_[k].higher <= level) within = {away, samples_[k].higher};
  }
  for (std::size_t k = 0; k < count_; ++k) {
    const double away = sign * samples_[k].away;
    if (away > within.away && away < beyond.away) beyond = {away, samples_[k].higher};
  }
  if (!std::isfinite(beyond.away)) return within.away;
  if (!std::isfinite(beyond.higher)) return (within.away + beyond.away) / 2;
  const double from = std::sqrt(std::max(within.higher, 0.0)), to = std::sqrt(beyond.higher);
  return within.away + (beyond.away - within.away) * (std::sqrt(level) - from) / (to - from);
}

}  // namespace mjtactile
