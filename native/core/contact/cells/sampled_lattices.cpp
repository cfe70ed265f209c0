#include "contact/cells/sampled_lattices.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mjtactile {
namespace {

// A lattice grows if the body continues at this distance beyond it, over the size of a cell, at most kGrowths times.
constexpr double kBeyond = 0.25;
constexpr std::size_t kGrowths = 12;
// Two regions are of unlike size if the area of the smaller is less than this fraction of the other's. It is no ratio
// of small whole numbers, because rounding would decide at such a ratio.
constexpr double kUnlike = 0.497;
// Heights of ridges are found up to this share of the strips' height.
constexpr double kTolerance = 0.1;

// Add a column or a row of cells on the sides where the body goes on: west, east, south, north. False if it does on
// none.
bool extend(const bool (&beyond)[4], Lattice& lattice) {
  if (!beyond[0] && !beyond[1] && !beyond[2] && !beyond[3]) return false;
  // The new middle, in coordinates of the old lattice.
  const double along = (static_cast<double>(lattice.columns) + (beyond[1] ? 1.0 : 0.0) - (beyond[0] ? 1.0 : 0.0)) / 2;
  const double across = (static_cast<double>(lattice.rows) + (beyond[3] ? 1.0 : 0.0) - (beyond[2] ? 1.0 : 0.0)) / 2;
  lattice.centre = lattice.at(along, across);
  lattice.columns += (beyond[0] ? 1u : 0u) + (beyond[1] ? 1u : 0u);
  lattice.rows += (beyond[2] ? 1u : 0u) + (beyond[3] ? 1u : 0u);
  return true;
}

// Add rows and columns of cells on the sides where the body continues beyond the lattice.
void grow(const HeightWindow& view, const SampledLattices::Territory& territory, Lattice& lattice) {
  const auto counts = [&](double column, double row) {
    const Point at = lattice.at(column, row);
    return view.height(at) <= view.highest && !territory.lost(at);
  };
  for (std::size_t growth = 0; growth < kGrowths; ++growth) {
    const auto columns = static_cast<double>(lattice.columns), rows = static_cast<double>(lattice.rows);
    bool beyond[4] = {};
    for (double row = 0.5; row < rows; ++row) {
      beyond[0] = beyond[0] || (counts(-kBeyond, row) && counts(0.5, row));
      beyond[1] = beyond[1] || (counts(columns + kBeyond, row) && counts(columns - 0.5, row));
    }
    for (double column = 0.5; column < columns; ++column) {
      beyond[2] = beyond[2] || (counts(column, -kBeyond) && counts(column, 0.5));
      beyond[3] = beyond[3] || (counts(column, rows + kBeyond) && counts(column, rows - 0.5));
    }
    if (!extend(beyond, lattice)) return;
  }
}

}  // namespace

// The order of regions must not decide between equal parts of a body, because it changes as the body turns.
bool SampledLattices::Territory::lost(const Point& at) const {
  const Region& here = regions[own];
  for (std::size_t i = 0; i < regions.size(); ++i) {
    const Region& other = regions[i];
    if (i == own || !other.holds(at)) continue;
    const double ratio = other.area() / here.area();
    if (ratio < kUnlike || (ratio <= 1.0 / kUnlike && other.away(at) < here.away(at))) return true;
  }
  return false;
}

void SampledLattices::clear(bool along_ridges) {
  along_ridges_ = along_ridges;
  lattices_.clear();
  numbers_.clear();
  nodes_.clear();
  line_ends_.clear(), strips_.clear();
  counted_ = 0;
}

// Add a lattice of which no cell counts and no node is sampled.
void SampledLattices::append(const Lattice& lattice) {
  lattices_.push_back({lattice, numbers_.size(), nodes_.size(), kNoLines});
  numbers_.resize(numbers_.size() + lattice.cells(), kNone);
  nodes_.resize(nodes_.size() + (2 * lattice.columns + 1) * (2 * lattice.rows + 1), kNowhere);
}

// Sample the wanted nodes of the last lattice, at points_. They are looked up together, because that is faster.
void SampledLattices::sample(const HeightWindow& view) {
  view.map->heights(points_, found_);
  double* nodes = nodes_.data() + lattices_.back().first_node;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    nodes[wanted_[i]] = view.measured(points_[i], found_[i]) - view.highest;
  }
}

