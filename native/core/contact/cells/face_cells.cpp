#include "contact/cells/face_cells.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Width of all rings over the size of the squares, and the shares of it at which each ring ends. Two rings halve the
// readings' error. They are used if at least the fraction kEnoughInside of the cells is left for the squares.
constexpr double kOneRing = 0.1, kTwoRings = 0.3;
constexpr double kOneLayer[] = {1.0}, kTwoLayers[] = {0.15, 1.0};
constexpr double kEnoughInside = 0.25;
// Parts of squares below this fraction of a whole square are joined to a neighbour.
constexpr double kSliver = 0.35;
// Outlines with more corners are simplified, with a tolerance relative to the size of a cell.
constexpr std::size_t kMostCorners = 400;
constexpr double kSimplified = 1e-3;

constexpr std::size_t kMostCells = 4000;
// Most cells that a face gets so that they are no wider than wanted. A face that moves takes about twice as long with so
// many as with 20. With 600 it would take twenty times as long.
constexpr double kMostForWidth = 200.0;
// Rounding errors of distances over the outline's extent, and of areas over its square.
constexpr double kSamePoint = 1e-12, kStraight = 1e-13, kNoArea = 1e-12, kOnLine = 1e-13;
// Number of layouts tried for the wanted number of cells. A layout is accepted if the logarithm of its number over the
// wanted one is at most kClose.
constexpr int kAttempts = 7;
constexpr double kClose = 0.1;
// Edges of the outline longer than this, over the size of the squares, are divided on their own. Runs of shorter edges
// are divided as one curve.
constexpr double kLongEdge = 0.5;
// Cuts nearer than this to a corner, over the size of the squares, are moved to the corner.
constexpr double kSnap = 0.1;
// Round loops shorter than this, over the size of the squares, have a ring of one piece.
constexpr double kOnePiece = 1.5;
// The ring's inner side leaves out corners of the outline that change it by less than this, over the ring's width.
constexpr double kSmooth = 0.2;
// Largest length of a mitre at convex and at concave corners, over the ring's width.
constexpr double kMitre = 5.0, kNotch = 2.0;
// Largest width of a ring over the distance to the opposite side of the outline.
constexpr double kMostWidth = 0.4;
// A run of inner edges that point backward is merged into a point if its part of the outline is shorter than this, over
// the ring's width. Otherwise the ring is made narrower there.
constexpr double kSwallowed = 3.0;
constexpr int kMends = 8;   // rounds of repairs to the inner side
// Least width of a ring over the wanted one. Narrower cells are too thin for accurate integrals.
constexpr double kLeastShare = 1.0 / 16;
// Lengths and distances that differ by less than this fraction count as equal.
constexpr double kTie = 1e-6;
// Pieces of a ring below this fraction of a whole piece are joined to a neighbour.
constexpr double kNoPiece = 1e-2;
// So are parts of squares below this fraction of a square, even if two neighbours share equally long edges with them.
// Larger ones would make symmetric outlines' cells one-sided.
constexpr double kNoSquare = 1e-6;
constexpr int kJoins = 4;   // rounds of joining
// An outline counts as convex if its hull's area is at most this times its own.
constexpr double kConvex = 1.0 + 1e-6;

// A cell whose principal second moments differ by less than this fraction has no principal axes.
constexpr double kRound = 1e-9;

double distance(const Point& a, const Point& b) {
  const double x = b.x - a.x, y = b.y - a.y;
  return std::sqrt(x * x + y * y);
}

double distance_to_segment(const Point& point, const Point& a, const Point& b) {
  return distance(point, nearest_on(a, b, point));
}

Point between(const Point& a, const Point& b, double part) {
  return {a.x + part * (b.x - a.x), a.y + part * (b.y - a.y)};
}

Point turned(const Point& point, double cosine, double sine) {
  return {cosine * point.x - sine * point.y, sine * point.x + cosine * point.y};
}

bool apart(const Point& a, const Point& b, const Point& c, const Point& d) {
  return std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
         std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y);
}

bool crossing(const Point& a, const Point& b, const Point& c, const Point& d) {
  if (apart(a, b, c, d)) return false;
  return left_of(a, b, c) * left_of(a, b, d) < 0.0 && left_of(c, d, a) * left_of(c, d, b) < 0.0;
}

std::size_t pieces_of(double length, double size) {
  return static_cast<std::size_t>(std::max(1.0, std::round(length / size)));
}

}  // namespace

bool FaceCells::make(const Outline& outline, const CellCount& asked, Face& face, double angle) {
  const double cosine = std::cos(angle), sine = std::sin(angle);
  if (!set_loops(outline, cosine, sine)) return false;
  // Each piece of a face has its own rim.
  auto count = static_cast<double>(std::max(asked.count, std::size_t{1}));
  if (asked.widest > 0.0) count = std::max(count, std::min(area_ / (asked.widest * asked.widest), kMostForWidth));
  const double wanted = std::min(count * std::sqrt(outer_rings_), static_cast<double>(kMostCells));
  if (points_.size() > kMostCorners) simplify(kSimplified * std::sqrt(area_ / wanted));
  // Squares of size h: about area / h^2 of them inside, and length / h pieces in each ring.
  const auto size_with = [&](double rings) {
    const double along = rings * length_;
    return (along + std::sqrt(along * along + 4 * wanted * area_)) / (2 * wanted);
  };
  const double finer = size_with(2.0);
  const bool two = area_ >= kEnoughInside * wanted * finer * finer;
  layers_ = two ? kTwoLayers : kOneLayer;
  layer_count_ = two ? 2 : 1;
  const double size = two ? finer : size_with(1.0), width = two ? kTwoRings : kOneRing;
  if (!(fit(size, wanted, width) && describe(face, cosine, sine)) &&
      !(fit(size, wanted, 0.0) && describe(face, cosine, sine))) {
    return false;
  }
  for (Point& point : points_) point = placed(point, cosine, sine);
  face.corners = convex_hull(points_);
  face.hull = convex_hull(face.centroids);
  double hull_area = 0.0;
  for (std::size_t i = 0; i < face.corners.size(); ++i) {
    hull_area += left_of(face.corners[0], face.corners[i], face.corners[(i + 1) % face.corners.size()]) / 2;
  }
  face.convex = hull_area <= kConvex * face.length * face.length;
  place_quadrature(face);
  return true;
}

