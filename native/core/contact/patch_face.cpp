#include "contact/patch_face.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/dense.hpp"
#include "linalg/kernels.hpp"

namespace mjtactile {
namespace {

// Cells of which the body covers less than this fraction are left out.
constexpr double kLeastShare = 1e-3;
// So are parts that are not wider than this (standard deviation over a cell's size).
constexpr double kLeastWidth = 1e-4;
// The covered part of a cell is found on lines at Gauss points, with so many steps along a line and bisections.
constexpr double kLines[3] = {-0.38729833462074168852, 0.0, 0.38729833462074168852};
constexpr double kWeights[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
constexpr int kSteps = 4, kBisections = 6;
// Number of steps, from a region's sides inward, in which the end of the body is searched.
constexpr int kTrimSteps = 8;
// Positions of the lines along a region on which this search runs, over the region's breadth.
constexpr double kTrimLines[] = {0.0, -0.25, 0.25, -0.45, 0.45};
// Rectangles of parts whose variances have at least this ratio are turned along the part's length.
constexpr double kSlanted = 2.25;
// A lattice grows if the body continues at this distance beyond it, over the size of a cell, at most kGrowths times.
constexpr double kBeyond = 0.25;
constexpr std::size_t kGrowths = 12;
// Two regions are of unlike size if the area of the smaller is less than this fraction of the other's.
constexpr double kUnlike = 0.5;
// Cells longer than this, over the compliance's resolution, have quadrature points.
constexpr double kSpread = 1.0;
// A rectangle may exceed the room up to the sheet's edge by this fraction, because rounding must not decide whether one
// that ends there is beyond it.
constexpr double kFlush = 1e-9;

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

// Rise per step through three points at equal distances, from the last one to the first one; 0 if only one of them is
// finite. The middle one counts if another is not finite.
double slope_between(double first, double middle, double last) {
  if (std::isfinite(first) && std::isfinite(last)) return (first - last) / 2.0;
  const double beside = std::isfinite(first) ? first - middle : middle - last;
  return std::isfinite(beside) ? beside : 0.0;
}

// Height over a point as measured from the view's plane [m].
double seen_from(const PatchFace::HeightWindow& view, const Point& at, double height) {
  return height - view.slopes[0] * (at.x - view.middle.x) - view.slopes[1] * (at.y - view.middle.y) - view.lowest;
}

}  // namespace

void PatchFace::clear() {
  lattices_.clear();
  firsts_.clear();
  first_nodes_.clear();
  places_.clear();
  nodes_.clear();
  sounded_ = 0;
  clear_cells();
}

void PatchFace::clear_cells() {
  cells_.clear();
  heights_.clear();
  gradients_.clear();
  goes_on_.clear();
  face_.centroids.clear();
  face_.areas.clear();
  face_.edges.clear();
}

double PatchFace::seen(const HeightWindow& view, const Point& at) const {
  return seen_from(view, at, view.map->height(at.x, at.y));
}

// The order of regions must not decide between equal parts of a body, because it changes as the body turns.
bool PatchFace::Territory::lost(const Point& at) const {
  const Region& here = regions[own];
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const Region& other = regions[i];
    if (i == own || !other.holds(at)) continue;
    const double ratio = other.area() / here.area();
    if (ratio < kUnlike || (ratio <= 1.0 / kUnlike && other.away(at) < here.away(at))) return true;
  }
  return false;
}

// Add rows and columns of cells on the sides where the body continues beyond the lattice.
void PatchFace::grow(const HeightWindow& view, const Territory& territory, Lattice& lattice) const {
  const auto counts = [&](double column, double row) {
    const Point at = lattice.at(column, row);
    return seen(view, at) <= view.highest && !territory.lost(at);
  };
  for (std::size_t growth = 0; growth < kGrowths; ++growth) {
    const auto columns = static_cast<double>(lattice.columns), rows = static_cast<double>(lattice.rows);
    bool beyond[4] = {};   // west, east, south, north
    for (double row = 0.5; row < rows; ++row) {
      beyond[0] = beyond[0] || (counts(-kBeyond, row) && counts(0.5, row));
      beyond[1] = beyond[1] || (counts(columns + kBeyond, row) && counts(columns - 0.5, row));
    }
    for (double column = 0.5; column < columns; ++column) {
      beyond[2] = beyond[2] || (counts(column, -kBeyond) && counts(column, 0.5));
      beyond[3] = beyond[3] || (counts(column, rows + kBeyond) && counts(column, rows - 0.5));
    }
    if (!beyond[0] && !beyond[1] && !beyond[2] && !beyond[3]) return;
    // The new middle, in coordinates of the old lattice.
    const double along = (columns + (beyond[1] ? 1.0 : 0.0) - (beyond[0] ? 1.0 : 0.0)) / 2;
    const double across = (rows + (beyond[3] ? 1.0 : 0.0) - (beyond[2] ? 1.0 : 0.0)) / 2;
    const Point centre = lattice.at(along, across);
    lattice.columns += (beyond[0] ? 1u : 0u) + (beyond[1] ? 1u : 0u);
    lattice.rows += (beyond[2] ? 1u : 0u) + (beyond[3] ? 1u : 0u);
    lattice.centre = centre;
  }
}

void PatchFace::sound(Lattice lattice, const HeightWindow& view, const Territory& territory) {
  grow(view, territory, lattice);
  const std::size_t across = 2 * lattice.columns + 1, first = nodes_.size();
  lattices_.push_back(lattice);
  first_nodes_.push_back(first);
  firsts_.push_back(places_.size());
  nodes_.resize(first + across * (2 * lattice.rows + 1));
  points_.clear();
  for (std::size_t row = 0; row <= 2 * lattice.rows; ++row) {
    for (std::size_t column = 0; column < across; ++column) {
      points_.push_back(lattice.at(static_cast<double>(column) / 2, static_cast<double>(row) / 2));
    }
  }
  view.map->heights(points_, found_);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    nodes_[first + i] = seen_from(view, points_[i], found_[i]) - view.highest;
  }
  for (std::size_t place = 0; place < lattice.cells(); ++place) {
    const bool counts = nodes_of(lattices_.size() - 1, place).under > 0 && !territory.lost(lattice.middle(place));
    places_.push_back(counts ? kSounded : kNone);
    sounded_ += counts ? 1 : 0;
  }
}

