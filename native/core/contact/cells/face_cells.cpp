#include "contact/cells/face_cells.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "linalg/angles.hpp"

namespace mjtactile {
namespace {

constexpr std::size_t kMostCells = 4000;
// Outlines with more corners are simplified, with a tolerance relative to the size of a cell.
constexpr std::size_t kMostCorners = 400;
constexpr double kSimplified = 1e-3;
// Most cells that a face gets so that they are no wider than wanted. A face that moves takes about twice as long with
// so many as with 20. With 600 it would take twenty times as long.
constexpr double kMostForWidth = 200.0;
// A face gets more cells if the square of its rim's length over its area is more than kSlender times that of a square,
// in proportion to it, up to this number.
constexpr double kSlender = 3.0, kMostForRim = 30.0;
// There are two rings if at least this fraction of the cells is left for the squares.
constexpr double kEnoughInside = 0.25;
// Number of layouts tried for the wanted number of cells. A layout is accepted if the logarithm of its number over the
// wanted one is at most kClose.
constexpr int kAttempts = 7;
constexpr double kClose = 0.1;
// Rounding errors of distances over the outline's extent, and of areas over its square.
constexpr double kStraight = 1e-13, kNoArea = 1e-12, kOnLine = 1e-13;
// Parts of squares below this fraction of a whole square are joined to a neighbour.
constexpr double kSliver = 0.35;
// Pieces of a ring below this fraction of a whole piece are joined to a neighbour.
constexpr double kNoPiece = 1e-2;
// So are parts of squares below this fraction of a square, even if two neighbours share equally long edges with them.
// Larger ones would make symmetric outlines' cells one-sided.
constexpr double kNoSquare = 1e-6;
constexpr int kJoins = 4;   // rounds of joining
// Lengths that differ by less than this fraction count as equal.
constexpr double kTie = 1e-6;
// An outline counts as convex if its hull's area is at most this times its own.
constexpr double kConvex = 1.0 + 1e-6;
// A cell whose principal second moments differ by less than this fraction has no principal axes.
constexpr double kRound = 1e-9;

// Coordinates of lines that divide an extent about 0 into equal intervals.
void divide(double extent, std::size_t count, std::vector<double>& lines) {
  lines.resize(count + 1);
  for (std::size_t i = 0; i <= count; ++i) {
    lines[i] = (static_cast<double>(i) - static_cast<double>(count) / 2) * (extent / static_cast<double>(count));
  }
}

// The interval between lines that holds a coordinate; the first or the last one for coordinates beside all of them.
std::size_t interval(const std::vector<double>& lines, double at) {
  const std::size_t count = lines.size() - 1;
  const double guess = (at - lines[0]) / (lines[count] - lines[0]) * static_cast<double>(count);
  std::size_t place = guess > 0.0 ? std::min(static_cast<std::size_t>(guess), count - 1) : 0;
  while (place > 0 && !(at > lines[place])) --place;
  while (place + 1 < count && at > lines[place + 1]) ++place;
  return place;
}

}  // namespace

bool FaceCells::make(const Outline& outline, const CellCount& asked, Face& face, double angle) {
  if (!outline_.set(outline, angle)) return false;
  const double area = outline_.area();
  auto count = static_cast<double>(std::max(asked.count, std::size_t{1}));
  if (asked.widest > 0.0) count = std::max(count, std::min(area / (asked.widest * asked.widest), kMostForWidth));
  // Thin frames have much rim and little area. The star is the most slender of the seven punches, with 2.9.
  const double slender = outline_.length() * outline_.length() / (16.0 * area);
  count = std::max(count, std::min(count * slender / kSlender, kMostForRim));
  // Each piece of a face has its own rim.
  count *= std::sqrt(static_cast<double>(outline_.outer_loops()));
  const double wanted = std::min(count, static_cast<double>(kMostCells));
  if (outline_.corners() > kMostCorners) outline_.simplify(kSimplified * std::sqrt(area / wanted));
  // Squares of size h: about area / h^2 of them inside, and length / h pieces in each ring.
  const auto size_with = [&](double rings) {
    const double along = rings * outline_.length();
    return (along + std::sqrt(along * along + 4 * wanted * area)) / (2 * wanted);
  };
  const double finer = size_with(2.0);
  const bool two = area >= kEnoughInside * wanted * finer * finer;
  const double size = two ? finer : size_with(1.0);
  if (!(fit(size, wanted, two ? kTwoRings : kOneRing) && integrate(face)) &&
      !(fit(size, wanted, kNoRing) && integrate(face))) {
    return false;
  }
  describe(face);
  return true;
}

// Find the size of squares that gives about the wanted number of cells.
bool FaceCells::fit(double size, double wanted, const RingLayers& layers) {
  double best = 0.0, least = INFINITY;    // size with the least error so far, and this error
  double few = INFINITY, many = 0.0;      // sizes that give too few cells and too many
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::size_t cells = lay_out(size, layers);
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
  return lay_out(best, layers) > 0;
}

std::size_t FaceCells::lay_out(double size, const RingLayers& layers) {
  size_ = size;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double extent = axis == 0 ? outline_.width() : outline_.height();
    squares_[axis] = pieces_of(extent, size_);
    divide(extent, squares_[axis], lines_[axis]);
  }
  rings_.lay(outline_, size, layers);
  // Points that are on a line up to rounding are moved exactly onto it, so that no tiny edges remain.
  rings_.move_inner_side([this](Point& point) { snap(point); });
  edges_.clear();
  rings_.add_edges(edges_, inner_);
  for (std::vector<InnerPoint>& loop : inner_) {
    for (InnerPoint& point : loop) snap(point.at);
  }
  cut_at_lattice();
  label_cells();
  join_parts_of_squares();
  join_slivers();
  const double least = kNoArea * outline_.area();
  for (std::size_t i = 0; i < cells_; ++i) {
    if (!(areas_[i] > least)) return 0;
  }
  merge_edges();
  return cells_;
}