Point FaceCells::placed(const Point& at, double cosine, double sine) const {
  return turned({at.x + middle_.x, at.y + middle_.y}, cosine, sine);
}

// Set the face's cells and their integrals. False if a cell is too thin: cancellation then leaves its integral no
// digits.
bool FaceCells::describe(Face& face, double cosine, double sine) {
  // Integrals use coordinates about the middle, where rounding is least.
  face.edges.clear();
  for (const RawEdge& edge : edges_) {
    face.edges.push_back({{edge.start.x, edge.start.y}, {edge.end.x, edge.end.y}, edge.left, edge.right});
  }
  integrals_.inverse_distance(face.edges, cells_, face.inverse_distance);
  for (std::size_t i = 0; i < cells_; ++i) {
    if (!(face.inverse_distance[i * cells_ + i] > 0.0)) return false;
  }
  for (CellEdge& edge : face.edges) {
    const Point start = placed({edge.start[0], edge.start[1]}, cosine, sine);
    const Point end = placed({edge.end[0], edge.end[1]}, cosine, sine);
    edge = {{start.x, start.y}, {end.x, end.y}, edge.left, edge.right};
  }
  face.areas.assign(areas_.begin(), areas_.end());
  face.centroids.clear();
  double area = 0.0;
  for (std::size_t i = 0; i < cells_; ++i) {
    area += areas_[i];
    face.centroids.push_back(placed(centroids_[i], cosine, sine));
  }
  face.length = std::sqrt(area);
  return true;
}

// Set points_ and loops_ from an outline, without redundant corners and rings without area. False if no area is left.
bool FaceCells::set_loops(const Outline& outline, double cosine, double sine) {
  points_.clear();
  loops_.clear();
  area_ = length_ = outer_rings_ = 0.0;
  if (!find_extent(outline, cosine, sine)) return false;
  const double extent = std::max(extent_[0], extent_[1]);
  for (const std::vector<Point>& ring : outline.rings) {
    const std::size_t first = points_.size();
    add_corners(ring, cosine, sine);
    close_loop(first);
    double area = 0.0, length = 0.0;
    const std::size_t last = points_.size();
    for (std::size_t i = first; i < last; ++i) {
      const Point &a = points_[i], &b = points_[i + 1 < last ? i + 1 : first];
      area += left_of(points_[first], a, b) / 2;
      length += distance(a, b);
    }
    if (last < first + 3 || !(std::abs(area) > kNoArea * extent * extent)) {
      points_.resize(first);
      continue;
    }
    area_ += area, length_ += length;
    if (area > 0.0) outer_rings_ += 1.0;
    loops_.push_back({first, last});
  }
  return area_ > kNoArea * extent * extent;
}

bool FaceCells::find_extent(const Outline& outline, double cosine, double sine) {
  double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
  for (const std::vector<Point>& ring : outline.rings) {
    for (const Point& corner : ring) {
      if (!std::isfinite(corner.x) || !std::isfinite(corner.y)) return false;
      const Point at = turned(corner, cosine, -sine);
      low[0] = std::min(low[0], at.x), high[0] = std::max(high[0], at.x);
      low[1] = std::min(low[1], at.y), high[1] = std::max(high[1], at.y);
    }
  }
  middle_ = {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2};
  extent_[0] = high[0] - low[0], extent_[1] = high[1] - low[1];
  const double extent = std::max(extent_[0], extent_[1]);
  return extent > 0.0 && std::isfinite(extent);
}

// Whether a corner coincides with the one before it, or lies on the line through the corners before and after it.
bool FaceCells::is_redundant(const Point& before, const Point& at, const Point& after) const {
  const double extent = std::max(extent_[0], extent_[1]);
  return distance(before, at) <= kSamePoint * extent ||
         std::abs(left_of(before, at, after)) <= kStraight * extent * distance(before, after);
}

void FaceCells::add_corners(const std::vector<Point>& ring, double cosine, double sine) {
  const std::size_t first = points_.size();
  const double same = kSamePoint * std::max(extent_[0], extent_[1]);
  for (const Point& corner : ring) {
    const Point at = turned(corner, cosine, -sine), point = {at.x - middle_.x, at.y - middle_.y};
    while (points_.size() >= first + 2 && is_redundant(points_[points_.size() - 2], points_.back(), point)) {
      points_.pop_back();
    }
    if (points_.size() > first && distance(points_.back(), point) <= same) continue;
    points_.push_back(point);
  }
}

// Remove redundant corners where the end of a loop meets its start.
void FaceCells::close_loop(std::size_t first) {
  const double same = kSamePoint * std::max(extent_[0], extent_[1]);
  std::size_t begin = first;
  for (bool again = true; again && points_.size() >= begin + 3;) {
    const std::size_t end = points_.size();
    again = false;
    if (is_redundant(points_[end - 2], points_[end - 1], points_[begin]) ||
        distance(points_[end - 1], points_[begin]) <= same) {
      points_.pop_back();
      again = true;
    } else if (is_redundant(points_[end - 1], points_[begin], points_[begin + 1])) {
      ++begin;
      again = true;
    }
  }
  points_.erase(points_.begin() + static_cast<std::ptrdiff_t>(first),
                points_.begin() + static_cast<std::ptrdiff_t>(begin));
}