void PatchFace::settle(const std::vector<Region>& regions) {
  twice_.clear();
  for (std::size_t number = 0; lattices_.size() > 1 && number < lattices_.size(); ++number) {
    const Lattice& lattice = lattices_[number];
    for (std::size_t place = 0; place < lattice.cells(); ++place) {
      if (places_[firsts_[number] + place] != kSounded) continue;
      const Point at = lattice.middle(place);
      if (regions[number].holds(at)) continue;
      for (std::size_t other = 0; other < lattices_.size(); ++other) {
        std::size_t cell;
        if (other == number || !lattices_[other].holds(at, cell)) continue;
        if (places_[firsts_[other] + cell] != kSounded) continue;
        if (!regions[other].holds(at) && regions[other].away(at) >= regions[number].away(at)) continue;
        twice_.push_back(firsts_[number] + place);
        break;
      }
    }
  }
  for (const std::size_t place : twice_) places_[place] = kNone;
  sounded_ -= twice_.size();
}

void PatchFace::split(const std::vector<std::uint8_t>& chosen, const HeightWindow& view, double narrowest,
                      std::vector<std::size_t>& from) {
  former_cells_ = cells_, former_numbers_ = places_;
  split_.clear();
  std::fill(places_.begin(), places_.end(), kNone);
  for (const Cell& cell : former_cells_) places_[firsts_[cell.lattice] + cell.place] = kSounded;
  const std::size_t count = lattices_.size();
  for (std::size_t number = 0; number < count; ++number) {
    if (lattices_[number].width() >= 2.0 * narrowest) sound_parts(number, chosen, view);
  }
  clear_cells();
  lay(view);
  from.clear();
  for (const Cell& cell : cells_) {
    std::size_t lattice = cell.lattice, place = cell.place;
    if (lattice >= count) {
      const std::size_t columns = lattices_[lattice].columns;
      place = (place / columns / 2) * (columns / 2) + place % columns / 2;
      lattice = split_[lattice - count];
    }
    from.push_back(static_cast<std::size_t>(former_numbers_[firsts_[lattice] + place]));
  }
}

