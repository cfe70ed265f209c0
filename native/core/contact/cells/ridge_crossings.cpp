#include "contact/cells/ridge_crossings.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Heights that differ by at most this are equal, over the tolerance. Rounding must not choose between them: the bottom
// of a mesh may be level across a ridge.
constexpr double kSame = 1e-6;
// A bottom that is level for less than this on a side counts as sharp there, in steps.
constexpr double kLevel = 0.2;
// A line lies along a ridge if it is as low for a way longer than this multiple of the ridge's width.
constexpr double kAlong = 2.003;
// A place this near to a sample is at it, in steps.
constexpr double kOnNode = 1e-9;

}  // namespace

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
      if (std::min(before, after) >= heights[1] - kSame * tolerance) {
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
    count_samples_from(places[1], heights[1]);
    const double aside = (level_until(tolerance, 1.0) - level_until(tolerance, -1.0)) / 2;
    crossing.place += aside;
    count_samples_from(aside, 0.0);
    crossing.at = at(crossing.place);
    return true;
  }

  RidgeCrossing crossing;

  double height(double place) const { return view_.height(at(place)) - view_.highest; }

 private:
  Point at(double place) const { return {line_.start.x + place * line_.step.x, line_.start.y + place * line_.step.y}; }
  void keep(double place, double height) { crossing.samples_[crossing.count_++] = {place, height}; }

  void count_samples_from(double place, double height) {
    for (std::size_t k = 0; k < crossing.count_; ++k) {
      crossing.samples_[k].away -= place, crossing.samples_[k].higher -= height;
    }
  }

  // How far the bottom is level on one side of the crossing, as that of a faceted ring is: where the body is higher by
  // at most `level` [m]. 0 if it is sharp.
  double level_until(double level, double sign) {
    auto [within, beyond] = crossing.around_end(level, sign);
    if (!(within.away > kLevel)) return 0.0;
    for (int halving = 0; std::isfinite(beyond.away) && halving < RidgeCrossing::kEndHalvings; ++halving) {
      const double away = (within.away + beyond.away) / 2;
      const double higher = height(crossing.place + sign * away) - crossing.height;
      keep(sign * away, higher);
      (higher <= level ? within : beyond).away = away;
    }
    return within.away;
  }

  const HeightWindow& view_;
  const SampledLine& line_;
};

std::size_t SampledLine::level_across(std::size_t k, double level) const {
  const auto is_low = [&](std::size_t parallel) {
    const auto away = static_cast<std::ptrdiff_t>(parallel) - static_cast<std::ptrdiff_t>(number);
    const double* const here = heights + k * stride;
    return here[away * static_cast<std::ptrdiff_t>(stride_across)] <= level;
  };
  std::size_t first = number, last = number;
  while (first > 0 && is_low(first - 1)) --first;
  while (last + 1 < lines && is_low(last + 1)) ++last;
  return last - first + 1;
}