// Remove corners that change the outline by less than a tolerance [m].
void FaceCells::simplify(double tolerance) {
  std::size_t used = 0;
  for (Loop& loop : loops_) {
    walk_.clear();
    std::size_t ends[2] = {0, 0};
    for (std::size_t i = loop.first; i < loop.last; ++i) {
      walk_.push_back({points_[i], false, false, 0});
      const std::size_t at = i - loop.first;
      if (points_[i].x < walk_[ends[0]].at.x) ends[0] = at;
      if (points_[i].x > walk_[ends[1]].at.x) ends[1] = at;
    }
    const std::size_t count = walk_.size(), low = std::min(ends[0], ends[1]), high = std::max(ends[0], ends[1]);
    walk_[low].kept = walk_[high].kept = true;
    keep_corners({0, count}, low, high, tolerance);
    keep_corners({0, count}, high, low + count, tolerance);
    const auto kept = std::count_if(walk_.begin(), walk_.end(), [](const WalkPoint& one) { return one.kept; });
    loop.first = used;
    for (const WalkPoint& one : walk_) {
      if (one.kept || kept < 3) points_[used++] = one.at;
    }
    loop.last = used;
  }
  points_.resize(used);
}

// Find the size of squares that gives about the wanted number of cells. `width`: of all rings, over that size.
bool FaceCells::fit(double size, double wanted, double width) {
  double best = 0.0, least = INFINITY;    // size with the least error so far, and this error
  double few = INFINITY, many = 0.0;      // sizes that give too few cells and too many
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::size_t cells = lay_out(size, width * size);
    if (cells == 0) return false;
    const double ratio = static_cast<double>(cells) / wanted, off = std::abs(std::log(ratio));
    if (off < least) least = off, best = size;
    if (off <= kClose) return true;
    if (ratio < 1.0) {
      few = std::min(few, size);
    } else {
      many = std::max(many, size);
    }
    const bool bracketed = few < INFINITY && many > 0.0 && many < few;
    size = bracketed ? std::sqrt(few * many) : size * std::pow(ratio, ratio > 1.0 ? 0.7 : 0.6);
  }
  return lay_out(best, width * best) > 0;
}

std::size_t FaceCells::lay_out(double size, double width) {
  size_ = size;
  width_ = width;
  walk_.clear();
  kept_.clear();
  walk_loops_.clear();
  kept_loops_.clear();
  edges_.clear();
  inner_.clear();
  inner_loops_.clear();
  pieces_ = 0;
  for (const Loop& loop : loops_) walk(loop);
  if (width > 0.0) {
    bound_shares();
    mend_inner_side();
  }
  ring_cells_ = width > 0.0 ? pieces_ * static_cast<std::int32_t>(layer_count_) : 0;
  place_lattice();
  for (std::size_t k = 0; k < loops_.size(); ++k) add_ring_edges(kept_loops_[k], walk_loops_[k]);
  cut_at_lattice();
  label_cells();
  join_parts_of_squares();
  join_slivers();
  const double least = kNoArea * area_;
  for (std::size_t i = 0; i < cells_; ++i) {
    if (!(areas_[i] > least)) return 0;
  }
  finish();
  return cells_;
}

// Divide one loop into pieces of the ring, and choose the corners of the ring's inner side.
void FaceCells::walk(const Loop& loop) {
  const std::size_t count = loop.last - loop.first;
  lengths_.resize(count);
  cuts_.clear();
  double length = 0.0;
  std::size_t any_long = count;
  for (std::size_t i = 0; i < count; ++i) {
    lengths_[i] = distance(points_[loop.first + i], points_[loop.first + (i + 1) % count]);
    length += lengths_[i];
    if (is_long(i) && any_long == count) any_long = i;
  }
  if (width_ > 0.0 && any_long == count) cut_round_loop(loop, length);
  if (width_ > 0.0 && any_long < count) cut_edges(any_long);
  std::sort(cuts_.begin(), cuts_.end(), [](const Cut& a, const Cut& b) {
    return a.edge < b.edge || (a.edge == b.edge && a.along < b.along);
  });
  const std::size_t first = walk_.size();
  const std::int32_t stations = add_walk(loop);
  std::int32_t passed = 0;
  for (std::size_t i = first; i < walk_.size(); ++i) {
    if (walk_[i].station) ++passed;
    walk_[i].piece = pieces_ + (stations > 0 ? (passed + stations - 1) % stations : 0);
  }
  pieces_ += std::max(stations, std::int32_t{1});
  walk_loops_.push_back({first, walk_.size()});
  keep(walk_loops_.back());
}

// Cut each long edge into equal pieces, and each run of short edges between two long ones. `begin`: a long edge.
void FaceCells::cut_edges(std::size_t begin) {
  const std::size_t count = lengths_.size();
  std::size_t edge = begin;
  do {
    const std::size_t pieces = pieces_of(lengths_[edge], size_);
    for (std::size_t k = 1; k < pieces; ++k) {
      cuts_.push_back({edge, lengths_[edge] * static_cast<double>(k) / static_cast<double>(pieces)});
    }
    const std::size_t run = (edge + 1) % count;
    double run_length = 0.0;
    for (edge = run; !is_long(edge); edge = (edge + 1) % count) run_length += lengths_[edge];
    if (run_length < kLongEdge * size_) {
      add_cut(run, run_length / 2);
      continue;
    }
    const std::size_t parts = pieces_of(run_length, size_);
    for (std::size_t k = 0; k <= parts; ++k) {
      add_cut(run, run_length * static_cast<double>(k) / static_cast<double>(parts));
    }
  } while (edge != begin);
}

bool FaceCells::is_long(std::size_t edge) const { return lengths_[edge] > kLongEdge * size_; }

// Append a loop's corners and cuts to walk_, in order. Returns the number of stations among them.
std::int32_t FaceCells::add_walk(const Loop& loop) {
  const std::size_t count = loop.last - loop.first;
  std::size_t next = 0;
  std::int32_t stations = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Point &a = points_[loop.first + i], &b = points_[loop.first + (i + 1) % count];
    walk_.push_back({a, false, false, 0});
    for (; next < cuts_.size() && cuts_[next].edge == i; ++next) {
      if (cuts_[next].along > 0.0) {
        if (next > 0 && cuts_[next - 1].edge == i && !(cuts_[next].along > cuts_[next - 1].along)) continue;
        walk_.push_back({between(a, b, cuts_[next].along / lengths_[i]), false, false, 0});
      } else if (walk_.back().station) {
        continue;
      }
      walk_.back().station = true;
      ++stations;
    }
  }
  return stations;
}