// Add a lattice of cells half as long and wide as those of another one, and count its cells in place of the chosen ones
// of that lattice.
void PatchFace::sound_parts(std::size_t number, const std::vector<std::uint8_t>& chosen, const HeightWindow& view) {
  const auto each_chosen = [&](auto&& visit) {
    for (std::size_t i = 0; i < former_cells_.size(); ++i) {
      if (chosen[i] && former_cells_[i].lattice == number) visit(former_cells_[i].place);
    }
  };
  const std::size_t columns = lattices_[number].columns, across = 4 * columns + 1;
  wanted_.clear();
  each_chosen([&](std::size_t place) {
    const std::size_t corner = 4 * (place / columns) * across + 4 * (place % columns);
    for (std::size_t k = 0; k < 25; ++k) wanted_.push_back(corner + k / 5 * across + k % 5);
  });
  if (wanted_.empty()) return;
  std::sort(wanted_.begin(), wanted_.end());
  wanted_.erase(std::unique(wanted_.begin(), wanted_.end()), wanted_.end());
  Lattice finer = lattices_[number];
  finer.size /= 2, finer.columns *= 2, finer.rows *= 2;
  const std::size_t own = lattices_.size(), first = places_.size(), first_node = nodes_.size();
  split_.push_back(number);
  lattices_.push_back(finer);
  firsts_.push_back(first);
  first_nodes_.push_back(first_node);
  places_.resize(first + finer.cells(), kNone);
  nodes_.resize(first_node + across * (2 * finer.rows + 1), kNowhere);
  points_.clear();
  for (const std::size_t node : wanted_) {
    points_.push_back(finer.at(static_cast<double>(node % across) / 2, static_cast<double>(node / across) / 2));
  }
  view.map->heights(points_, found_);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    nodes_[first_node + wanted_[i]] = seen_from(view, points_[i], found_[i]) - view.highest;
  }
  each_chosen([&](std::size_t place) {
    places_[firsts_[number] + place] = kNone;
    const std::size_t corner = 2 * (place / columns) * finer.columns + 2 * (place % columns);
    for (const std::size_t part : {corner, corner + 1, corner + finer.columns, corner + finer.columns + 1}) {
      if (nodes_of(own, part).under > 0) places_[first + part] = kSounded;
    }
  });
}

PatchFace::Nodes PatchFace::nodes_of(std::size_t number, std::size_t place) const {
  const Lattice& lattice = lattices_[number];
  const std::size_t across = 2 * lattice.columns + 1;
  const double* nodes = nodes_.data() + first_nodes_[number];
  Nodes found = {{}, 0, 0};
  for (std::size_t k = 0; k < 9; ++k) {
    const double over = nodes[(2 * (place / lattice.columns) + k / 3) * across + 2 * (place % lattice.columns) + k % 3];
    found.over[k] = over;
    found.under += over <= 0.0 ? 1 : 0;
    found.finite += std::isfinite(over) ? 1 : 0;
  }
  return found;
}

void PatchFace::lay(const HeightWindow& view) {
  const std::size_t first = cells_.size();
  for (std::size_t number = 0; number < lattices_.size(); ++number) {
    for (std::size_t place = 0; place < lattices_[number].cells(); ++place) {
      std::int32_t& counts = places_[firsts_[number] + place];
      if (counts == kSounded && !cut_out(view, number, place)) counts = kNone;
    }
  }
  set_heights(view, first);
}

// Add a cell, without its height. False if too little of it counts.
bool PatchFace::cut_out(const HeightWindow& view, std::size_t number, std::size_t place) {
  const Lattice& lattice = lattices_[number];
  const auto column = static_cast<double>(place % lattice.columns), row = static_cast<double>(place / lattice.columns);
  const Nodes nodes = nodes_of(number, place);
  Cell cell = {number, static_cast<std::uint32_t>(place), nodes.under == 9, lattice.cosine, lattice.sine,
               {lattice.size, lattice.width()}};
  Point middle = lattice.at(column + 0.5, row + 0.5);
  if (!cell.whole) {
    Covered covered;
    if (!cover({lattice, view, column, row, nodes.finite == 9 ? nodes.over : nullptr}, covered)) return false;
    middle = lattice.at(column + 0.5 + covered.x / lattice.size, row + 0.5 + covered.y / lattice.width());
    // Ends are only accurate to a fraction of a cell, so the middle of a sliver may be beyond the sheet.
    if (!view.map->bounds().holds(middle.x, middle.y)) return false;
    const double mean = (covered.xx + covered.yy) / 2, apart = std::hypot((covered.xx - covered.yy) / 2, covered.xy);
    double longer = covered.xx, shorter = covered.yy;
    if (mean + apart > kSlanted * (mean - apart)) {
      const double angle = 0.5 * std::atan2(2.0 * covered.xy, covered.xx - covered.yy);
      const double c = std::cos(angle), s = std::sin(angle);
      cell.cosine = lattice.cosine * c - lattice.sine * s;
      cell.sine = lattice.sine * c + lattice.cosine * s;
      longer = mean + apart;
      shorter = covered.area * covered.area / (144.0 * longer);  // variance of a rectangle of that length and area
    }
    cell.sides[0] = std::sqrt(covered.area * std::sqrt(longer / shorter));
    cell.sides[1] = covered.area / cell.sides[0];
  }
  cells_.push_back(cell);
  goes_on_.push_back(nodes.finite > nodes.under ? 1 : 0);
  face_.centroids.push_back(middle);
  return true;
}

void PatchFace::find_ends(const HeightWindow& view, std::vector<std::uint8_t>& ends) const {
  ends = goes_on_;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i].whole && goes_on_beside(view, cells_[i].lattice, cells_[i].place)) ends[i] = 1;
  }
}