void FaceCells::snap(Point& point) const {
  const double near = kOnLine * outline_.extent();
  for (std::size_t axis = 0; axis < 2; ++axis) {
    double& to = coordinate(point, axis);
    const std::size_t place = interval(lines_[axis], to);
    for (const std::size_t line : {place, place + 1}) {
      if (std::abs(lines_[axis][line] - to) <= near) to = lines_[axis][line];
    }
  }
}

// Cut the area within the rings along the lattice. Each connected part of a square becomes a cell.
void FaceCells::cut_at_lattice() {
  // Items after those of the rings: the corners of all squares; follow_loop() adds chains of edges.
  const auto pieces = static_cast<std::size_t>(rings_.pieces());
  const std::size_t items = pieces + 4 * squares_[0] * squares_[1];
  square_of_.assign(items, -1);
  for (std::size_t i = pieces; i < items; ++i) square_of_[i] = static_cast<std::int32_t>((i - pieces) / 4);
  sets_.reset(items);
  for (std::vector<Crossing>& one : crossings_) one.clear();
  for (const std::vector<InnerPoint>& loop : inner_) follow_loop(loop);
  for (std::size_t axis = 0; axis < 2; ++axis) add_lines(axis);
}

std::int32_t FaceCells::new_chain(const std::size_t square[2]) {
  square_of_.push_back(static_cast<std::int32_t>(square[1] * squares_[0] + square[0]));
  return sets_.add();
}

// Follow a loop from square to square. Adds its edges, with one chain per stay in a square, and its crossings.
void FaceCells::follow_loop(const std::vector<InnerPoint>& loop) {
  if (loop.empty()) return;
  Point at = loop[0].at;
  std::size_t square[2] = {interval(lines_[0], at.x), interval(lines_[1], at.y)};
  const std::int32_t begun = new_chain(square);
  std::int32_t chain = begun;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Point &a = loop[i].at, &b = loop[i + 1 < loop.size() ? i + 1 : 0].at;
    const std::size_t to[2] = {interval(lines_[0], b.x), interval(lines_[1], b.y)};
    const std::int32_t right = loop[i].right;
    while (square[0] != to[0] || square[1] != to[1]) {
      // The next line along each axis, and the part of the edge up to it.
      std::size_t line[2];
      double part[2];
      for (std::size_t k = 0; k < 2; ++k) {
        const double from = coordinate(a, k);
        line[k] = to[k] > square[k] ? square[k] + 1 : square[k];
        part[k] = square[k] != to[k] ? (lines_[k][line[k]] - from) / (coordinate(b, k) - from) : INFINITY;
      }
      const std::size_t axis = part[0] <= part[1] ? 0 : 1, other = 1 - axis;
      Point next = b;
      double& along = coordinate(next, other);
      if (part[axis] < 1.0) {
        coordinate(next, axis) = lines_[axis][line[axis]];
        along = coordinate(a, other) + part[axis] * (along - coordinate(a, other));
      }
      snap(next);
      const std::size_t place = square[other];
      if (place > 0) along = std::max(along, lines_[other][place]);
      if (place + 1 < squares_[other]) along = std::min(along, lines_[other][place + 1]);
      add_edge({at, next, chain, right}, edges_);
      const bool up = to[axis] > square[axis];
      const std::int32_t before = chain;
      square[axis] = up ? square[axis] + 1 : square[axis] - 1;
      chain = new_chain(square);
      crossings_[axis].push_back({static_cast<std::uint32_t>(line[axis]), static_cast<std::uint32_t>(place), along,
                                  up == (axis == 0) ? 1 : -1, up ? before : chain, up ? chain : before});
      at = next;
    }
    add_edge({at, b, chain, right}, edges_);
    at = b;
  }
  sets_.join(begun, chain);
}