// Add a cut at a distance along the outline from an edge's start [m], or at a corner close to it.
void FaceCells::add_cut(std::size_t edge, double along) {
  while (along > lengths_[edge]) {
    along -= lengths_[edge];
    edge = edge + 1 < lengths_.size() ? edge + 1 : 0;
    if (is_long(edge)) along = 0.0;  // the run ends here; only rounding is left
  }
  const double after = lengths_[edge] - along, snap = std::min(std::min(along, after), kSnap * size_);
  if (snap < kSnap * size_ && std::abs(after - along) > kTie * lengths_[edge]) {
    if (after < along) edge = edge + 1 < lengths_.size() ? edge + 1 : 0;
    along = 0.0;
  }
  cuts_.push_back({edge, along});
}

// Cut a loop without long edges into pieces. Anchors are its extreme points along the axes, so that symmetric loops
// have symmetric pieces. Pieces between two anchors are equal.
void FaceCells::cut_round_loop(const Loop& loop, double length) {
  if (length < kOnePiece * size_) return;
  const std::size_t count = loop.last - loop.first;
  const double extent = std::max(extent_[0], extent_[1]);
  anchors_.clear();
  for (int side = 0; side < 4; ++side) {
    const auto reach = [&](std::size_t i) {
      const Point& at = points_[loop.first + i];
      return (side % 2 == 0 ? 1.0 : -1.0) * (side < 2 ? at.x : at.y);
    };
    double most = -INFINITY;
    for (std::size_t i = 0; i < count; ++i) most = std::max(most, reach(i));
    const auto farthest = [&](std::size_t i) { return reach(i) >= most - kTie * extent; };
    // The extreme must be one corner or the middle of one edge. If it is reached in several places, it is not used.
    std::size_t corners = 0, edges = 0;
    double from = 0.0, corner = 0.0, middle = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      if (farthest(i)) {
        ++corners;
        corner = from;
        if (farthest(i + 1 < count ? i + 1 : 0)) ++edges, middle = from + lengths_[i] / 2;
      }
      from += lengths_[i];
    }
    if (corners == 1) anchors_.push_back(corner);
    if (corners == 2 && edges == 1) anchors_.push_back(middle);
  }
  if (anchors_.empty()) anchors_.push_back(0.0);
  std::sort(anchors_.begin(), anchors_.end());
  for (std::size_t k = 0; k < anchors_.size(); ++k) {
    const double start = anchors_[k];
    const double end = k + 1 < anchors_.size() ? anchors_[k + 1] : anchors_[0] + length;
    if (!(end - start > kTie * length)) continue;
    const std::size_t pieces = pieces_of(end - start, size_);
    std::size_t edge = 0;
    double before = 0.0;
    while (edge + 1 < count && before + lengths_[edge] <= start) before += lengths_[edge++];
    for (std::size_t i = 0; i < pieces; ++i) {
      add_cut(edge, start - before + (end - start) * static_cast<double>(i) / static_cast<double>(pieces));
    }
  }
}

void FaceCells::keep(const Loop& loop) {
  const std::size_t count = loop.last - loop.first, first = kept_.size();
  std::size_t stations = 0, before = 0, begin = 0;
  for (std::size_t i = 0; i < count && width_ > 0.0; ++i) {
    if (!walk_[loop.first + i].station) continue;
    walk_[loop.first + i].kept = true;
    if (stations++ == 0) {
      begin = i;
    } else {
      keep_corners(loop, before, i, kSmooth * width_);
    }
    before = i;
  }
  if (stations > 0) keep_corners(loop, before, begin + count, kSmooth * width_);
  std::size_t kept = 0;
  for (std::size_t i = loop.first; i < loop.last; ++i) kept += walk_[i].kept ? 1 : 0;
  for (std::size_t i = loop.first; i < loop.last; ++i) {
    if (kept < 3) walk_[i].kept = true;
    if (walk_[i].kept) kept_.push_back({walk_[i].at, {0.0, 0.0}, walk_[i].at, width_ > 0.0 ? 1.0 : 0.0, i, false});
  }
  kept_loops_.push_back({first, kept_.size()});
  if (width_ > 0.0) direct_inward(kept_loops_.back());
}

// Keep corners between two points of a loop by the algorithm of Douglas and Peucker. If two points are equally far from
// the chord, both are kept, so that symmetric outlines stay symmetric.
void FaceCells::keep_corners(const Loop& loop, std::size_t from, std::size_t to, double tolerance) {
  const std::size_t count = loop.last - loop.first;
  const auto at = [&](std::size_t i) -> WalkPoint& { return walk_[loop.first + i % count]; };
  stack_.clear();
  stack_.push_back(from);
  stack_.push_back(to);
  while (!stack_.empty()) {
    const std::size_t high = stack_.back(), low = stack_[stack_.size() - 2];
    stack_.resize(stack_.size() - 2);
    double most = 0.0;
    std::size_t farthest[2] = {low, low};
    for (std::size_t i = low + 1; i < high; ++i) {
      const double off = distance_to_segment(at(i).at, at(low).at, at(high).at);
      if (off > (1.0 + kTie) * most) {
        farthest[0] = farthest[1] = i;
        most = off;
      } else if (off >= (1.0 - kTie) * most) {
        farthest[1] = i;
      }
    }
    if (!(most > tolerance)) continue;
    at(farthest[0]).kept = at(farthest[1]).kept = true;
    const std::size_t ends[4] = {low, farthest[0], farthest[1], high};
    for (int k = 0; k < 3; ++k) {
      if (ends[k + 1] > ends[k] + 1) stack_.insert(stack_.end(), {ends[k], ends[k + 1]});
    }
  }
}