// Sample all nodes of the last lattice.
void SampledLattices::sample_all(const HeightWindow& view) {
  const Lattice& lattice = lattices_.back();
  const std::size_t across = 2 * lattice.columns + 1, count = across * (2 * lattice.rows + 1);
  points_.resize(count);
  wanted_.resize(count);
  std::iota(wanted_.begin(), wanted_.end(), std::size_t{0});
  for (std::size_t row = 0; row <= 2 * lattice.rows; ++row) {
    Point* const to = points_.data() + row * across;
    for (std::size_t column = 0; column < across; ++column) {
      to[column] = lattice.at(static_cast<double>(column) / 2, static_cast<double>(row) / 2);
    }
  }
  sample(view);
}

// Count a cell of the last lattice, unless it was counted or belongs to another lattice.
void SampledLattices::count(std::size_t place, const Territory& territory) {
  const std::size_t lattice = size() - 1;
  if (number(lattice, place) == kCounted || territory.lost(lattices_.back().middle(place))) return;
  set_number(lattice, place, kCounted);
  ++counted_;
}

void SampledLattices::add(Lattice lattice, const HeightWindow& view, const Territory& territory) {
  grow(view, territory, lattice);
  append(lattice);
  sample_all(view);
  for (std::size_t place = 0; place < lattice.cells(); ++place) {
    if (is_under(size() - 1, place)) count(place, territory);
  }
}

void SampledLattices::add_along_ridges(Lattice lattice, const HeightWindow& view, const Territory& territory,
                                       double strip) {
  append_along_ridges(lattice, view, strip);
  // The search knows a ridge up to its last crossing with the grid, which may be a step before its end.
  bool beyond[4];
  for (std::size_t side = 0; side < 4; ++side) beyond[side] = ridge_leaves(side, view, strip);
  if (extend(beyond, lattice)) {
    remove_last();
    append_along_ridges(lattice, view, strip);
  }
  for (std::size_t place = 0; place < lattice.cells(); ++place) {
    bool meets = false;
    each_strip(size() - 1, place, [&](std::size_t, std::size_t, double, double, double) { meets = true; });
    if (meets) count(place, territory);
  }
}

void SampledLattices::append_along_ridges(const Lattice& lattice, const HeightWindow& view, double strip) {
  append(lattice);
  sample_all(view);
  lattices_.back().first_line = line_ends_.size();
  find_strips(view, strip);
}

// Remove the last lattice, which follows ridges.
void SampledLattices::remove_last() {
  const Sampled& last = lattices_.back();
  numbers_.resize(last.first), nodes_.resize(last.first_node), line_ends_.resize(last.first_line);
  strips_.resize(line_ends_.empty() ? 0 : line_ends_.back());
  lattices_.pop_back();
}

// Whether a ridge crosses a side of the last lattice, and a line beyond it: west, east, south, north.
bool SampledLattices::ridge_leaves(std::size_t side, const HeightWindow& view, double strip) {
  const Sampled& lattice = lattices_.back();
  const bool row = side >= 2, last = side % 2 == 1;
  const std::size_t rows = 2 * lattice.rows + 1, columns = 2 * lattice.columns + 1;
  const std::size_t line = lattice.first_line + (row ? (last ? rows - 1 : 0) : rows + (last ? columns - 1 : 0));
  if (line_ends_[line] == first_strip(line)) return false;
  const double place = last ? static_cast<double>(row ? lattice.rows : lattice.columns) + kBeyond : -kBeyond;
  const std::size_t count = row ? columns : rows;
  points_.clear();
  for (std::size_t node = 0; node < count; ++node) {
    const double along = static_cast<double>(node) / 2;
    points_.push_back(row ? lattice.at(along, place) : lattice.at(place, along));
  }
  view.map->heights(points_, found_);
  for (std::size_t node = 0; node < count; ++node) {
    found_[node] = view.measured(points_[node], found_[node]) - view.highest;
  }
  const Point step = {points_[1].x - points_[0].x, points_[1].y - points_[0].y};
  const SampledLine samples = {points_[0], step, count, found_.data(), 1, 0, 1, 0, std::hypot(step.x, step.y),
                               SampledLine::kUnknown, SampledLine::kUnknown, false};
  crossings_.clear();
  add_crossings(view, samples, kTolerance * strip, candidates_, crossings_);
  return !crossings_.empty();
}