// Whether the body goes on beside a whole cell at an end of its lattice. Within the lattice, cells beside a whole one
// count as well, because they share nodes with it.
bool PatchFace::goes_on_beside(const HeightWindow& view, std::size_t number, std::size_t place) const {
  const Lattice& lattice = lattices_[number];
  const std::size_t column = place % lattice.columns, row = place / lattice.columns;
  const auto goes_on = [&](double along, double across) {
    const Point at = lattice.at(static_cast<double>(column) + 0.5 + along, static_cast<double>(row) + 0.5 + across);
    for (std::size_t k = 0; k < lattices_.size(); ++k) {
      std::size_t cell;
      if (k != number && lattices_[k].holds(at, cell) && nodes_of(k, cell).under > 0) return false;
    }
    return std::isfinite(view.map->height(at.x, at.y));
  };
  const double out = 0.5 + kBeyond;
  return (column == 0 && goes_on(-out, 0.0)) || (column + 1 == lattice.columns && goes_on(out, 0.0)) ||
         (row == 0 && goes_on(0.0, -out)) || (row + 1 == lattice.rows && goes_on(0.0, out));
}

// Set heights and gradients of all cells from number `first` on. Heights are looked up together, because that is
// faster. Cells without a body above are removed.
void PatchFace::set_heights(const HeightWindow& view, std::size_t first) {
  points_.clear();
  for (std::size_t i = first; i < cells_.size(); ++i) {
    const Point& middle = face_.centroids[i];
    const Arms arms = arms_of(cells_[i]);
    points_.insert(points_.end(), {{middle.x + arms.ends[0].x, middle.y + arms.ends[0].y},
                                   {middle.x + arms.ends[1].x, middle.y + arms.ends[1].y},
                                   {middle.x - arms.ends[0].x, middle.y - arms.ends[0].y},
                                   {middle.x - arms.ends[1].x, middle.y - arms.ends[1].y}});
  }
  view.map->heights(points_, found_);
  std::size_t kept = first;
  for (std::size_t i = first; i < cells_.size(); ++i) {
    const Cell cell = cells_[i];
    Point gradient;
    const double height = mean_height(view, i, 4 * (i - first), gradient);
    std::int32_t& place = places_[firsts_[cell.lattice] + cell.place];
    if (!std::isfinite(height)) {
      place = kNone;
      continue;
    }
    place = static_cast<std::int32_t>(kept);
    cells_[kept] = cell, goes_on_[kept] = goes_on_[i], face_.centroids[kept] = face_.centroids[i];
    face_.areas.push_back(cell.sides[0] * cell.sides[1]);
    heights_.push_back(height);
    gradients_.push_back(gradient);
    ++kept;
  }
  cells_.resize(kept), goes_on_.resize(kept), face_.centroids.resize(kept);
}

// Find the part of a cell below the view's limit, on lines in both directions, so that the result does not depend on
// how the scene is turned. False if the part is too small.
bool PatchFace::cover(const CutCell& cut, Covered& covered) const {
  Covered found[2] = {};
  const int along = sweep(cut, true, found[0]), across = sweep(cut, false, found[1]);
  // Lines along a narrow part hit or miss it as a whole. Lines across it are more accurate.
  covered = {};
  for (int k = 0; k < 2; ++k) {
    const int own = k == 0 ? along : across, other = k == 0 ? across : along;
    const double share = own == other ? 0.5 : own > other ? 1.0 : 0.0;
    covered.area += share * found[k].area;
    covered.x += share * found[k].x, covered.y += share * found[k].y;
    covered.xx += share * found[k].xx, covered.xy += share * found[k].xy, covered.yy += share * found[k].yy;
  }
  const double whole = covered.area, cell = cut.lattice.size * cut.lattice.width();
  if (!(whole > kLeastShare * cell)) return false;
  covered.x /= whole, covered.y /= whole;
  covered.xx = covered.xx / whole - covered.x * covered.x;
  covered.yy = covered.yy / whole - covered.y * covered.y;
  covered.xy = covered.xy / whole - covered.x * covered.y;
  // A part that only one line meets has no width except rounding.
  const double least = kLeastWidth * kLeastWidth * cell;
  return covered.xx > least && covered.yy > least;
}