// Set the inward vectors of a loop's kept points: mitre joints of limited length.
void FaceCells::direct_inward(const Loop& loop) {
  const std::size_t count = loop.last - loop.first;
  for (std::size_t k = 0; k < count; ++k) {
    const Point &before = kept_[loop.first + (k + count - 1) % count].at;
    const Point &after = kept_[loop.first + (k + 1) % count].at;
    KeptPoint& own = kept_[loop.first + k];
    const double in = distance(before, own.at), out = distance(own.at, after);
    const double u[2] = {(own.at.x - before.x) / in, (own.at.y - before.y) / in};
    const double v[2] = {(after.x - own.at.x) / out, (after.y - own.at.y) / out};
    const double x = -u[1] - v[1], y = u[0] + v[0], size = std::sqrt(x * x + y * y);  // 2 cos(half the turn)
    const bool notch = u[0] * v[1] - u[1] * v[0] < 0.0;
    if (size > kTie) {
      const double reach = std::min(2.0 / size, notch ? kNotch : kMitre) / size;
      own.inward = {reach * x, reach * y};
    } else {
      const double bx = v[0] - u[0], by = v[1] - u[1];
      const double reach = (notch ? -kNotch : kMitre) / std::sqrt(bx * bx + by * by);
      own.inward = {reach * bx, reach * by};
    }
    set_inner(own);
  }
}

void FaceCells::set_inner(KeptPoint& point) {
  point.swallowed = false;
  point.inner = {point.at.x + point.share * width_ * point.inward.x,
                 point.at.y + point.share * width_ * point.inward.y};
}

// Make the ring narrower where the opposite side of the outline is near.
void FaceCells::bound_shares() {
  for (const Loop& own_loop : kept_loops_) {
    for (std::size_t k = own_loop.first; k < own_loop.last; ++k) {
      KeptPoint& own = kept_[k];
      const Point far = {own.at.x + width_ / kMostWidth * own.inward.x, own.at.y + width_ / kMostWidth * own.inward.y};
      double share = 1.0;
      for (const Loop& loop : kept_loops_) {
        for (std::size_t i = loop.first; i < loop.last; ++i) {
          const std::size_t next = i + 1 < loop.last ? i + 1 : loop.first;
          if (i == k || next == k) continue;
          const Point &a = kept_[i].at, &b = kept_[next].at;
          if (apart(own.at, far, a, b)) continue;
          const double from = left_of(own.at, far, a), to = left_of(own.at, far, b);
          if (from * to > 0.0 || from == to) continue;
          const double here = left_of(a, b, own.at), there = left_of(a, b, far);
          if (here * there >= 0.0) continue;
          share = std::min(share, here / (here - there));
        }
      }
      own.share = share >= kLeastShare ? share : 0.0;
      set_inner(own);
    }
  }
}

void FaceCells::mend_inner_side() {
  for (int round = 0; round < kMends; ++round) {
    bool mended = false;
    for (const Loop& loop : kept_loops_) mended = mend_inner_side(loop) || mended;
    if (uncross(round + 1 == kMends)) mended = true;
    if (!mended) return;
  }
}

// Repair edges of the inner side that point opposite to their edges of the outline. Each run of them is merged into one
// point, or the ring becomes narrower there. Returns whether anything was changed.
bool FaceCells::mend_inner_side(const Loop& loop) {
  const std::size_t count = loop.last - loop.first;
  const auto at = [&](std::size_t k) -> KeptPoint& { return kept_[loop.first + k % count]; };
  backward_.assign(count, 0);
  std::size_t forward = count;
  for (std::size_t k = 0; k < count; ++k) {
    const KeptPoint &a = at(k), &b = at(k + 1);
    const double x = b.at.x - a.at.x, y = b.at.y - a.at.y;
    const double along = (b.inner.x - a.inner.x) * x + (b.inner.y - a.inner.y) * y;
    const bool done = (a.share == 0.0 && b.share == 0.0) || (a.inner.x == b.inner.x && a.inner.y == b.inner.y);
    backward_[k] = !done && !(along > kTie * (x * x + y * y)) ? 1 : 0;
    if (!backward_[k]) forward = k;
  }
  if (forward == count) {
    for (std::size_t k = 0; k < count; ++k) shrink(at(k));
    return true;
  }
  bool mended = false;
  for (std::size_t step = 1; step < count; ++step) {
    const std::size_t first = forward + step;
    std::size_t last = first;  // last point of the run
    while (backward_[last % count]) ++last;
    if (last == first) continue;
    mended = true;
    double length = 0.0;
    Point sum = {0.0, 0.0};
    bool swallowed = false;
    for (std::size_t k = first; k <= last; ++k) {
      sum.x += at(k).inner.x, sum.y += at(k).inner.y;
      swallowed = swallowed || at(k).swallowed || at(k).share == 0.0;
      if (k < last) length += distance(at(k).at, at(k + 1).at);
    }
    const auto points = static_cast<double>(last - first + 1);
    const bool swallow = !swallowed && length < kSwallowed * width_;
    for (std::size_t k = first; k <= last; ++k) {
      if (swallow) {
        at(k).inner = {sum.x / points, sum.y / points};
        at(k).swallowed = true;
      } else {
        shrink(at(k));
      }
    }
    step = last - forward;
  }
  return mended;
}

void FaceCells::shrink(KeptPoint& point) {
  point.share = point.share > kLeastShare ? point.share / 2 : 0.0;
  set_inner(point);
}