// Find where the node lines of the last lattice cross ridges.
void SampledLattices::find_strips(const HeightWindow& view, double strip) {
  const Sampled& lattice = lattices_.back();
  const std::size_t across = 2 * lattice.columns + 1, along = 2 * lattice.rows + 1;
  strip_ = strip;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const bool row = axis == 0;
    const Point from = lattice.at(0.0, 0.0), to = row ? lattice.at(0.5, 0.0) : lattice.at(0.0, 0.5);
    for (std::size_t line = 0; line < (row ? along : across); ++line) {
      const std::size_t count = row ? across : along;
      const double* const first = nodes_.data() + lattice.first_node + line * (row ? across : 1);
      const auto point = [&](double node) {
        const double place = static_cast<double>(line) / 2;
        return row ? lattice.at(node / 2, place) : lattice.at(place, node / 2);
      };
      const auto beyond = [&](double node) { return view.height(point(node)) - view.highest; };
      const SampledLine samples = {point(0.0), {to.x - from.x, to.y - from.y}, count, first, row ? 1 : across,
                                   line, row ? along : across, row ? across : 1,
                                   (row ? lattice.width() : lattice.size) / 2,
                                   beyond(-0.5), beyond(static_cast<double>(count) - 0.5), false};
      crossings_.clear();
      add_crossings(view, samples, kTolerance * strip, candidates_, crossings_);
      for (const RidgeCrossing& one : crossings_) {
        strips_.push_back({one.height, one.end(samples, strip, -1.0), one.end(samples, strip, 1.0)});
      }
      line_ends_.push_back(strips_.size());
    }
  }
}

// Visit the strips on the node lines of a cell: for each the line's axis and number, the strip's height, and its part
// in the cell, in cells from its middle.
template <typename Visit>
void SampledLattices::each_strip(std::size_t lattice, std::size_t place, Visit&& visit) const {
  const Sampled& own = lattices_[lattice];
  const std::size_t column = place % own.columns, row = place / own.columns;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const std::size_t first = own.first_line + (axis == 0 ? 2 * row : 2 * own.rows + 1 + 2 * column);
    const auto start = static_cast<double>(axis == 0 ? column : row) + 0.5;
    for (std::size_t line = 0; line < 3; ++line) {
      const std::size_t number = first + line;
      for (std::size_t k = first_strip(number); k < line_ends_[number]; ++k) {
        const double low = std::max(strips_[k].low / 2 - start, -0.5);
        const double high = std::min(strips_[k].high / 2 - start, 0.5);
        if (low < high) visit(axis, line, strips_[k].height, low, high);
      }
    }
  }
}

CellSpans SampledLattices::spans(std::size_t lattice, std::size_t place) const {
  double least = kNowhere;
  each_strip(lattice, place, [&](std::size_t, std::size_t, double height, double, double) {
    least = std::min(least, height);
  });
  CellSpans found;
  each_strip(lattice, place, [&](std::size_t axis, std::size_t line, double height, double low, double high) {
    if (height > least + strip_) return;   // the line passes beside the ridge, and does not cross it
    found.low[axis][line] = std::min(found.low[axis][line], low);
    found.high[axis][line] = std::max(found.high[axis][line], high);
  });
  return found;
}

bool SampledLattices::is_counted_at(std::size_t lattice, const Point& at) const {
  bool counted = false;
  lattices_[lattice].each_at(at, [&](std::size_t place) { counted = counted || number(lattice, place) == kCounted; });
  return counted;
}

void SampledLattices::settle(const std::vector<Region>& regions) {
  twice_.clear();
  for (std::size_t own = 0; size() > 1 && own < size(); ++own) {
    const Lattice& lattice = lattices_[own];
    for (std::size_t place = 0; place < lattice.cells(); ++place) {
      if (number(own, place) != kCounted) continue;
      const Point at = lattice.middle(place);
      if (regions[own].holds(at)) continue;
      for (std::size_t other = 0; other < size(); ++other) {
        if (other == own || !is_counted_at(other, at)) continue;
        if (!regions[other].holds(at) && regions[other].away(at) >= regions[own].away(at)) continue;
        twice_.push_back(lattices_[own].first + place);
        break;
      }
    }
  }
  for (const std::size_t place : twice_) numbers_[place] = kNone;
  counted_ -= twice_.size();
}

