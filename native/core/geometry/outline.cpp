#include "geometry/outline.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/polygon.hpp"
#include "linalg/angles.hpp"

namespace mjtactile {
namespace {

// Distance from a side of the sheet up to which a point lies on it, over the sheet's size.
constexpr double kOnRim = 1e-9;

// Distance from an edge of the points that tell what lies beside it, over that of equal points.
constexpr double kBeside = 1e-3;

// Areas below this fraction of the rectangle's are rounding.
constexpr double kNoPart = 1e-14;
// Rounding errors of distances over the outline's extent, and of areas over its square.
constexpr double kSamePoint = 1e-12, kStraight = 1e-13, kNoArea = 1e-12;
// Distances that differ by less than this fraction count as equal.
constexpr double kTie = 1e-6;

// One side of the rectangle. Points are kept if sign * (coordinate - at) > 0.
struct Side {
  std::size_t axis;   // coordinate that is constant along the side: 0 for x, 1 for y
  double at;          // its value [m]
  double sign;        // 1 if larger coordinates are kept, -1 if smaller ones
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

Point turned(const Point& point, double cosine, double sine) {
  return {cosine * point.x - sine * point.y, sine * point.x + cosine * point.y};
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

// Numbers of points. Points that are near each other have the same number.
class Nodes {
 public:
  explicit Nodes(double same) : same_(same) {}
  std::size_t number(const Point& at) {
    for (std::size_t k = 0; k < points_.size(); ++k) {
      if (std::abs(points_[k].x - at.x) <= same_ && std::abs(points_[k].y - at.y) <= same_) return k;
    }
    points_.push_back(at);
    return points_.size() - 1;
  }
  const Point& operator[](std::size_t number) const { return points_[number]; }

 private:
  double same_;
  std::vector<Point> points_;
};

Rectangle around(const Segment& edge) { return around(around(kNoRectangle, edge.start), edge.end); }

std::vector<Segment> edges_of(const Outline& outline) {
  std::vector<Segment> edges;
  for (const std::vector<Point>& ring : outline.rings) {
    for (std::size_t i = 0; i < ring.size(); ++i) edges.push_back({ring[i], ring[(i + 1) % ring.size()]});
  }
  return edges;
}

// Add where two edges meet to the places at which each of them is cut, from 0 at its start to 1 at its end.
void add_meetings(const Segment& one, const Segment& other, double same, std::vector<double>& of_one,
                  std::vector<double>& of_other) {
  const auto add_end = [same](const Segment& edge, const Point& end, std::vector<double>& to) {
    const Point near = nearest_on(edge.start, edge.end, end);
    if (!(std::hypot(near.x - end.x, near.y - end.y) <= same)) return;
    const double x = edge.end.x - edge.start.x, y = edge.end.y - edge.start.y;
    to.push_back(((near.x - edge.start.x) * x + (near.y - edge.start.y) * y) / (x * x + y * y));
  };
  add_end(one, other.start, of_one), add_end(one, other.end, of_one);
  add_end(other, one.start, of_other), add_end(other, one.end, of_other);
  const double from = left_of(other.start, other.end, one.start), to = left_of(other.start, other.end, one.end);
  const double back = left_of(one.start, one.end, other.start), on = left_of(one.start, one.end, other.end);
  if ((from < 0.0) == (to < 0.0) || (back < 0.0) == (on < 0.0)) return;
  of_one.push_back(from / (from - to));
  of_other.push_back(back / (back - on));
}

// An edge between two numbered points.
using NodeEdge = std::pair<std::size_t, std::size_t>;

// The edges, cut wherever they meet.
std::vector<NodeEdge> cut_edges(const std::vector<Segment>& edges, double same, Nodes& nodes) {
  std::vector<std::vector<double>> cuts(edges.size(), {0.0, 1.0});
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Rectangle bounds = around(edges[i]);
    const Rectangle near = {bounds.west - same, bounds.south - same, bounds.east + same, bounds.north + same};
    for (std::size_t j = i + 1; j < edges.size(); ++j) {
      if (!near.meets(around(edges[j]))) continue;
      add_meetings(edges[i], edges[j], same, cuts[i], cuts[j]);
    }
  }
  std::vector<NodeEdge> parts;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    std::sort(cuts[i].begin(), cuts[i].end());
    std::size_t before = nodes.number(edges[i].start);
    for (const double share : cuts[i]) {
      const std::size_t next = nodes.number(between(edges[i].start, edges[i].end, share));
      if (next != before) parts.emplace_back(before, next);
      before = next;
    }
  }
  std::sort(parts.begin(), parts.end());
  return parts;
}

// How many times edges run counter-clockwise around a point.
int winding_number(const std::vector<NodeEdge>& edges, const Nodes& nodes, const Point& at) {
  int winding = 0;
  for (const auto& [first, second] : edges) {
    const Point &start = nodes[first], &end = nodes[second];
    winding += winding_of(start, end, at, left_of(start, end, at));
  }
  return winding;
}

// Of the edges that start where one ends, the next along the area on its left: the first clockwise from the edge back.
std::size_t next_edge(const std::vector<NodeEdge>& edges, const NodeEdge& one, const Nodes& nodes) {
  const auto direction = [&nodes](std::size_t from, std::size_t to) {
    return std::atan2(nodes[to].y - nodes[from].y, nodes[to].x - nodes[from].x);
  };
  const double back = direction(one.second, one.first);
  std::size_t best = edges.size();
  double least = 0.0;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    if (edges[k].first != one.second) continue;
    double turn = back - direction(edges[k].first, edges[k].second);
    if (turn <= 0.0) turn += kTurn;
    if (best == edges.size() || turn < least) best = k, least = turn;
  }
  return best;
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

double perimeter(const std::vector<Point>& ring) {
  double length = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i) length += distance(ring[i], ring[i + 1 < ring.size() ? i + 1 : 0]);
  return length;
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
  return signed_area(result) > kNoPart * sheet.area();
}

// Of the edges, those remain that have area on their left and none on their right.
Outline united(const Outline& pieces, double same) {
  Nodes nodes(same);
  const std::vector<NodeEdge> edges = cut_edges(edges_of(pieces), same, nodes);
  std::vector<NodeEdge> left;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (i > 0 && edges[i] == edges[i - 1]) continue;
    const Point &a = nodes[edges[i].first], &b = nodes[edges[i].second];
    const double beside = kBeside * same / std::hypot(b.x - a.x, b.y - a.y);
    const Point middle = between(a, b, 0.5), away = {beside * (b.y - a.y), beside * (a.x - b.x)};
    const bool inside = winding_number(edges, nodes, {middle.x - away.x, middle.y - away.y}) > 0;
    const bool beyond = winding_number(edges, nodes, {middle.x + away.x, middle.y + away.y}) > 0;
    if (inside && !beyond) left.push_back(edges[i]);
  }
  Outline outline;
  while (!left.empty()) {
    std::vector<Point>& ring = outline.rings.emplace_back();
    NodeEdge at = left.back();
    const std::size_t begin = at.first;
    left.pop_back();
    ring.push_back(nodes[begin]);
    while (at.second != begin) {
      ring.push_back(nodes[at.second]);
      const std::size_t next = next_edge(left, at, nodes);
      if (next == left.size()) return {};
      at = left[next];
      left.erase(left.begin() + static_cast<std::ptrdiff_t>(next));
    }
  }
  return outline;
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

void keep_corners(const std::vector<Point>& loop, std::size_t from, std::size_t to, double tolerance,
                  std::vector<std::uint8_t>& kept) {
  static thread_local std::vector<std::size_t> stack;  // kept between calls so that a step allocates nothing
  const std::size_t count = loop.size();
  stack.assign({from, to});
  while (!stack.empty()) {
    const std::size_t high = stack.back(), low = stack[stack.size() - 2];
    stack.resize(stack.size() - 2);
    const Point &a = loop[low % count], &b = loop[high % count];
    double most = 0.0;
    std::size_t farthest[2] = {low, low};
    for (std::size_t i = low + 1; i < high; ++i) {
      const Point& at = loop[i % count];
      const double off = distance(at, nearest_on(a, b, at));
      if (off > (1.0 + kTie) * most) {
        farthest[0] = farthest[1] = i;
        most = off;
      } else if (off >= (1.0 - kTie) * most) {
        farthest[1] = i;
      }
    }
    if (!(most > tolerance)) continue;
    kept[farthest[0] % count] = kept[farthest[1] % count] = 1;
    const std::size_t ends[4] = {low, farthest[0], farthest[1], high};
    for (int k = 0; k < 3; ++k) {
      if (ends[k + 1] > ends[k] + 1) stack.insert(stack.end(), {ends[k], ends[k + 1]});
    }
  }
}

bool OutlineLoops::set(const Outline& outline, double angle) {
  cosine_ = std::cos(angle), sine_ = std::sin(angle);
  area_ = length_ = 0.0;
  outer_loops_ = 0;
  if (!find_extent(outline)) return false;
  const double least = kNoArea * extent() * extent();
  std::size_t used = 0;
  for (const std::vector<Point>& ring : outline.rings) {
    std::vector<Point>& loop = next_ring(own_, used);
    add_corners(ring, loop);
    close(loop);
    const double area = signed_area(loop);
    if (loop.size() < 3 || !(std::abs(area) > least)) {
      --used;
      continue;
    }
    area_ += area, length_ += perimeter(loop);
    if (area > 0.0) ++outer_loops_;
  }
  own_.rings.resize(used);
  return area_ > least;
}

bool OutlineLoops::find_extent(const Outline& outline) {
  Rectangle bounds = kNoRectangle;
  for (const std::vector<Point>& ring : outline.rings) {
    for (const Point& corner : ring) {
      if (!std::isfinite(corner.x) || !std::isfinite(corner.y)) return false;
      bounds = around(bounds, turned(corner, cosine_, -sine_));
    }
  }
  middle_ = bounds.middle();
  width_ = bounds.east - bounds.west, height_ = bounds.north - bounds.south;
  return extent() > 0.0 && std::isfinite(extent());
}

// Whether a corner coincides with the one before it, or lies on the line through the corners before and after it.
bool OutlineLoops::is_redundant(const Point& before, const Point& at, const Point& after) const {
  return distance(before, at) <= kSamePoint * extent() ||
         std::abs(left_of(before, at, after)) <= kStraight * extent() * distance(before, after);
}

void OutlineLoops::add_corners(const std::vector<Point>& ring, std::vector<Point>& loop) const {
  for (const Point& corner : ring) {
    const Point at = turned(corner, cosine_, -sine_), point = {at.x - middle_.x, at.y - middle_.y};
    while (loop.size() >= 2 && is_redundant(loop[loop.size() - 2], loop.back(), point)) loop.pop_back();
    if (!loop.empty() && distance(loop.back(), point) <= kSamePoint * extent()) continue;
    loop.push_back(point);
  }
}

// Remove redundant corners where the end of a loop meets its start.
void OutlineLoops::close(std::vector<Point>& loop) const {
  std::size_t begin = 0;
  for (bool again = true; again && loop.size() >= begin + 3;) {
    const std::size_t end = loop.size();
    again = false;
    if (is_redundant(loop[end - 2], loop[end - 1], loop[begin]) ||
        distance(loop[end - 1], loop[begin]) <= kSamePoint * extent()) {
      loop.pop_back();
      again = true;
    } else if (is_redundant(loop[end - 1], loop[begin], loop[begin + 1])) {
      ++begin;
      again = true;
    }
  }
  loop.erase(loop.begin(), loop.begin() + static_cast<std::ptrdiff_t>(begin));
}

void OutlineLoops::simplify(double tolerance) {
  for (std::vector<Point>& loop : own_.rings) {
    const auto by_x = [](const Point& a, const Point& b) { return a.x < b.x; };
    const auto west = std::min_element(loop.begin(), loop.end(), by_x);
    const auto east = std::max_element(loop.begin(), loop.end(), by_x);
    const auto low = static_cast<std::size_t>(std::min(west, east) - loop.begin());
    const auto high = static_cast<std::size_t>(std::max(west, east) - loop.begin());
    kept_.assign(loop.size(), 0);
    kept_[low] = kept_[high] = 1;
    keep_corners(loop, low, high, tolerance, kept_);
    keep_corners(loop, high, low + loop.size(), tolerance, kept_);
    if (std::count(kept_.begin(), kept_.end(), 1) < 3) continue;
    std::size_t used = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      if (kept_[i]) loop[used++] = loop[i];
    }
    loop.resize(used);
  }
}

std::size_t OutlineLoops::corners() const {
  std::size_t count = 0;
  for (const std::vector<Point>& loop : own_.rings) count += loop.size();
  return count;
}

Point OutlineLoops::placed(const Point& at) const {
  return turned({at.x + middle_.x, at.y + middle_.y}, cosine_, sine_);
}

}  // namespace mjtactile