// Make the ring narrower where its inner side crosses itself. In the last round its width becomes zero there. Returns
// whether there was a crossing. All crossings are found before a point is moved, so that their order does not matter.
bool FaceCells::uncross(bool last) {
  crossed_.assign(kept_.size(), 0);
  for (std::size_t first = 0; first < kept_loops_.size(); ++first) {
    const Loop& loop = kept_loops_[first];
    for (std::size_t k = loop.first; k < loop.last; ++k) {
      const std::size_t after = k + 1 < loop.last ? k + 1 : loop.first;
      for (std::size_t second = first; second < kept_loops_.size(); ++second) {
        const Loop& other = kept_loops_[second];
        for (std::size_t i = second == first ? k + 1 : other.first; i < other.last; ++i) {
          const std::size_t next = i + 1 < other.last ? i + 1 : other.first;
          if (i == after || next == k) continue;
          if (!crossing(kept_[k].inner, kept_[after].inner, kept_[i].inner, kept_[next].inner)) continue;
          for (const std::size_t one : {k, after, i, next}) crossed_[one] = 1;
        }
      }
    }
  }
  bool found = false;
  for (std::size_t k = 0; k < kept_.size(); ++k) {
    if (!crossed_[k]) continue;
    found = true;
    if (last) kept_[k].share = 0.0;
    shrink(kept_[k]);
  }
  return found;
}

void FaceCells::place_lattice() {
  const auto lines = [](double extent, std::size_t count, std::vector<double>& at) {
    at.resize(count + 1);
    for (std::size_t i = 0; i <= count; ++i) {
      at[i] = (static_cast<double>(i) - static_cast<double>(count) / 2) * (extent / static_cast<double>(count));
    }
  };
  columns_ = pieces_of(extent_[0], size_);
  rows_ = pieces_of(extent_[1], size_);
  lines(extent_[0], columns_, lines_x_);
  lines(extent_[1], rows_, lines_y_);
  // Move points that are on a line up to rounding exactly onto it, so that no tiny edges remain.
  for (KeptPoint& point : kept_) {
    snap(point.inner);
    if (point.share == 0.0) walk_[point.walk].at = point.at = point.inner;
  }
}

void FaceCells::snap(Point& point) {
  const double near = kOnLine * std::max(extent_[0], extent_[1]);
  const auto move = [near](double& to, const std::vector<double>& lines) {
    const std::size_t place = interval(lines, to);
    for (const std::size_t line : {place, place + 1}) {
      if (std::abs(lines[line] - to) <= near) to = lines[line];
    }
  };
  move(point.x, lines_x_);
  move(point.y, lines_y_);
}

void FaceCells::add_ring_edges(const Loop& kept, const Loop& walk) {
  const std::size_t first_inner = inner_.size();
  const auto layer = [this](const KeptPoint& point, std::size_t number) {
    if (number == 0) return point.at;
    return number == layer_count_ ? point.inner : between(point.at, point.inner, layers_[number - 1]);
  };
  for (std::size_t k = kept.first; k < kept.last; ++k) {
    const KeptPoint &own = kept_[k], &after = kept_[k + 1 < kept.last ? k + 1 : kept.first];
    const bool ring = own.share > 0.0 || after.share > 0.0;
    const std::int32_t piece = walk_[own.walk].piece;
    for (std::size_t i = own.walk; ;) {
      const std::size_t next = i + 1 < walk.last ? i + 1 : walk.first;
      if (ring) {
        add_edge(walk_[i].at, walk_[next].at, piece, -1);
      } else {
        inner_.push_back({walk_[i].at, -1});
        snap(inner_.back().at);
      }
      i = next;
      if (i == after.walk) break;
    }
    const std::int32_t before = walk_[own.walk > walk.first ? own.walk - 1 : walk.last - 1].piece;
    for (std::size_t number = 0; number < layer_count_; ++number) {
      const std::int32_t ring_before = static_cast<std::int32_t>(number) * pieces_;
      if (walk_[own.walk].station && own.share > 0.0) {
        add_edge(layer(own, number), layer(own, number + 1), before + ring_before, piece + ring_before);
      }
      if (number > 0 && ring) {
        add_edge(layer(own, number), layer(after, number), piece + ring_before, piece + ring_before - pieces_);
      }
    }
    if (ring) inner_.push_back({own.inner, piece + static_cast<std::int32_t>(layer_count_ - 1) * pieces_});
  }
  inner_loops_.push_back({first_inner, inner_.size()});
}

void FaceCells::add_edge(const Point& start, const Point& end, std::int32_t left, std::int32_t right) {
  if (start.x == end.x && start.y == end.y) return;
  edges_.push_back({start, end, left, right});
}

// Cut the area within the rings along the lattice. Each connected part of a square becomes a cell.
void FaceCells::cut_at_lattice() {
  upright_.clear();
  level_.clear();
  // Items after those of the rings: the corners of all squares; follow_loop() adds chains of edges.
  const std::size_t items = static_cast<std::size_t>(ring_cells_) + 4 * columns_ * rows_;
  square_of_.assign(items, -1);
  for (std::size_t i = static_cast<std::size_t>(ring_cells_); i < items; ++i) {
    square_of_[i] = static_cast<std::int32_t>((i - static_cast<std::size_t>(ring_cells_)) / 4);
  }
  sets_.reset(items);
  for (const Loop& loop : inner_loops_) follow_loop(loop);
  add_lines(upright_, true);
  add_lines(level_, false);
}

std::size_t FaceCells::interval(const std::vector<double>& lines, double at) {
  const std::size_t count = lines.size() - 1;
  const double guess = (at - lines[0]) / (lines[count] - lines[0]) * static_cast<double>(count);
  std::size_t place = guess > 0.0 ? std::min(static_cast<std::size_t>(guess), count - 1) : 0;
  while (place > 0 && !(at > lines[place])) --place;
  while (place + 1 < count && at > lines[place + 1]) ++place;
  return place;
}

std::int32_t FaceCells::new_chain(std::size_t column, std::size_t row) {
  square_of_.push_back(static_cast<std::int32_t>(row * columns_ + column));
  return sets_.add();
}

