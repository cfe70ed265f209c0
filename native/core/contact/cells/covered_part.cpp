#include "contact/cells/covered_part.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Parts of a cell smaller than this fraction of it do not count.
constexpr double kLeastShare = 1e-3;
// Nor do parts that are not wider than this (standard deviation over a cell's size).
constexpr double kLeastWidth = 1e-4;
// The covered part of a cell is found on lines at Gauss points, with so many steps along a line and bisections.
struct Rule {
  double lines[3], weights[3];
};
constexpr Rule kGauss = {{-0.38729833462074168852, 0.0, 0.38729833462074168852}, {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0}};
// Spans are known on the cell's sides and middle lines, at the points of Simpson's rule.
constexpr Rule kSimpson = {{-0.5, 0.0, 0.5}, {1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0}};
constexpr int kSteps = 4, kBisections = 6;
// Number of steps, from a region's sides inward, in which the end of the body is searched.
constexpr int kTrimSteps = 8;
// Positions of the lines along a region on which this search runs, over the region's breadth.
constexpr double kTrimLines[] = {0.0, -0.25, 0.25, -0.45, 0.45};

// Ends of the part of a line through a cell where interpolated heights are below 0, from -0.5 to 0.5 along the cell.
// `over`: heights at the cell's 3 x 3 nodes. False if there is no such part.
bool between_nodes(const double* over, bool along, double line, double& low, double& high) {
  // Heights on the line at the cell's sides and middle, interpolated between nodes.
  const int before = line < 0.0 ? 0 : 1;
  const double share = line < 0.0 ? 1.0 + 2.0 * line : 2.0 * line;
  double at[3];
  for (int k = 0; k < 3; ++k) {
    const double first = along ? over[3 * before + k] : over[3 * k + before];
    const double second = along ? over[3 * (before + 1) + k] : over[3 * k + before + 1];
    at[k] = first + share * (second - first);
  }
  low = 0.5, high = -0.5;
  for (int k = 0; k < 2; ++k) {
    const double start = 0.5 * k - 0.5;
    const double from = at[k], to = at[k + 1];
    if (from > 0.0 && to > 0.0) continue;
    low = std::min(low, from <= 0.0 ? start : start + 0.5 * from / (from - to));
    high = std::max(high, to <= 0.0 ? start + 0.5 : start + 0.5 * from / (from - to));
  }
  return low < high;
}

// The same as between_nodes(), by a search along the line, for cells that the body does not cover entirely.
bool search_ends(const CutCell& cut, bool along, double line, double& low, double& high) {
  const auto point = [&](double part) {
    const double u = along ? part : line, v = along ? line : part;
    return cut.lattice.at(cut.column + 0.5 + u, cut.row + 0.5 + v);
  };
  const Segment whole = {point(-0.5), point(0.5)};
  const double plane[2] = {cut.view.highest - cut.view.measured(whole.start, 0.0),
                           cut.view.highest - cut.view.measured(whole.end, 0.0)};
  SegmentPart found;
  if (cut.view.map->part_below(whole, plane, found)) {
    low = found.low - 0.5, high = found.high - 0.5;
    return !found.is_empty();
  }
  const auto above = [&](double part) { return cut.view.height(point(part)) - cut.view.highest; };
  double heights[kSteps + 1];
  int first = -1, last = -1;
  for (int step = 0; step <= kSteps; ++step) {
    heights[step] = above(static_cast<double>(step) / kSteps - 0.5);
    if (heights[step] > 0.0) continue;
    if (first < 0) first = step;
    last = step;
  }
  if (first < 0) return false;
  const auto end = [&](int inner, int outer) {
    double inside = static_cast<double>(inner) / kSteps - 0.5;
    if (outer < 0 || outer > kSteps) return inside;
    double outside = static_cast<double>(outer) / kSteps - 0.5;
    double below = heights[inner], beyond = heights[outer];
    for (int step = 0; step < kBisections && !std::isfinite(beyond); ++step) {
      const double middle = (inside + outside) / 2, there = above(middle);
      if (there > 0.0) {
        outside = middle, beyond = there;
      } else {
        inside = middle, below = there;
      }
    }
    return std::isfinite(beyond) ? inside + (outside - inside) * below / (below - beyond) : (inside + outside) / 2;
  };
  low = end(first, first - 1);
  high = end(last, last + 1);
  return true;
}