void add_candidates(const HeightWindow& view, const SampledLine& line, double tolerance,
                    std::vector<CrossingCandidate>& to) {
  const auto height = [&](std::size_t k) { return line.heights[k * line.stride]; };
  const double step = std::hypot(line.step.x, line.step.y);
  const std::size_t end = line.count - 1;
  const auto beyond = static_cast<double>(end) + 0.5;
  if (line.cut_off && std::isfinite(line.before) && line.before <= std::min(height(0), 0.0)) {
    to.push_back({{-1.0, -0.5, 0.0}, {kNowhere, line.before, height(0)}, -kNowhere});
  }
  if (line.cut_off && std::isfinite(line.after) && line.after <= std::min(height(end), 0.0)) {
    to.push_back({{beyond - 0.5, beyond, beyond + 0.5}, {height(end), line.after, kNowhere}, -kNowhere});
  }
  for (std::size_t lowest = 0; lowest < line.count; ++lowest) {
    if (!std::isfinite(height(lowest))) continue;
    if (lowest > 0 && !(height(lowest - 1) > height(lowest))) continue;
    if (lowest < end && height(lowest + 1) < height(lowest)) continue;
    // Samples up to the tolerance above a lowest one belong to it, so that rounding does not decide. How far they are
    // from one another would not tell: the closer samples lie, the less they differ.
    const auto belongs = [&](std::size_t k) { return height(k) <= height(lowest) + tolerance; };
    std::size_t first = lowest, last = lowest;
    while (first > 0 && belongs(first - 1)) --first;
    while (last + 1 < line.count && belongs(last + 1)) ++last;
    if (height(first) < height(lowest) || height(last) < height(lowest)) continue;
    // Three or more lie along a ridge, which the line does not cross, unless the ridge is wide.
    if (last > first + 1) {
      const double level = height(lowest) + tolerance;
      const std::size_t middles[2] = {(first + last) / 2, (first + last + 1) / 2};
      const std::size_t beside = std::max(line.level_across(middles[0], level), line.level_across(middles[1], level));
      if (static_cast<double>(last - first + 1) * step > kAlong * static_cast<double>(beside) * line.spacing) continue;
    }
    const double before = first == 0 ? line.before : height(first - 1);
    const double after = last + 1 == line.count ? line.after : height(last + 1);
    const double least = std::min(height(first), height(last)), most = std::max(height(first), height(last));
    if (!(most < before && most < after)) continue;
    // A convex curve is above the continuations of its chords.
    const double from = first == 0 ? 0.5 : 1.0, until = last + 1 == line.count ? 0.5 : 1.0;
    const double bound = least - std::max((before - least) / from, (after - least) / until);
    if (bound > 0.0) continue;
    const auto start = static_cast<double>(first), stop = static_cast<double>(last);
    const double middle = (start + stop) / 2;
    const double between = last > first ? CrossingSearch(view, line).height(middle) : least;
    to.push_back({{start - from, middle, stop + until}, {before, between, after}, bound});
  }
}

void add_crossing(const HeightWindow& view, const SampledLine& line, const CrossingCandidate& candidate,
                  double tolerance, std::vector<RidgeCrossing>& to) {
  CrossingSearch search(view, line);
  if (search.halve(candidate.places, candidate.heights, tolerance)) to.push_back(search.crossing);
}

void add_crossings(const HeightWindow& view, const SampledLine& line, double tolerance,
                   std::vector<CrossingCandidate>& candidates, std::vector<RidgeCrossing>& to) {
  candidates.clear();
  add_candidates(view, line, tolerance, candidates);
  for (const CrossingCandidate& one : candidates) add_crossing(view, line, one, tolerance, to);
}

std::pair<RidgeCrossing::Sample, RidgeCrossing::Sample> RidgeCrossing::around_end(double level, double sign) const {
  Sample within = {0.0, 0.0}, beyond = {kNowhere, kNowhere};
  for (std::size_t k = 0; k < count_; ++k) {
    const double away = sign * samples_[k].away;
    if (away > within.away && samples_[k].higher <= level) within = {away, samples_[k].higher};
  }
  for (std::size_t k = 0; k < count_; ++k) {
    const double away = sign * samples_[k].away;
    if (away > within.away && away < beyond.away) beyond = {away, samples_[k].higher};
  }
  return {within, beyond};
}

double RidgeCrossing::reach(double level, double sign) const {
  const auto [within, beyond] = around_end(level, sign);
  return std::isfinite(beyond.away) ? place_between(within, beyond, level) : within.away;
}

double RidgeCrossing::end(const SampledLine& line, double level, double sign) const {
  const double reached = place + sign * reach(level, sign);
  double node = std::round(reached);
  const double last = sign > 0.0 ? static_cast<double>(line.count - 1) : 0.0;
  if (std::abs(reached - node) > kOnNode || sign * (last - node) <= 0.0) return reached;
  const auto sample = [&](double number) {
    const double over = line.heights[static_cast<std::size_t>(number) * line.stride];
    return Sample{sign * (number - place), over - height};
  };
  if (sample(node).higher > level) return reached;
  while (sign * (last - node) > 0.0 && sample(node + sign).higher <= level) node += sign;
  if (!(sign * (last - node) > 0.0)) return node;
  return place + sign * place_between(sample(node), sample(node + sign), level);
}

// Between two samples, the root of the height is taken to be linear. That is exact for a round ridge, and close for a
// sharp one.
double RidgeCrossing::place_between(const Sample& within, const Sample& beyond, double level) {
  if (!std::isfinite(beyond.higher)) return (within.away + beyond.away) / 2;
  const double from = std::sqrt(std::max(within.higher, 0.0)), to = std::sqrt(beyond.higher);
  return within.away + (beyond.away - within.away) * (std::sqrt(level) - from) / (to - from);
}

}  // namespace mjtactile