// Follow a loop from square to square. Adds its edges, with one chain per stay in a square, and its crossings.
void FaceCells::follow_loop(const Loop& loop) {
  if (loop.first == loop.last) return;
  Point at = inner_[loop.first].at;
  std::size_t column = interval(lines_x_, at.x), row = interval(lines_y_, at.y);
  const std::int32_t begun = new_chain(column, row);
  std::int32_t chain = begun;
  for (std::size_t i = loop.first; i < loop.last; ++i) {
    const Point &a = inner_[i].at, &b = inner_[i + 1 < loop.last ? i + 1 : loop.first].at;
    const std::size_t to_column = interval(lines_x_, b.x), to_row = interval(lines_y_, b.y);
    const std::int32_t right = inner_[i].right;
    while (column != to_column || row != to_row) {
      const bool east = to_column > column, north = to_row > row;
      const std::size_t line_x = east ? column + 1 : column, line_y = north ? row + 1 : row;
      const double part_x = column != to_column ? (lines_x_[line_x] - a.x) / (b.x - a.x) : INFINITY;
      const double part_y = row != to_row ? (lines_y_[line_y] - a.y) / (b.y - a.y) : INFINITY;
      Point next;
      if (part_x <= part_y) {
        next = part_x < 1.0 ? Point{lines_x_[line_x], a.y + part_x * (b.y - a.y)} : b;
        snap(next);
        if (row > 0) next.y = std::max(next.y, lines_y_[row]);
        if (row + 1 < rows_) next.y = std::min(next.y, lines_y_[row + 1]);
        add_edge(at, next, chain, right);
        const std::size_t beyond = east ? column + 1 : column - 1;
        const std::int32_t before = chain;
        chain = new_chain(beyond, row);
        upright_.push_back({static_cast<std::uint32_t>(line_x), static_cast<std::uint32_t>(row), next.y, east ? 1 : -1,
                            east ? before : chain, east ? chain : before});
        column = beyond;
      } else {
        next = part_y < 1.0 ? Point{a.x + part_y * (b.x - a.x), lines_y_[line_y]} : b;
        snap(next);
        if (column > 0) next.x = std::max(next.x, lines_x_[column]);
        if (column + 1 < columns_) next.x = std::min(next.x, lines_x_[column + 1]);
        add_edge(at, next, chain, right);
        const std::size_t beyond = north ? row + 1 : row - 1;
        const std::int32_t before = chain;
        chain = new_chain(column, beyond);
        level_.push_back({static_cast<std::uint32_t>(line_y), static_cast<std::uint32_t>(column), next.x,
                          north ? -1 : 1, north ? before : chain, north ? chain : before});
        row = beyond;
      }
      at = next;
    }
    add_edge(at, b, chain, right);
    at = b;
  }
  sets_.join(begun, chain);
}

// Add the lattice's own edges: along its lines, between crossings with the loops, where the area is inside.
void FaceCells::add_lines(std::vector<Crossing>& crossings, bool upright) {
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return a.line != b.line ? a.line < b.line : a.place != b.place ? a.place < b.place : a.at < b.at;
  });
  const std::vector<double>& lines = upright ? lines_x_ : lines_y_;
  const std::vector<double>& across = upright ? lines_y_ : lines_x_;
  const auto corner = [&](std::size_t line, std::size_t place, bool high_side, bool high_end) {
    const std::size_t beside = high_side ? line : line - 1;
    const std::size_t square = upright ? place * columns_ + beside : beside * columns_ + place;
    // A square's corners are numbered by two bits: 1 for the higher x, 2 for the higher y.
    const bool x = upright ? !high_side : high_end, y = upright ? high_end : !high_side;
    return ring_cells_ + static_cast<std::int32_t>(4 * square + (x ? 1 : 0) + (y ? 2 : 0));
  };
  const auto point = [&](std::size_t line, double at) {
    return upright ? Point{lines[line], at} : Point{at, lines[line]};
  };
  std::size_t next = 0;
  for (std::size_t line = 1; line + 1 < lines.size(); ++line) {
    int turns = 0;
    for (std::size_t place = 0; place + 1 < across.size(); ++place) {
      double from = across[place];
      std::int32_t low = corner(line, place, false, false), high = corner(line, place, true, false);
      const auto add = [&](double to, std::int32_t low_end, std::int32_t high_end) {
        if (turns == 0) return;
        sets_.join(low, low_end);
        sets_.join(high, high_end);
        const bool low_left = upright == (turns > 0);
        for (int k = std::abs(turns); k > 0; --k) {
          add_edge(point(line, from), point(line, to), low_left ? low : high, low_left ? high : low);
        }
      };
      for (; next < crossings.size() && crossings[next].line == line && crossings[next].place == place; ++next) {
        const Crossing& met = crossings[next];
        add(met.at, met.low, met.high);
        turns += met.sign;
        from = met.at, low = met.low, high = met.high;
      }
      add(across[place + 1], corner(line, place, false, true), corner(line, place, true, true));
    }
  }
}

// Number the cells, and compute their areas and centroids from their edges.
void FaceCells::label_cells() {
  label_.assign(square_of_.size(), -1);
  kinds_.clear();
  cells_ = 0;
  for (const RawEdge& edge : edges_) {
    for (const std::int32_t side : {edge.left, edge.right}) {
      if (side < 0) continue;
      const std::int32_t item = sets_.root(side);
      std::int32_t& label = label_[static_cast<std::size_t>(item)];
      if (label >= 0) continue;
      label = static_cast<std::int32_t>(cells_++);
      kinds_.push_back({item, square_of_[static_cast<std::size_t>(item)]});
    }
  }
  areas_.assign(cells_, 0.0);
  centroids_.assign(cells_, {0.0, 0.0});
  for (const RawEdge& edge : edges_) {
    const AreaIntegrals part = triangle_integrals(edge.start, edge.end);
    const auto add = [&](std::int32_t side, double sign) {
      if (side < 0) return;
      const std::size_t cell = label_of(side);
      areas_[cell] += sign * part.area;
      centroids_[cell].x += sign * part.x, centroids_[cell].y += sign * part.y;
    };
    add(edge.left, 1.0);
    add(edge.right, -1.0);
  }
  for (std::size_t i = 0; i < cells_; ++i) centroids_[i] = {centroids_[i].x / areas_[i], centroids_[i].y / areas_[i]};
}

std::size_t FaceCells::label_of(std::int32_t item) {
  return static_cast<std::size_t>(label_[static_cast<std::size_t>(sets_.root(item))]);
}