bool SampledLattices::splits(std::size_t lattice, double narrowest) const {
  return !follows_ridges(lattice) && lattices_[lattice].splits(narrowest);
}

bool SampledLattices::can_split(double narrowest) const {
  for (std::size_t lattice = 0; lattice < size(); ++lattice) {
    if (lattices_[lattice].splits(narrowest)) return true;
  }
  return false;
}

void SampledLattices::split(const std::vector<std::uint8_t>& chosen, const HeightWindow& view, double narrowest) {
  former_ = numbers_;
  for (std::int32_t& one : numbers_) one = one >= 0 ? kCounted : kNone;
  splits_.clear();
  const std::size_t count = size();
  for (std::size_t own = 0; own < count; ++own) {
    if (splits(own, narrowest)) split_lattice(own, chosen, view);
  }
}

// Add a lattice of cells half as long and wide as those of another one, and count its cells in place of the chosen ones
// of that lattice.
void SampledLattices::split_lattice(std::size_t own, const std::vector<std::uint8_t>& chosen,
                                    const HeightWindow& view) {
  const std::size_t columns = lattices_[own].columns, across = 4 * columns + 1;
  const auto each_chosen = [&](auto&& visit) {
    for (std::size_t place = 0; place < lattices_[own].cells(); ++place) {
      const std::int32_t former = former_[lattices_[own].first + place];
      if (former >= 0 && chosen[static_cast<std::size_t>(former)]) visit(place);
    }
  };
  wanted_.clear();
  each_chosen([&](std::size_t place) {
    const std::size_t corner = 4 * (place / columns) * across + 4 * (place % columns);
    for (std::size_t k = 0; k < 25; ++k) wanted_.push_back(corner + k / 5 * across + k % 5);
  });
  if (wanted_.empty()) return;
  std::sort(wanted_.begin(), wanted_.end());
  wanted_.erase(std::unique(wanted_.begin(), wanted_.end()), wanted_.end());
  Lattice finer = lattices_[own];
  finer.size /= 2, finer.columns *= 2, finer.rows *= 2;
  splits_.push_back(own);
  append(finer);
  points_.clear();
  for (const std::size_t node : wanted_) {
    points_.push_back(finer.at(static_cast<double>(node % across) / 2, static_cast<double>(node / across) / 2));
  }
  sample(view);
  each_chosen([&](std::size_t place) {
    set_number(own, place, kNone);
    const std::size_t corner = 2 * (place / columns) * finer.columns + 2 * (place % columns);
    for (const std::size_t part : {corner, corner + 1, corner + finer.columns, corner + finer.columns + 1}) {
      if (is_under(size() - 1, part)) set_number(size() - 1, part, kCounted);
    }
  });
}

std::size_t SampledLattices::former(std::size_t lattice, std::size_t place) const {
  const std::size_t before = size() - splits_.size();   // lattices before the split
  if (lattice >= before) {
    const std::size_t columns = lattices_[lattice].columns;
    place = (place / columns / 2) * (columns / 2) + place % columns / 2;
    lattice = splits_[lattice - before];
  }
  return static_cast<std::size_t>(former_[lattices_[lattice].first + place]);
}

const double* SampledLattices::corner(std::size_t lattice, std::size_t place) const {
  const Sampled& own = lattices_[lattice];
  return nodes_.data() + own.first_node + 2 * (place / own.columns) * nodes_across(lattice) + 2 * (place % own.columns);
}

bool SampledLattices::is_under(std::size_t lattice, std::size_t place) const {
  const double* row = corner(lattice, place);
  double least = kNowhere;
  for (std::size_t k = 0; k < 3; ++k, row += nodes_across(lattice)) {
    least = std::min(least, std::min(std::min(row[0], row[1]), row[2]));
  }
  return least <= 0.0;
}

SampledLattices::Nodes SampledLattices::nodes(std::size_t lattice, std::size_t place) const {
  const double* const first = corner(lattice, place);
  const std::size_t across = nodes_across(lattice);
  Nodes found = {{}, 0, 0};
  for (std::size_t k = 0; k < 9; ++k) {
    const double over = first[k / 3 * across + k % 3];
    found.over[k] = over;
    found.under += over <= 0.0 ? 1 : 0;
    found.finite += std::isfinite(over) ? 1 : 0;
  }
  return found;
}

}  // namespace mjtactile