// Add the area and moments of the part, from lines in one direction. Returns the number of lines that meet it.
int PatchFace::sweep(const CutCell& cut, bool along, Covered& sum) const {
  int hits = 0;
  const double size = cut.lattice.size, other_size = cut.lattice.width();
  const double length = along ? size : other_size, width = along ? other_size : size;
  for (int line = 0; line < 3; ++line) {
    double low, high;
    if (cut.over != nullptr ? !between_nodes(cut.over, along, kLines[line], low, high)
                            : !search_ends(cut, along, kLines[line], low, high)) {
      continue;
    }
    ++hits;
    low *= length, high *= length;
    const double weight = (high - low) * width * kWeights[line], middle = (low + high) / 2;
    const double square = (high * high + high * low + low * low) / 3, other = kLines[line] * width;
    sum.area += weight;
    sum.x += weight * (along ? middle : other);
    sum.y += weight * (along ? other : middle);
    sum.xx += weight * (along ? square : other * other);
    sum.yy += weight * (along ? other * other : square);
    sum.xy += weight * middle * other;
  }
  return hits;
}

// The same as between_nodes(), by a search along the line, for cells that the body does not cover entirely.
bool PatchFace::search_ends(const CutCell& cut, bool along, double line, double& low, double& high) const {
  const auto point = [&](double part) {
    const double u = along ? part : line, v = along ? line : part;
    return cut.lattice.at(cut.column + 0.5 + u, cut.row + 0.5 + v);
  };
  const Segment whole = {point(-0.5), point(0.5)};
  const double plane[2] = {cut.view.highest - seen_from(cut.view, whole.start, 0.0),
                           cut.view.highest - seen_from(cut.view, whole.end, 0.0)};
  SegmentPart found;
  if (cut.view.map->part_below(whole, plane, found)) {
    low = found.low - 0.5, high = found.high - 0.5;
    return !found.is_empty();
  }
  const auto above = [&](double part) { return seen(cut.view, point(part)) - cut.view.highest; };
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

// Offsets from a cell's middle to its sample points, of which there is one on either side along both axes.
PatchFace::Arms PatchFace::arms_of(const Cell& cell) {
  const double lengths[2] = {cell.sides[0] / std::sqrt(6.0), cell.sides[1] / std::sqrt(6.0)};
  return {{lengths[0], lengths[1]},
          {{cell.cosine * lengths[0], cell.sine * lengths[0]}, {-cell.sine * lengths[1], cell.cosine * lengths[1]}}};
}

// Mean height over a cell from the heights at its four sample points, and its gradient. The mean is exact for a
// quadratic surface. Points without a body above are left out. `looked_at`: index of the cell's first sample point in
// points_.
double PatchFace::mean_height(const HeightWindow& view, std::size_t own, std::size_t looked_at, Point& gradient) const {
  const Cell& cell = cells_[own];
  double sum = 0.0, heights[4];
  int count = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    heights[k] = seen_from(view, points_[looked_at + k], found_[looked_at + k]);
    if (!std::isfinite(heights[k])) continue;
    sum += heights[k];
    ++count;
  }
  const double middle = count < 4 ? seen(view, face_.centroids[own]) : 0.0;
  const Arms arms = arms_of(cell);
  double slopes[2];
  for (std::size_t axis = 0; axis < 2; ++axis) {
    slopes[axis] = slope_between(heights[axis], middle, heights[axis + 2]) / arms.lengths[axis];
  }
  gradient = {cell.cosine * slopes[0] - cell.sine * slopes[1], cell.sine * slopes[0] + cell.cosine * slopes[1]};
  return count > 0 ? sum / count : middle;
}

void PatchFace::trim(const HeightWindow& view, double least, double most, Region& region) const {
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
          return seen(view, {region.centre.x + c * x - s * y, region.centre.y + s * x + c * y}) <= view.highest;
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

std::int32_t PatchFace::cell_at(std::size_t lattice, std::size_t column, std::size_t row) const {
  const Lattice& own = lattices_[lattice];
  return column < own.columns && row < own.rows ? places_[firsts_[lattice] + row * own.columns + column] : kNone;
}

// Visit all pairs of neighbours in a lattice of which one presses at least, with what their heights and gradients
// disagree by [m].
template <typename Visit>
void PatchFace::each_pair(const std::vector<std::uint8_t>& pressed, Visit&& visit) const {
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const std::size_t lattice = cells_[i].lattice, columns = lattices_[lattice].columns;
    const std::size_t column = cells_[i].place % columns, row = cells_[i].place / columns;
    for (const std::int32_t place : {cell_at(lattice, column + 1, row), cell_at(lattice, column, row + 1)}) {
      if (place < 0) continue;
      const auto next = static_cast<std::size_t>(place);
      if (!pressed[i] && !pressed[next]) continue;
      const double x = face_.centroids[next].x - face_.centroids[i].x;
      const double y = face_.centroids[next].y - face_.centroids[i].y;
      const double rise = ((gradients_[i].x + gradients_[next].x) * x + (gradients_[i].y + gradients_[next].y) * y) / 2;
      visit(i, next, std::abs(heights_[next] - heights_[i] - rise));
    }
  }
}

