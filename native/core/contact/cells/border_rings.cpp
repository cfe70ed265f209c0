#include "contact/cells/border_rings.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// Edges of the outline longer than this, over the length of a piece, are divided on their own. Runs of shorter edges
// are divided as one curve.
constexpr double kLongEdge = 0.5;
// Cuts nearer than this to a corner, over the length of a piece, are moved to the corner.
constexpr double kSnap = 0.1;
// Round loops shorter than this, over the length of a piece, have a ring of one piece.
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

// Whether the bounds of two segments, a b and c d, have no point in common.
bool apart(const Point& a, const Point& b, const Point& c, const Point& d) {
  return std::max(a.x, b.x) < std::min(c.x, d.x) || std::max(c.x, d.x) < std::min(a.x, b.x) ||
         std::max(a.y, b.y) < std::min(c.y, d.y) || std::max(c.y, d.y) < std::min(a.y, b.y);
}

bool crossing(const Point& a, const Point& b, const Point& c, const Point& d) {
  if (apart(a, b, c, d)) return false;
  return left_of(a, b, c) * left_of(a, b, d) < 0.0 && left_of(c, d, a) * left_of(c, d, b) < 0.0;
}

}  // namespace

std::size_t pieces_of(double length, double size) {
  return static_cast<std::size_t>(std::max(1.0, std::round(length / size)));
}

void BorderRings::lay(const OutlineLoops& outline, double size, const RingLayers& layers) {
  size_ = size, width_ = layers.width * size, extent_ = outline.extent();
  layers_ = layers;
  pieces_ = 0;
  borders_.resize(outline.loops().size());
  for (std::size_t k = 0; k < borders_.size(); ++k) {
    walk(outline.loops()[k], borders_[k]);
    keep(borders_[k]);
  }
  if (width_ > 0.0) {
    bound_shares();
    mend_inner_side();
  }
}

// Divide a loop into pieces.
void BorderRings::walk(const std::vector<Point>& loop, Border& border) {
  const std::size_t count = loop.size();
  lengths_.resize(count);
  cuts_.clear();
  double length = 0.0;
  std::size_t any_long = count;
  for (std::size_t i = 0; i < count; ++i) {
    lengths_[i] = distance(loop[i], loop[(i + 1) % count]);
    length += lengths_[i];
    if (is_long(i) && any_long == count) any_long = i;
  }
  if (width_ > 0.0 && any_long == count) cut_round_loop(loop, length);
  if (width_ > 0.0 && any_long < count) cut_edges(any_long);
  std::sort(cuts_.begin(), cuts_.end(), [](const Cut& a, const Cut& b) {
    return a.edge < b.edge || (a.edge == b.edge && a.along < b.along);
  });
  const std::int32_t stations = add_walk(loop, border.walk);
  std::int32_t passed = 0;
  for (WalkPoint& point : border.walk) {
    if (point.station) ++passed;
    point.piece = pieces_ + (stations > 0 ? (passed + stations - 1) % stations : 0);
  }
  pieces_ += std::max(stations, std::int32_t{1});
}

bool BorderRings::is_long(std::size_t edge) const { return lengths_[edge] > kLongEdge * size_; }