// Add the area and moments of the part, from lines in one direction. Returns the number of lines that meet it.
// `find_ends`: finds the part's ends on a line of the rule; false if it has none.
template <typename FindEnds>
int sweep(const Lattice& lattice, const Rule& rule, bool along, const FindEnds& find_ends, CoveredPart& sum) {
  int hits = 0;
  const double size = lattice.size, other_size = lattice.width();
  const double length = along ? size : other_size, width = along ? other_size : size;
  for (int line = 0; line < 3; ++line) {
    double low, high;
    if (!find_ends(along, line, low, high)) continue;
    ++hits;
    low *= length, high *= length;
    const double weight = (high - low) * width * rule.weights[line], middle = (low + high) / 2;
    const double square = (high * high + high * low + low * low) / 3, other = rule.lines[line] * width;
    sum.area += weight;
    sum.x += weight * (along ? middle : other);
    sum.y += weight * (along ? other : middle);
    sum.xx += weight * (along ? square : other * other);
    sum.yy += weight * (along ? other * other : square);
    sum.xy += weight * middle * other;
  }
  return hits;
}

// Lines run in both directions, so that the result does not depend on how the scene is turned.
template <typename FindEnds>
bool sweep_both_ways(const Lattice& lattice, const Rule& rule, const FindEnds& find_ends, CoveredPart& covered) {
  CoveredPart found[2] = {};
  const int along = sweep(lattice, rule, true, find_ends, found[0]);
  const int across = sweep(lattice, rule, false, find_ends, found[1]);
  // Lines along a narrow part hit or miss it as a whole. Lines across it are more accurate.
  covered = {};
  for (int k = 0; k < 2; ++k) {
    const int own = k == 0 ? along : across, other = k == 0 ? across : along;
    const double share = own == other ? 0.5 : own > other ? 1.0 : 0.0;
    covered.area += share * found[k].area;
    covered.x += share * found[k].x, covered.y += share * found[k].y;
    covered.xx += share * found[k].xx, covered.xy += share * found[k].xy, covered.yy += share * found[k].yy;
  }
  const double whole = covered.area, cell = lattice.size * lattice.width();
  if (!(whole > kLeastShare * cell)) return false;
  covered.x /= whole, covered.y /= whole;
  covered.xx = covered.xx / whole - covered.x * covered.x;
  covered.yy = covered.yy / whole - covered.y * covered.y;
  covered.xy = covered.xy / whole - covered.x * covered.y;
  // A part that only one line meets has no width except rounding.
  const double least = kLeastWidth * kLeastWidth * cell;
  return covered.xx > least && covered.yy > least;
}

}  // namespace

bool find_covered(const CutCell& cut, CoveredPart& covered) {
  const auto find_ends = [&](bool along, int line, double& low, double& high) {
    return cut.over != nullptr ? between_nodes(cut.over, along, kGauss.lines[line], low, high)
                               : search_ends(cut, along, kGauss.lines[line], low, high);
  };
  return sweep_both_ways(cut.lattice, kGauss, find_ends, covered);
}

bool find_covered(const Lattice& lattice, const CellSpans& spans, CoveredPart& covered) {
  const auto find_ends = [&](bool along, int line, double& low, double& high) {
    low = spans.low[along ? 0 : 1][line], high = spans.high[along ? 0 : 1][line];
    return low < high;
  };
  return sweep_both_ways(lattice, kSimpson, find_ends, covered);
}