double PatchFace::roughness(const std::vector<std::uint8_t>& pressed, double most) const {
  double squares = 0.0, area = 0.0;
  each_pair(pressed, [&](std::size_t one, std::size_t other, double apart) {
    const double share = face_.areas[one] + face_.areas[other], counted = std::min(apart, most);
    squares += share * counted * counted, area += share;
  });
  return area > 0.0 ? std::sqrt(squares / area) : 0.0;
}

void PatchFace::find_rough(const std::vector<std::uint8_t>& pressed, double least,
                           std::vector<std::uint8_t>& rough) const {
  rough.assign(cells_.size(), 0);
  each_pair(pressed, [&](std::size_t one, std::size_t other, double apart) {
    if (apart > least) rough[one] = rough[other] = 1;
  });
}

void PatchFace::find_around(const std::vector<std::uint8_t>& pressed, std::vector<std::uint8_t>& around) const {
  around = pressed;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const std::size_t lattice = cells_[i].lattice, columns = lattices_[lattice].columns;
    const std::size_t column = cells_[i].place % columns, row = cells_[i].place / columns;
    for (std::size_t k = 0; k < 9 && !around[i]; ++k) {
      // The number before the first column or row is a very large one, which no lattice has.
      const std::int32_t beside = cell_at(lattice, column + k % 3 - 1, row + k / 3 - 1);
      if (beside >= 0 && pressed[static_cast<std::size_t>(beside)]) around[i] = 1;
    }
  }
}

// Keep the rectangle that replaces a part within the sheet, because traction beyond the edge would be lost. The
// rectangle is turned parallel to the edge, made as wide as there is room, and as long as its area needs.
void PatchFace::keep_on(const Rectangle& sheet, const Point& middle, Cell& cell) {
  const double c = cell.cosine, s = cell.sine, area = cell.sides[0] * cell.sides[1];
  const double room[2] = {2.0 * std::min(middle.x - sheet.west, sheet.east - middle.x),
                          2.0 * std::min(middle.y - sheet.south, sheet.north - middle.y)};
  const double reached[2] = {std::abs(c) * cell.sides[0] + std::abs(s) * cell.sides[1],
                             std::abs(s) * cell.sides[0] + std::abs(c) * cell.sides[1]};
  if (reached[0] <= (1.0 + kFlush) * room[0] && reached[1] <= (1.0 + kFlush) * room[1]) return;
  double sides[2] = {std::hypot(c * cell.sides[0], s * cell.sides[1]),
                     std::hypot(s * cell.sides[0], c * cell.sides[1])};
  const double smaller = std::sqrt(area / (sides[0] * sides[1]));
  for (double& side : sides) side *= smaller;
  for (int k = 0; k < 2; ++k) {
    if (sides[k] <= room[k]) continue;
    sides[k] = room[k];
    sides[1 - k] = std::min(area / sides[k], room[1 - k]);
  }
  // Cells that are parallel to the edge keep their axes, because parallel pairs are integrated in closed form.
  const bool upright = std::abs(s) > std::abs(c);
  if (std::min(std::abs(s), std::abs(c)) > kFlush) cell.cosine = upright ? 0.0 : 1.0, cell.sine = upright ? 1.0 : 0.0;
  cell.sides[0] = sides[upright ? 1 : 0];
  cell.sides[1] = sides[upright ? 0 : 1];
}

void PatchFace::finish(const Rectangle& sheet, double resolution) {
  double area = 0.0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    Cell& cell = cells_[i];
    if (!cell.whole) keep_on(sheet, face_.centroids[i], cell);
    face_.areas[i] = cell.sides[0] * cell.sides[1];
    area += face_.areas[i];
  }
  face_.length = std::sqrt(area);
  face_.hull = convex_hull(outermost());
  place_quadrature(resolution);
  integrate();
  add_edges();
}

// Place quadrature points if the middle of some cell does not speak for all of it.
void PatchFace::place_quadrature(double resolution) {
  face_.quadrature.clear();
  const double widest = kSpread * resolution;
  if (std::none_of(cells_.begin(), cells_.end(),
                   [&](const Cell& cell) { return std::max(cell.sides[0], cell.sides[1]) > widest; })) {
    return;
  }
  // Points on the middle lines whose mean has the second moments of the rectangle.
  const double away = 1.0 / std::sqrt(6.0);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Cell& cell = cells_[i];
    add_quadrature(face_.centroids[i], {cell.cosine, cell.sine}, away * cell.sides[0], away * cell.sides[1],
                   face_.quadrature);
  }
}