// Add the lattice's own edges: along its lines, between crossings with the loops, where the area is inside. `axis`: the
// coordinate that is constant along the lines.
void FaceCells::add_lines(std::size_t axis) {
  std::vector<Crossing>& crossings = crossings_[axis];
  const bool upright = axis == 0;
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return a.line != b.line ? a.line < b.line : a.place != b.place ? a.place < b.place : a.at < b.at;
  });
  const std::vector<double> &lines = lines_[axis], &across = lines_[1 - axis];
  const auto corner = [&](std::size_t line, std::size_t place, bool high_side, bool high_end) {
    const std::size_t beside = high_side ? line : line - 1;
    const std::size_t square = upright ? place * squares_[0] + beside : beside * squares_[0] + place;
    // A square's corners are numbered by two bits: 1 for the higher x, 2 for the higher y.
    const bool x = upright ? !high_side : high_end, y = upright ? high_end : !high_side;
    return rings_.pieces() + static_cast<std::int32_t>(4 * square + (x ? 1 : 0) + (y ? 2 : 0));
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
          add_edge({point(line, from), point(line, to), low_left ? low : high, low_left ? high : low}, edges_);
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
  for (const CellEdge& edge : edges_) {
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
  for (const CellEdge& edge : edges_) {
    const AreaIntegrals part = triangle_integrals(edge.start, edge.end);
    each_side(edge, [&](std::size_t item, double sign) {
      const std::size_t cell = label_of(static_cast<std::int32_t>(item));
      areas_[cell] += sign * part.area;
      centroids_[cell].x += sign * part.x, centroids_[cell].y += sign * part.y;
    });
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
  const double columns = static_cast<double>(squares_[0]), rows = static_cast<double>(squares_[1]);
  const double square = outline_.width() / columns * outline_.height() / rows;
  for (int round = 0; round < kJoins; ++round) {
    const auto least = [&](std::size_t i) {
      return kinds_[i].square >= 0 ? kSliver * square : kNoPiece * rings_.width() * size_;
    };
    bool any = false;
    for (std::size_t i = 0; i < cells_; ++i) any = any || areas_[i] < least(i);
    if (!any) return;
    shared_.clear();
    for (const CellEdge& edge : edges_) {
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

// Replace items by cell numbers in the edges, remove edges within a cell, and merge straight edges.
void FaceCells::merge_edges() {
  std::size_t used = 0;
  const double extent = outline_.extent();
  for (const CellEdge& edge : edges_) {
    const std::int32_t left = edge.left < 0 ? -1 : static_cast<std::int32_t>(label_of(edge.left));
    const std::int32_t right = edge.right < 0 ? -1 : static_cast<std::int32_t>(label_of(edge.right));
    if (left == right) continue;
    if (used > 0) {
      CellEdge& last = edges_[used - 1];
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

// Set the face's edges and their integrals, about the middle, where rounding is least. False if a cell is too thin:
// cancellation then leaves its integral no digits.
bool FaceCells::integrate(Face& face) {
  face.edges = edges_;
  integrals_.inverse_distance(face.edges, cells_, face.inverse_distance);
  for (std::size_t i = 0; i < cells_; ++i) {
    if (!(face.inverse_distance[i * cells_ + i] > 0.0)) return false;
  }
  return true;
}

// Move the edges to the face's frame, and set all else there.
void FaceCells::describe(Face& face) {
  for (CellEdge& edge : face.edges) edge.start = outline_.placed(edge.start), edge.end = outline_.placed(edge.end);
  face.areas = areas_;
  face.centroids.clear();
  for (const Point& centroid : centroids_) face.centroids.push_back(outline_.placed(centroid));
  double area = 0.0;
  for (const double part : areas_) area += part;
  face.length = std::sqrt(area);
  std::vector<Point> corners;
  for (const std::vector<Point>& loop : outline_.loops()) {
    for (const Point& corner : loop) corners.push_back(outline_.placed(corner));
  }
  face.corners = convex_hull(std::move(corners));
  face.hull = convex_hull(face.centroids);
  face.convex = signed_area(face.corners) <= kConvex * face.length * face.length;
  place_quadrature(face);
}

// Quadrature points lie on a cell's principal axes of inertia. If a cell has none, the face's axes are used.
void FaceCells::place_quadrature(Face& face) {
  about_centroid_.assign(cells_, {});
  for (const CellEdge& edge : face.edges) {
    each_side(edge, [&](std::size_t cell, double sign) {
      const Point& middle = face.centroids[cell];
      about_centroid_[cell].add(triangle_integrals({edge.start.x - middle.x, edge.start.y - middle.y},
                                                   {edge.end.x - middle.x, edge.end.y - middle.y}),
                                sign);
    });
  }
  face.quadrature.clear();
  for (std::size_t i = 0; i < cells_; ++i) {
    const AreaIntegrals& own = about_centroid_[i];
    const double xx = own.xx / areas_[i], xy = own.xy / areas_[i], yy = own.yy / areas_[i];
    const double mean = (xx + yy) / 2, apart = std::hypot((xx - yy) / 2, xy);
    const double turn = apart > kRound * mean ? principal_angle(xx, xy, yy) : 0.0;
    const double u = std::cos(turn), v = std::sin(turn);
    const double longer = std::sqrt(2 * (mean + apart)), shorter = std::sqrt(2 * std::max(mean - apart, 0.0));
    add_quadrature(face.centroids[i], {u, v}, longer, shorter, face.quadrature);
  }
}

}  // namespace mjtactile