bool clip(const Rectangle& sheet, const Lattice& lattice, const Point& middle, CoveredPart& part) {
  const double c = lattice.cosine, s = lattice.sine;
  // Middle and second moments along the sheet's axes.
  double at[2] = {middle.x + c * part.x - s * part.y, middle.y + s * part.x + c * part.y};
  double squares[2] = {c * c * part.xx - 2.0 * c * s * part.xy + s * s * part.yy,
                       s * s * part.xx + 2.0 * c * s * part.xy + c * c * part.yy};
  double product = c * s * (part.xx - part.yy) + (c * c - s * s) * part.xy;
  const double lowest[2] = {sheet.west, sheet.south}, highest[2] = {sheet.east, sheet.north};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const std::size_t beside = 1 - axis;
    const double half = std::sqrt(3.0 * squares[axis]);
    const double from = std::max(at[axis] - half, lowest[axis]), to = std::min(at[axis] + half, highest[axis]);
    if (!(from < to)) return false;
    const double kept = (to - from) / (2.0 * half), move = (from + to) / 2 - at[axis];
    // The part's middle moves along it, also if it is aslant.
    at[axis] += move, at[beside] += move * product / squares[axis];
    squares[beside] -= product * product / squares[axis] * (1.0 - kept * kept);
    squares[axis] *= kept * kept, product *= kept * kept;
    part.area *= kept;
  }
  const double x = at[0] - middle.x, y = at[1] - middle.y;
  part.x = c * x + s * y, part.y = c * y - s * x;
  part.xx = c * c * squares[0] + 2.0 * c * s * product + s * s * squares[1];
  part.yy = s * s * squares[0] - 2.0 * c * s * product + c * c * squares[1];
  part.xy = c * s * (squares[1] - squares[0]) + (c * c - s * s) * product;
  return true;
}

void trim(const HeightWindow& view, double least, double most, Region& region) {
  const double c = std::cos(region.angle), s = std::sin(region.angle);
  const Rectangle bounds = view.map->bounds();
  const double farthest = std::hypot(bounds.east - bounds.west, bounds.north - bounds.south);
  double ends[2][2];
  for (int axis = 0; axis < 2; ++axis) {
    const double half = (axis == 0 ? region.width : region.height) / 2;
    const double breadth = axis == 0 ? region.height : region.width;
    // There is no body farther away than its bounds are wide.
    const double first = std::min(most * half, std::max(farthest, half)), last = least * half;
    for (int side = 0; side < 2; ++side) {
      const double sign = side == 0 ? -1.0 : 1.0;
      const auto counts = [&](double away) {
        return std::any_of(std::begin(kTrimLines), std::end(kTrimLines), [&](double line) {
          const double along = sign * away, across = line * breadth;
          const double x = axis == 0 ? along : across, y = axis == 0 ? across : along;
          return view.height({region.centre.x + c * x - s * y, region.centre.y + s * x + c * y}) <= view.highest;
        });
      };
      double outside = first, inside = outside;
      bool found = counts(inside);
      for (int step = 1; step <= kTrimSteps && !found; ++step) {
        outside = inside;
        inside = first + (last - first) * static_cast<double>(step) / kTrimSteps;
        found = counts(inside);
      }
      if (!found) outside = inside = half;  // no end was found, so this side stays
      for (int step = 0; step < kBisections && outside > inside; ++step) {
        const double middle = (inside + outside) / 2;
        (counts(middle) ? inside : outside) = middle;
      }
      ends[axis][side] = sign * inside;
    }
  }
  const double x = (ends[0][0] + ends[0][1]) / 2, y = (ends[1][0] + ends[1][1]) / 2;
  region = {{region.centre.x + c * x - s * y, region.centre.y + s * x + c * y}, region.angle, ends[0][1] - ends[0][0],
            ends[1][1] - ends[1][0]};
}

}  // namespace mjtactile