// Centroids without those between two neighbours in a row, which cannot be corners of the hull.
std::vector<Point> PatchFace::outermost() const {
  std::vector<Point> points;
  const auto whole = [&](std::size_t lattice, std::size_t column, std::size_t row) {
    const std::int32_t place = cell_at(lattice, column, row);
    return place >= 0 && cells_[static_cast<std::size_t>(place)].whole;
  };
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Cell& cell = cells_[i];
    const std::size_t columns = lattices_[cell.lattice].columns;
    const std::size_t column = cell.place % columns, row = cell.place / columns;
    const bool between =
        cell.whole && column > 0 && whole(cell.lattice, column - 1, row) && whole(cell.lattice, column + 1, row);
    if (!between) points.push_back(face_.centroids[i]);
  }
  return points;
}

void PatchFace::integrate() {
  const std::size_t count = cells_.size();
  rectangles_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    rectangles_.emplace_back(face_.centroids[i], cells_[i].cosine, cells_[i].sine, cells_[i].sides);
  }
  far_.fit(rectangles_);
  face_.inverse_distance.resize(count * count);
  columns_.resize(count);
  rows_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t columns = lattices_[cells_[i].lattice].columns;
    columns_[i] = cells_[i].place % columns, rows_[i] = cells_[i].place / columns;
  }
  std::size_t first = 0;
  for (std::size_t k = 0; k < lattices_.size(); ++k) {
    std::size_t last = first;
    while (last < count && cells_[last].lattice == k) ++last;
    if (last > first) integrate(lattices_[k], first, last);
    first = last;
  }
  mirror_upper(face_.inverse_distance.data(), count, count);
}

// Compute the rows of a lattice's cells in the matrix of integrals, from the diagonal on. Integrals over pairs of whole
// cells depend on their offset only.
void PatchFace::integrate(const Lattice& lattice, std::size_t first, std::size_t last) {
  const std::size_t count = cells_.size();
  whole_.clear(), beside_.clear(), rectangles_beside_.clear();
  for (std::size_t i = first; i < count; ++i) {
    if (i < last && cells_[i].whole) {
      whole_.push_back(i);
    } else {
      beside_.push_back(i);
      rectangles_beside_.push_back(rectangles_[i]);
    }
  }
  far_beside_.fit(rectangles_beside_);
  values_.resize(beside_.size());
  inverse_distance_by_offset(lattice.columns, lattice.rows, lattice.size, lattice.width(), offsets_);
  std::size_t wholes = 0, others = 0;   // numbers of cells of both kinds before the row's cell
  for (std::size_t i = first; i < last; ++i) {
    double* own = face_.inverse_distance.data() + i * count;
    if (!cells_[i].whole) {
      ++others;
      far_.of(rectangles_[i], i, own + i);
      for (std::size_t j = i; j < count; ++j) {
        if (own[j] == 0.0) own[j] = near_inverse_distance(rectangles_[i], rectangles_[j]);
      }
      continue;
    }
    for (std::size_t k = wholes++; k < whole_.size(); ++k) {
      const std::size_t j = whole_[k];
      const std::size_t across = columns_[j] > columns_[i] ? columns_[j] - columns_[i] : columns_[i] - columns_[j];
      own[j] = offsets_[(rows_[j] - rows_[i]) * lattice.columns + across];
    }
    far_beside_.of(rectangles_[i], others, values_.data());
    for (std::size_t k = others; k < beside_.size(); ++k) {
      const double found = values_[k - others];
      own[beside_[k]] = found != 0.0 ? found : near_inverse_distance(rectangles_[i], rectangles_[beside_[k]]);
    }
  }
}

// Integrals of shear over pairs of near cells. For whole cells of one lattice, each offset is computed once.
class PatchFace::ShearByOffset {
 public:
  explicit ShearByOffset(const PatchFace& face) : face_(face) {
    for (const Lattice& lattice : face.lattices_) {
      firsts_.push_back(found_.size());
      found_.resize(found_.size() + 2 * lattice.columns * lattice.rows, {kNowhere, 0.0, 0.0, 0.0, 0.0});
    }
  }

  // The integrals over a cell and a later one. False if the two are far apart.
  bool has(std::size_t one, std::size_t other, PairShear& pair) {
    const Cell &from = face_.cells_[one], &to = face_.cells_[other];
    const CellRectangle &first = face_.rectangles_[one], &second = face_.rectangles_[other];
    if (are_far(first, second)) return false;
    if (!from.whole || !to.whole || from.lattice != to.lattice) {
      pair = near_shear_integrals(first, second);
      return true;
    }
    const std::size_t columns = face_.lattices_[from.lattice].columns;
    const std::size_t rows = to.place / columns - from.place / columns;
    const std::size_t across = columns + to.place % columns - from.place % columns;
    PairShear& found = found_[firsts_[from.lattice] + 2 * columns * rows + across];
    if (found.xx == kNowhere) found = near_shear_integrals(first, second);
    pair = found;
    return true;
  }