// A hole inside a square has no edge in common with the lattice, so its chain is not joined with another item. Give it
// to the largest cell of the square.
void FaceCells::join_parts_of_squares() {
  const double square = size_ * size_;
  bool joined = false;
  for (std::size_t hole = 0; hole < cells_; ++hole) {
    if (!(areas_[hole] < -kNoArea * square) || kinds_[hole].square < 0) continue;
    std::size_t largest = hole;
    for (std::size_t i = 0; i < cells_; ++i) {
      if (kinds_[i].square == kinds_[hole].square && areas_[i] > areas_[largest]) largest = i;
    }
    if (largest == hole) continue;
    sets_.join(kinds_[hole].item, kinds_[largest].item);
    joined = true;
  }
  if (joined) label_cells();
}

// Join cells that are too small to the neighbour with which they share the longest edges.
void FaceCells::join_slivers() {
  const double square = extent_[0] / static_cast<double>(columns_) * extent_[1] / static_cast<double>(rows_);
  for (int round = 0; round < kJoins; ++round) {
    const auto least = [&](std::size_t i) {
      return kinds_[i].square >= 0 ? kSliver * square : kNoPiece * width_ * size_;
    };
    bool any = false;
    for (std::size_t i = 0; i < cells_; ++i) any = any || areas_[i] < least(i);
    if (!any) return;
    shared_.clear();
    for (const RawEdge& edge : edges_) {
      if (edge.left < 0 || edge.right < 0) continue;
      const std::size_t left = label_of(edge.left), right = label_of(edge.right);
      if (left == right) continue;
      const double length = distance(edge.start, edge.end);
      if (areas_[left] < least(left)) shared_.push_back({left, right, length});
      if (areas_[right] < least(right)) shared_.push_back({right, left, length});
    }
    std::sort(shared_.begin(), shared_.end(), [](const Shared& a, const Shared& b) {
      return a.cell != b.cell ? a.cell < b.cell : a.neighbour < b.neighbour;
    });
    bool joined = false;
    for (std::size_t i = 0; i < shared_.size();) {
      const std::size_t cell = shared_[i].cell;
      // Parts of squares prefer squares; pieces of a ring join any neighbour.
      double best[2] = {0.0, 0.0}, second[2] = {0.0, 0.0};
      std::size_t found[2] = {cell, cell};
      while (i < shared_.size() && shared_[i].cell == cell) {
        const std::size_t neighbour = shared_[i].neighbour;
        double length = 0.0;
        for (; i < shared_.size() && shared_[i].cell == cell && shared_[i].neighbour == neighbour; ++i) {
          length += shared_[i].length;
        }
        const int kind = kinds_[neighbour].square >= 0 || kinds_[cell].square < 0 ? 0 : 1;
        if (length > best[kind]) {
          second[kind] = best[kind];
          best[kind] = length;
          found[kind] = neighbour;
        } else {
          second[kind] = std::max(second[kind], length);
        }
      }
      const int kind = best[0] > 0.0 ? 0 : 1;
      if (found[kind] == cell) continue;
      // If two neighbours share equally long edges, the cell stays, so that symmetric outlines have symmetric cells.
      if (second[kind] > (1.0 - kTie) * best[kind] && areas_[cell] > kNoSquare * square) continue;
      sets_.join(kinds_[cell].item, kinds_[found[kind]].item);
      joined = true;
    }
    if (!joined) return;
    label_cells();
  }
}

// Quadrature points lie on a cell's principal axes of inertia. If a cell has none, the face's axes are used.
void FaceCells::place_quadrature(Face& face) {
  about_centroid_.assign(cells_, {});
  for (const CellEdge& edge : face.edges) {
    const auto add = [&](std::int32_t side, double sign) {
      if (side < 0) return;
      const auto cell = static_cast<std::size_t>(side);
      const Point& middle = face.centroids[cell];
      about_centroid_[cell].add(triangle_integrals({edge.start[0] - middle.x, edge.start[1] - middle.y},
                                                   {edge.end[0] - middle.x, edge.end[1] - middle.y}),
                                sign);
    };
    add(edge.left, 1.0);
    add(edge.right, -1.0);
  }
  face.quadrature.clear();
  for (std::size_t i = 0; i < cells_; ++i) {
    const AreaIntegrals& own = about_centroid_[i];
    const double xx = own.xx / areas_[i], xy = own.xy / areas_[i], yy = own.yy / areas_[i];
    const double mean = (xx + yy) / 2, apart = std::hypot((xx - yy) / 2, xy);
    const double turn = apart > kRound * mean ? 0.5 * std::atan2(2.0 * xy, xx - yy) : 0.0;
    const double u = std::cos(turn), v = std::sin(turn);
    const double longer = std::sqrt(2 * (mean + apart)), shorter = std::sqrt(2 * std::max(mean - apart, 0.0));
    add_quadrature(face.centroids[i], {u, v}, longer, shorter, face.quadrature);
  }
}

// Replace items by cell numbers in the edges, remove edges within a cell, and merge straight edges.
void FaceCells::finish() {
  std::size_t used = 0;
  const double extent = std::max(extent_[0], extent_[1]);
  for (const RawEdge& edge : edges_) {
    const std::int32_t left = edge.left < 0 ? -1 : static_cast<std::int32_t>(label_of(edge.left));
    const std::int32_t right = edge.right < 0 ? -1 : static_cast<std::int32_t>(label_of(edge.right));
    if (left == right) continue;
    if (used > 0) {
      RawEdge& last = edges_[used - 1];
      if (last.left == left && last.right == right && last.end.x == edge.start.x && last.end.y == edge.start.y &&
          std::abs(left_of(last.start, last.end, edge.end)) <= kStraight * extent * distance(last.start, edge.end)) {
        last.end = edge.end;
        continue;
      }
    }
    edges_[used++] = {edge.start, edge.end, left, right};
  }
  edges_.resize(used);
}

}  // namespace mjtactile
