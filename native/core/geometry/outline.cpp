#include "geometry/outline.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace mjtactile {
namespace {

// Distance from a side of the sheet up to which a point lies on it, over the sheet's size.
constexpr double kOnRim = 1e-9;

// Areas below this fraction of the rectangle's are rounding.
constexpr double kNoArea = 1e-14;

// One side of the rectangle. Points are kept if sign * (coordinate - at) > 0.
struct Side {
  int axis;      // coordinate that is constant along the side: 0 for x, 1 for y
  double at;     // its value [m]
  double sign;   // 1 if larger coordinates are kept, -1 if smaller ones
};

// A point where a ring crosses a side: its position along the side, and the number of the chain that begins or ends
// there.
struct Crossing {
  double along;
  std::size_t number;
};

// The parts of rings that a cut keeps: chains of points from where a ring enters the kept side to where it leaves it.
struct Workspace {
  std::vector<std::vector<Point>> chains;
  std::size_t used = 0;
  std::vector<Crossing> entries, exits;
  std::vector<std::size_t> next;
  std::vector<std::uint8_t> done;
  Outline before;

  std::vector<Point>& chain() {
    if (used == chains.size()) chains.emplace_back();
    chains[used].clear();
    return chains[used++];
  }
};

double coordinate(const Point& point, int axis) { return axis == 0 ? point.x : point.y; }

bool keeps(const Side& side, const Point& point) { return side.sign * (coordinate(point, side.axis) - side.at) > 0.0; }

Point crossing(const Side& side, const Point& a, const Point& b) {
  const double from = coordinate(a, side.axis), part = (side.at - from) / (coordinate(b, side.axis) - from);
  if (side.axis == 0) return {side.at, a.y + part * (b.y - a.y)};
  return {a.x + part * (b.x - a.x), side.at};
}

// Coordinate along the side, directed so that the kept half plane is on its left [m].
double along(const Side& side, const Point& point) {
  return side.axis == 0 ? -side.sign * point.y : side.sign * point.x;
}

// Add an empty ring to an outline, reusing the memory of earlier rings.
std::vector<Point>& next_ring(Outline& outline, std::size_t& used) {
  if (used == outline.rings.size()) outline.rings.emplace_back();
  outline.rings[used].clear();
  return outline.rings[used++];
}

// Clip an outline at one side. Chains are joined along the side: each exit is connected to the next entry.
void cut(const Side& side, Outline& outline, Workspace& workspace) {
  std::swap(workspace.before, outline);
  workspace.used = 0;
  workspace.entries.clear();
  workspace.exits.clear();
  std::size_t used = 0;
  for (const std::vector<Point>& ring : workspace.before.rings) {
    const std::size_t count = ring.size();
    std::size_t first = 0;  // start of an edge by which the ring enters
    while (first < count && !(keeps(side, ring[(first + 1) % count]) && !keeps(side, ring[first]))) ++first;
    if (first == count) {
      if (count > 0 && keeps(side, ring[0])) next_ring(outline, used) = ring;
      continue;
    }
    std::vector<Point>* chain = nullptr;
    for (std::size_t k = 0; k < count; ++k) {
      const Point &a = ring[(first + k) % count], &b = ring[(first + k + 1) % count];
      const bool here = keeps(side, a), there = keeps(side, b);
      if (here != there) {
        const Point at = crossing(side, a, b);
        if (there) {
          workspace.entries.push_back({along(side, at), workspace.used});
          chain = &workspace.chain();
          chain->push_back(at);
        } else {
          workspace.exits.push_back({along(side, at), workspace.used - 1});
          chain->push_back(at);
        }
      }
      if (there) chain->push_back(b);
    }
  }
  const auto before = [](const Crossing& a, const Crossing& b) {
    return a.along < b.along || (a.along == b.along && a.number < b.number);
  };
  std::sort(workspace.entries.begin(), workspace.entries.end(), before);
  std::sort(workspace.exits.begin(), workspace.exits.end(), before);
  workspace.next.resize(workspace.used);
  workspace.done.assign(workspace.used, 0);
  for (std::size_t k = 0; k < workspace.exits.size(); ++k) {
    workspace.next[workspace.exits[k].number] = workspace.entries[k].number;
  }
  for (std::size_t k = 0; k < workspace.used; ++k) {
    if (workspace.done[k]) continue;
    std::vector<Point>& ring = next_ring(outline, used);
    for (std::size_t at = k; !workspace.done[at]; at = workspace.next[at]) {
      workspace.done[at] = 1;
      ring.insert(ring.end(), workspace.chains[at].begin(), workspace.chains[at].end());
    }
  }
  outline.rings.resize(used);
}

}  // namespace

double signed_area(const std::vector<Point>& ring) {
  double area = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Point &a = ring[i], &b = ring[i + 1 < ring.size() ? i + 1 : 0];
    area += ((a.x - ring[0].x) * (b.y - ring[0].y) - (b.x - ring[0].x) * (a.y - ring[0].y)) / 2;
  }
  return area;
}

double signed_area(const Outline& outline) {
  double area = 0.0;
  for (const std::vector<Point>& ring : outline.rings) area += signed_area(ring);
  return area;
}

Rectangle around(const Outline& outline) {
  Rectangle all = kNoRectangle;
  for (const std::vector<Point>& ring : outline.rings) all = around(all, around(ring));
  return all;
}

bool clip_outline(const Outline& outline, const Placement& placement, const Rectangle& sheet, Outline& result) {
  static thread_local Workspace workspace;
  result.rings.resize(outline.rings.size());
  for (std::size_t k = 0; k < outline.rings.size(); ++k) {
    result.rings[k].clear();
    for (const Point& corner : outline.rings[k]) {
      const Point at = placement(corner);
      if (!std::isfinite(at.x) || !std::isfinite(at.y)) return false;
      result.rings[k].push_back(at);
    }
  }
  const Rectangle bounds = around(result);
  if (bounds.west < sheet.west) cut({0, sheet.west, 1.0}, result, workspace);
  if (bounds.south < sheet.south) cut({1, sheet.south, 1.0}, result, workspace);
  if (bounds.east > sheet.east) cut({0, sheet.east, -1.0}, result, workspace);
  if (bounds.north > sheet.north) cut({1, sheet.north, -1.0}, result, workspace);
  return signed_area(result) > kNoArea * sheet.area();
}

double share_on_rim(const Outline& clipped, const Rectangle& sheet) {
  const double near = kOnRim * std::max(sheet.east - sheet.west, sheet.north - sheet.south);
  const auto both = [near](double a, double b, double side) {
    return std::abs(a - side) <= near && std::abs(b - side) <= near;
  };
  double all = 0.0, on_rim = 0.0;
  for (const std::vector<Point>& ring : clipped.rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Point &a = ring[i], &b = ring[(i + 1) % ring.size()];
      const double length = std::hypot(b.x - a.x, b.y - a.y);
      all += length;
      if (both(a.x, b.x, sheet.west) || both(a.x, b.x, sheet.east) || both(a.y, b.y, sheet.south) ||
          both(a.y, b.y, sheet.north)) {
        on_rim += length;
      }
    }
  }
  return all > 0.0 ? on_rim / all : 0.0;
}

}  // namespace mjtactile