 private:
  const PatchFace& face_;
  std::vector<std::size_t> firsts_;   // of each lattice
  // By offset in rows (from 0) and in columns (from -columns); xx is infinite if not computed yet.
  std::vector<PairShear> found_;
};

void PatchFace::integrate_shear(ShearIntegrals& integrals) const {
  const std::size_t count = cells_.size();
  for (auto* one : {&integrals.xx, &integrals.xy, &integrals.yy, &integrals.along, &integrals.across}) {
    one->assign(count * count, 0.0);
  }
  PairShear alone = {};
  std::vector<double> middles;
  for (const Point& middle : face_.centroids) middles.push_back(middle.x);
  for (const Point& middle : face_.centroids) middles.push_back(middle.y);
  ShearByOffset apart(*this);
  for (std::size_t i = 0; i < count; ++i) {
    const CellRectangle& cell = rectangles_[i];
    // Most neighbours are equal, and so are their integrals.
    const CellRectangle* before = i > 0 ? &rectangles_[i - 1] : nullptr;
    if (before == nullptr || cell.sides[0] != before->sides[0] || cell.sides[1] != before->sides[1] ||
        cell.cosine != before->cosine || cell.sine != before->sine) {
      alone = near_shear_integrals(cell, cell);
    }
    integrals.xx[i * count + i] = alone.xx;
    integrals.yy[i * count + i] = alone.yy;
    integrals.xy[i * count + i] = alone.xy;
    const std::size_t next = i * count + i + 1;
    double* const rows[5] = {integrals.xx.data() + next, integrals.xy.data() + next, integrals.yy.data() + next,
                             integrals.along.data() + next, integrals.across.data() + next};
    const double* later = middles.data() + i + 1;
    kernels().shear_of_point(middles[i], middles[count + i], cell.area, later, later + count,
                             face_.areas.data() + i + 1, count - i - 1, rows);
    for (std::size_t j = i + 1; j < count; ++j) {
      PairShear pair;
      if (apart.has(i, j, pair)) {
        const double found[5] = {pair.xx, pair.xy, pair.yy, pair.along, pair.across};
        for (std::size_t k = 0; k < 5; ++k) rows[k][j - i - 1] = found[k];
      }
      const std::size_t there = i * count + j, back = j * count + i;
      integrals.xx[back] = integrals.xx[there], integrals.xy[back] = integrals.xy[there];
      integrals.yy[back] = integrals.yy[there];
      integrals.along[back] = -integrals.along[there], integrals.across[back] = -integrals.across[there];
    }
  }
}

// Make the cells' edges. Neighbouring whole cells share an edge; a cell that is covered in part has four of its own.
void PatchFace::add_edges() {
  const auto add = [&](const Point& start, const Point& end, std::int32_t left, std::int32_t right) {
    face_.edges.push_back({{start.x, start.y}, {end.x, end.y}, left, right});
  };
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Cell& cell = cells_[i];
    const Lattice& lattice = lattices_[cell.lattice];
    const auto own = static_cast<std::int32_t>(i);
    if (!cell.whole) {
      const Point& middle = face_.centroids[i];
      const auto corner = [&](double u, double v) {
        const double x = u * cell.sides[0], y = v * cell.sides[1];
        return Point{middle.x + cell.cosine * x - cell.sine * y, middle.y + cell.sine * x + cell.cosine * y};
      };
      const Point corners[4] = {corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)};
      for (int k = 0; k < 4; ++k) add(corners[k], corners[(k + 1) % 4], own, -1);
      continue;
    }
    const std::size_t column = cell.place % lattice.columns, row = cell.place / lattice.columns;
    const auto whole = [&](std::size_t to_column, std::size_t to_row) {
      const std::int32_t place = cell_at(cell.lattice, to_column, to_row);
      return place >= 0 && cells_[static_cast<std::size_t>(place)].whole ? place : -1;
    };
    const auto x = static_cast<double>(column), y = static_cast<double>(row);
    const Point corners[4] = {lattice.at(x, y), lattice.at(x + 1, y), lattice.at(x + 1, y + 1), lattice.at(x, y + 1)};
    // Its right and upper edges; also the left and lower ones if no neighbour adds them.
    add(corners[1], corners[2], own, whole(column + 1, row));
    add(corners[2], corners[3], own, whole(column, row + 1));
    if (column == 0 || whole(column - 1, row) < 0) add(corners[3], corners[0], own, -1);
    if (row == 0 || whole(column, row - 1) < 0) add(corners[0], corners[1], own, -1);
  }
}

}  // namespace mjtactile
