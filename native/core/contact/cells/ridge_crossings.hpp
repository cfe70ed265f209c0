// Where straight lines cross ridges of a body's lower surface: curves along which it stands lowest, such as the bottom
// of a ring.
//
// A ridge may be much narrower than the steps at which a body is sampled. But a line through the samples has a lowest
// point where it crosses a ridge. Halving the steps around the lowest samples finds it.
#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include "geometry/height_map.hpp"

namespace mjtactile {

// A body's heights at equal steps along a line, above the limit of a view [m].
struct SampledLine {
  Point start, step;          // the first sample, and the way from one to the next [m]
  std::size_t count;
  const double* heights;      // the first height
  std::size_t stride;         // from one height to the next
  std::size_t number, lines;  // of the line among its parallels, and of these;
  std::size_t stride_across;  // from a height to that of the next parallel
  double spacing;             // and their distance [m]
  double before, after;       // heights half a step beyond the ends; kUnknown if the outermost samples are no crossings
  bool cut_off;               // whether the sheet ends there, so that the body may press with its flank

  static constexpr double kUnknown = -kNowhere;

  // Number of samples up to a height in a row across the line, through its sample k.
  std::size_t level_across(std::size_t k, double level) const;
};

class RidgeCrossing {
 public:
  Point at = {0.0, 0.0};
  double place = 0.0;     // along the line, in steps from its first sample
  double height = 0.0;    // above the view's limit [m]

  // Distance along the line from the crossing to where the body is higher by `level` [m], in steps: toward the line's
  // end if `sign` is 1, toward its start if it is -1.
  double reach(double level, double sign) const;
  // Place on the line up to which the body is higher by at most `level`: as far as `reach`, or farther where the next
  // samples of the line are not higher either.
  double end(const SampledLine& line, double level, double sign) const;
  // Whether the body rises by more than that before the next samples on both sides.
  bool is_narrow(double level) const { return samples_[0].higher > level && samples_[1].higher > level; }

 private:
  friend class CrossingSearch;
  static constexpr int kHalvings = 9, kEndHalvings = 4;
  struct Sample {
    double away = 0.0, higher = 0.0;   // from the crossing, in steps; above it [m]
  };
  // The last sample toward one side that is higher by at most `level` [m], and the next one; the latter is infinitely
  // far away if there is none. Distances are positive.
  std::pair<Sample, Sample> around_end(double level, double sign) const;
  static double place_between(const Sample& within, const Sample& beyond, double level);
  // The first two are the samples on both sides.
  std::array<Sample, 2 * kHalvings + 2 * kEndHalvings + 2> samples_;
  std::size_t count_ = 0;
};

// Where samples of a line tell that it may cross a ridge: between the outer two of three places on it [steps]. Heights
// are above the view's limit [m].
struct CrossingCandidate {
  std::array<double, 3> places, heights;
  double least;   // the body, if convex, is nowhere lower between them
};

// Add the candidates below a view's limit. Heights that differ by at most `tolerance` [m] are equal.
void add_candidates(const HeightWindow& view, const SampledLine& line, double tolerance,
                    std::vector<CrossingCandidate>& to);
// Add the crossing near a candidate, if it is below the view's limit. Its height is found up to `tolerance` [m].
void add_crossing(const HeightWindow& view, const SampledLine& line, const CrossingCandidate& candidate,
                  double tolerance, std::vector<RidgeCrossing>& to);
// Add the crossings of all candidates of a line, which are set.
void add_crossings(const HeightWindow& view, const SampledLine& line, double tolerance,
                   std::vector<CrossingCandidate>& candidates, std::vector<RidgeCrossing>& to);

}  // namespace mjtactile