// Cut each long edge into equal pieces, and each run of short edges between two long ones. `begin`: a long edge.
void BorderRings::cut_edges(std::size_t begin) {
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

// Cut a loop without long edges into pieces. Anchors are its extreme points along the axes, so that symmetric loops
// have symmetric pieces. Pieces between two anchors are equal.
void BorderRings::cut_round_loop(const std::vector<Point>& loop, double length) {
  if (length < kOnePiece * size_) return;
  const std::size_t count = loop.size();
  anchors_.clear();
  for (int side = 0; side < 4; ++side) {
    const auto reach = [&](std::size_t i) {
      return (side % 2 == 0 ? 1.0 : -1.0) * (side < 2 ? loop[i].x : loop[i].y);
    };
    double most = -INFINITY;
    for (std::size_t i = 0; i < count; ++i) most = std::max(most, reach(i));
    const auto farthest = [&](std::size_t i) { return reach(i) >= most - kTie * extent_; };
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

// Add a cut at a distance along the outline from an edge's start [m], or at a corner close to it.
void BorderRings::add_cut(std::size_t edge, double along) {
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

// Set a walk to a loop's corners and cuts, in order. Returns the number of stations among them.
std::int32_t BorderRings::add_walk(const std::vector<Point>& loop, std::vector<WalkPoint>& walk) const {
  const std::size_t count = loop.size();
  std::size_t next = 0;
  std::int32_t stations = 0;
  walk.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const Point &a = loop[i], &b = loop[(i + 1) % count];
    walk.push_back({a, false, 0});
    for (; next < cuts_.size() && cuts_[next].edge == i; ++next) {
      if (cuts_[next].along > 0.0) {
        if (next > 0 && cuts_[next - 1].edge == i && !(cuts_[next].along > cuts_[next - 1].along)) continue;
        walk.push_back({between(a, b, cuts_[next].along / lengths_[i]), false, 0});
      } else if (walk.back().station) {
        continue;
      }
      walk.back().station = true;
      ++stations;
    }
  }
  return stations;
}

// Choose the corners of the inner side: all stations, and what is needed between them.
void BorderRings::keep(Border& border) {
  const std::size_t count = border.walk.size();
  points_.clear();
  for (const WalkPoint& point : border.walk) points_.push_back(point.at);
  marks_.assign(count, 0);
  std::size_t first = count, before = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!border.walk[i].station) continue;
    marks_[i] = 1;
    if (first == count) {
      first = i;
    } else {
      keep_corners(points_, before, i, kSmooth * width_, marks_);
    }
    before = i;
  }
  if (first < count) keep_corners(points_, before, first + count, kSmooth * width_, marks_);
  const bool all = std::count(marks_.begin(), marks_.end(), 1) < 3;
  border.kept.clear();
  for (std::size_t i = 0; i < count; ++i) {
    if (!all && !marks_[i]) continue;
    const Point& at = points_[i];
    border.kept.push_back({at, {0.0, 0.0}, at, width_ > 0.0 ? 1.0 : 0.0, i, false, false, false});
  }
  if (width_ > 0.0) direct_inward(border.kept);
}

// Set the inward vectors of a loop's kept points: mitre joints of limited length.
void BorderRings::direct_inward(std::vector<KeptPoint>& kept) const {
  const std::size_t count = kept.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Point &before = kept[(k + count - 1) % count].at, &after = kept[(k + 1) % count].at;
    KeptPoint& own = kept[k];
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

void BorderRings::set_inner(KeptPoint& point) const {
  point.swallowed = false;
  point.inner = {point.at.x + point.share * width_ * point.inward.x,
                 point.at.y + point.share * width_ * point.inward.y};
}

// Make the rings narrower where the opposite side of the outline is near.
void BorderRings::bound_shares() {
  for (Border& border : borders_) {
    for (KeptPoint& own : border.kept) {
      const double share = bound_share(own);
      own.share = share >= kLeastShare ? share : 0.0;
      set_inner(own);
    }
  }
}

// The part of a distance inward that is free of other edges. Wider rings than that would be too near to them.
double BorderRings::bound_share(const KeptPoint& own) const {
  const Point far = {own.at.x + width_ / kMostWidth * own.inward.x, own.at.y + width_ / kMostWidth * own.inward.y};
  double share = 1.0;
  for (const Border& border : borders_) {
    for (std::size_t i = 0; i < border.kept.size(); ++i) {
      const KeptPoint &start = border.kept[i], &end = border.kept[i + 1 < border.kept.size() ? i + 1 : 0];
      if (&start == &own || &end == &own) continue;
      const Point &a = start.at, &b = end.at;
      if (apart(own.at, far, a, b)) continue;
      const double from = left_of(own.at, far, a), to = left_of(own.at, far, b);
      if (from * to > 0.0 || from == to) continue;
      const double here = left_of(a, b, own.at), there = left_of(a, b, far);
      if (here * there >= 0.0) continue;
      share = std::min(share, here / (here - there));
    }
  }
  return share;
}

void BorderRings::mend_inner_side() {
  for (int round = 0; round < kMends; ++round) {
    bool mended = false;
    for (Border& border : borders_) mended = turn_forward(border.kept) || mended;
    if (uncross(round + 1 == kMends)) mended = true;
    if (!mended) return;
  }
}

// Repair edges of the inner side that point opposite to their edges of the outline. Each run of them is merged into one
// point, or the ring becomes narrower there. Returns whether anything was changed.
bool BorderRings::turn_forward(std::vector<KeptPoint>& kept) const {
  const std::size_t count = kept.size();
  const auto at = [&](std::size_t k) -> KeptPoint& { return kept[k % count]; };
  std::size_t forward = count;
  for (std::size_t k = 0; k < count; ++k) {
    KeptPoint& a = at(k);
    const KeptPoint& b = at(k + 1);
    const double x = b.at.x - a.at.x, y = b.at.y - a.at.y;
    const double along = (b.inner.x - a.inner.x) * x + (b.inner.y - a.inner.y) * y;
    const bool done = (a.share == 0.0 && b.share == 0.0) || (a.inner.x == b.inner.x && a.inner.y == b.inner.y);
    a.backward = !done && !(along > kTie * (x * x + y * y));
    if (!a.backward) forward = k;
  }
  if (forward == count) {
    for (KeptPoint& point : kept) shrink(point);
    return true;
  }
  bool mended = false;
  for (std::size_t step = 1; step < count; ++step) {
    const std::size_t first = forward + step;
    std::size_t last = first;  // last point of the run
    while (at(last).backward) ++last;
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

// Make the rings narrower where their inner side crosses itself. In the last round their width becomes zero there.
// Returns whether there was a crossing. All crossings are found before a point is moved, so that their order does not
// matter.
bool BorderRings::uncross(bool last) {
  for (std::size_t first = 0; first < borders_.size(); ++first) {
    std::vector<KeptPoint>& kept = borders_[first].kept;
    for (std::size_t k = 0; k < kept.size(); ++k) {
      KeptPoint &own = kept[k], &after = kept[k + 1 < kept.size() ? k + 1 : 0];
      for (std::size_t second = first; second < borders_.size(); ++second) {
        std::vector<KeptPoint>& others = borders_[second].kept;
        for (std::size_t i = second == first ? k + 1 : 0; i < others.size(); ++i) {
          KeptPoint &other = others[i], &next = others[i + 1 < others.size() ? i + 1 : 0];
          if (&other == &after || &next == &own) continue;
          if (!crossing(own.inner, after.inner, other.inner, next.inner)) continue;
          own.crossed = after.crossed = other.crossed = next.crossed = true;
        }
      }
    }
  }
  bool found = false;
  for (Border& border : borders_) {
    for (KeptPoint& point : border.kept) {
      if (!point.crossed) continue;
      found = true;
      point.crossed = false;
      if (last) point.share = 0.0;
      shrink(point);
    }
  }
  return found;
}

void BorderRings::shrink(KeptPoint& point) const {
  point.share = point.share > kLeastShare ? point.share / 2 : 0.0;
  set_inner(point);
}

void BorderRings::add_edges(std::vector<CellEdge>& edges, std::vector<std::vector<InnerPoint>>& inner) const {
  inner.resize(borders_.size());
  for (std::size_t k = 0; k < borders_.size(); ++k) add_edges(borders_[k], edges, inner[k]);
}

void BorderRings::add_edges(const Border& border, std::vector<CellEdge>& edges, std::vector<InnerPoint>& inner) const {
  const std::vector<WalkPoint>& walk = border.walk;
  const auto layer = [this](const KeptPoint& point, std::size_t number) {
    if (number == 0) return point.at;
    return number == layers_.count ? point.inner : between(point.at, point.inner, layers_.ends[number - 1]);
  };
  inner.clear();
  for (std::size_t k = 0; k < border.kept.size(); ++k) {
    const KeptPoint &own = border.kept[k], &after = border.kept[k + 1 < border.kept.size() ? k + 1 : 0];
    const bool ring = own.share > 0.0 || after.share > 0.0;
    const std::int32_t piece = walk[own.walk].piece;
    for (std::size_t i = own.walk; ;) {
      const std::size_t next = i + 1 < walk.size() ? i + 1 : 0;
      if (ring) {
        add_edge({walk[i].at, walk[next].at, piece, -1}, edges);
      } else {
        inner.push_back({walk[i].at, -1});
      }
      i = next;
      if (i == after.walk) break;
    }
    const std::int32_t before = walk[own.walk > 0 ? own.walk - 1 : walk.size() - 1].piece;
    for (std::size_t number = 0; number < layers_.count; ++number) {
      const std::int32_t ring_before = static_cast<std::int32_t>(number) * pieces_;
      if (walk[own.walk].station && own.share > 0.0) {
        add_edge({layer(own, number), layer(own, number + 1), before + ring_before, piece + ring_before}, edges);
      }
      if (number > 0 && ring) {
        add_edge({layer(own, number), layer(after, number), piece + ring_before, piece + ring_before - pieces_}, edges);
      }
    }
    if (ring) inner.push_back({own.inner, piece + static_cast<std::int32_t>(layers_.count - 1) * pieces_});
  }
}

}  // namespace mjtactile
