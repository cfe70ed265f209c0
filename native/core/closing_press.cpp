#include "closing_press.hpp"

#include <algorithm>
#include <cmath>

namespace mjtactile {
namespace {

// As the readable reference has them: mjtactile/pressing.py and mjtactile/cell_contact.py.
constexpr std::size_t kCoarseCells = 36, kSearchCells = 100;
constexpr int kSearches = 30;
// Middles of cells on a flat face's rim, where symmetry often puts them, count as outside: over the root of its area.
constexpr double kBarely = 1e-9;
constexpr double kFilled = 0.7, kSmallest = 1e-9;
constexpr std::size_t kSpreadCells = 10, kLeastStart = 6;
constexpr double kCellGive = 3.5;

}  // namespace

bool ClosingPress::solve(const GapMap& gap, const Region& start, const SurfaceCompliance& compliance,
                         const LawOptions& options, const double* wrench, CellContact::Workspace& workspace) {
  Region region = start;
  if (!search(&gap, {}, region, compliance, options, wrench, workspace)) return false;
  const Lattice lattice = region.lattice(options.cells);
  if (!cover_on_sheet(gap, lattice)) return false;
  // Cells that the body would overlap after the motion found are likely to be pressed.
  start_.clear();
  for (std::size_t i = 0; i < heights_.size(); ++i) {
    start_.push_back(motion_.depth(cells_.face().centroids[i]) > heights_[i] ? 1 : 0);
  }
  const bool known = std::count(start_.begin(), start_.end(), 1) >= static_cast<std::ptrdiff_t>(kLeastStart);
  return contact_.solve(cells_.face(), kHere, compliance, options, wrench, workspace, heights_.data(),
                        known ? start_.data() : nullptr) &&
         !ends_at_rim(lattice);
}

bool ClosingPress::solve(const std::vector<Point>& outline, const SurfaceCompliance& compliance,
                         const LawOptions& options, const double* wrench, CellContact::Workspace& workspace) {
  const auto [west, east] = std::minmax_element(outline.begin(), outline.end(), [](auto& a, auto& b) { return a.x < b.x; });
  const auto [south, north] = std::minmax_element(outline.begin(), outline.end(), [](auto& a, auto& b) { return a.y < b.y; });
  double area = 0.0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Point &a = outline[i], &b = outline[(i + 1) % outline.size()];
    area += (a.x * b.y - b.x * a.y) / 2;
  }
  barely_ = kBarely * std::sqrt(area);
  Region region = {{(west->x + east->x) / 2, (south->y + north->y) / 2}, 0.0, east->x - west->x, north->y - south->y};
  if (!search(nullptr, outline, region, compliance, options, wrench, workspace)) return false;
  const Lattice lattice = region.lattice(options.cells);
  kept_.clear();
  for (std::uint32_t cell = 0; cell < lattice.cells(); ++cell) kept_.push_back(cell);
  if (!cells_.make(lattice, kept_, outline)) return false;
  cells_.add_edges();
  heights_.assign(cells_.face().cells(), 0.0);
  return contact_.solve(cells_.face(), kHere, compliance, options, wrench, workspace);
}

// Close in on the contact; `gap` null for a flat face with an outline.
bool ClosingPress::search(const GapMap* gap, const std::vector<Point>& outline, Region& region,
                          const SurfaceCompliance& compliance, const LawOptions& options, const double* wrench,
                          CellContact::Workspace& workspace) {
  if (!(wrench[2] < 0.0)) return false;
  const double smallest = kSmallest * region.area();
  LawOptions without_friction = options;
  without_friction.friction = -1.0;
  double stronger[6];
  std::size_t count = kCoarseCells;
  for (int search = 0; search < kSearches; ++search) {
    const Lattice lattice = region.lattice(count);
    if (!cover(gap, outline, lattice)) return false;
    // A heavier load in the same direction stands in for one that would rest on single cells.
    const double factor = std::max(1.0, spreading_force() / (compliance.factor() * -wrench[2]));
    std::transform(wrench, wrench + 6, stronger, [factor](double part) { return factor * part; });
    const double* heights = gap == nullptr ? nullptr : heights_.data();
    if (!contact_.solve(cells_.face(), kHere, compliance, options, stronger, workspace, heights)) return false;
    pressed_.clear();
    for (std::size_t i = 0; i < heights_.size(); ++i) {
      if (contact_.pressed()[i]) pressed_.push_back(cells_.face().centroids[i]);
    }
    const Region closer = region.around(lattice, pressed_);
    if (closer.area() < smallest) break;  // coordinates have no digits for less
    // A strip narrower than the cells would seem to fill them: look again with longer ones.
    const bool filled = closer.area() > kFilled * region.area() && closer.stretch() <= region.stretch();
    region = closer;
    if (!filled || factor != 1.0) continue;
    if (count == kSearchCells) break;
    count = kSearchCells;
  }
  if (!contact_.weights(cells_.face(), without_friction, stronger, weights_, workspace)) return false;
  motion_ = contact_.motion(cells_.face(), weights_);
  return true;
}

double ClosingPress::approach(const std::vector<double>& weights) const {
  const auto lowest = static_cast<std::size_t>(std::min_element(heights_.begin(), heights_.end()) - heights_.begin());
  return contact_.motion(face(), weights).depth(face().centroids[lowest]);
}

// The cells of a lattice whose middles the body covers.
bool ClosingPress::cover(const GapMap* gap, const std::vector<Point>& outline, const Lattice& lattice) {
  kept_.clear();
  for (std::size_t cell = 0; cell < lattice.cells(); ++cell) {
    const Point middle = lattice.at(static_cast<double>(cell % lattice.columns) + 0.5,
                                    static_cast<double>(cell / lattice.columns) + 0.5);
    const bool over = gap == nullptr ? holds(outline, middle, barely_) : std::isfinite(gap->height(middle.x, middle.y));
    if (over) kept_.push_back(static_cast<std::uint32_t>(cell));
  }
  if (gap == nullptr) {
    if (!cells_.make(lattice, kept_, {})) return false;
    heights_.assign(cells_.face().cells(), 0.0);
    return true;
  }
  // What is smaller than a cell may cover no cell's middle.
  for (const Point& bottom : gap->bottoms()) {
    std::uint32_t cell;
    if (!lattice.cell_at(bottom, cell)) continue;
    if (!has_neighbour(lattice, cell)) kept_.insert(std::lower_bound(kept_.begin(), kept_.end(), cell), cell);
  }
  if (!cells_.make(lattice, kept_, {})) return false;
  mean_heights(*gap);
  for (const Point& bottom : gap->bottoms()) {
    std::uint32_t cell;
    if (!lattice.cell_at(bottom, cell)) continue;
    const std::int32_t place = cells_.place(cell);
    if (place < 0) continue;
    double& height = heights_[static_cast<std::size_t>(place)];
    if (!std::isfinite(height)) height = gap->height(bottom.x, bottom.y);
  }
  return true;
}

// Whether a cell of a lattice, or one about it, is kept.
bool ClosingPress::has_neighbour(const Lattice& lattice, std::uint32_t cell) const {
  const auto columns = static_cast<std::int64_t>(lattice.columns);
  const std::int64_t column = cell % columns, row = cell / columns;
  return std::any_of(kept_.begin(), kept_.end(), [&](std::uint32_t kept) {
    return std::abs(kept % columns - column) <= 1 && std::abs(kept / columns - row) <= 1;
  });
}

// The cells of a lattice that the body covers as far as they lie on the sheet; false where there are none.
bool ClosingPress::cover_on_sheet(const GapMap& gap, const Lattice& lattice) {
  const Rectangle& sheet = gap.sheet();
  const std::size_t across = lattice.columns + 1;
  over_.clear();
  for (std::size_t row = 0; row <= lattice.rows; ++row) {
    for (std::size_t column = 0; column <= lattice.columns; ++column) {
      const Point corner = lattice.at(static_cast<double>(column), static_cast<double>(row));
      const double x = std::min(std::max(corner.x, sheet.west), sheet.east);
      const double y = std::min(std::max(corner.y, sheet.south), sheet.north);
      over_.push_back(std::isfinite(gap.height(x, y)) ? 1 : 0);
    }
  }
  kept_.clear();
  covered_.clear();
  for (std::size_t cell = 0; cell < lattice.cells(); ++cell) {
    const std::uint8_t* first = over_.data() + cell / lattice.columns * across + cell % lattice.columns;
    covered_.push_back(first[0] & first[1] & first[across] & first[across + 1]);
    if (covered_.back()) kept_.push_back(static_cast<std::uint32_t>(cell));
  }
  sheet_ = {{sheet.west, sheet.south}, {sheet.east, sheet.south}, {sheet.east, sheet.north}, {sheet.west, sheet.north}};
  if (!cells_.make(lattice, kept_, sheet_)) return false;
  mean_heights(gap);
  cells_.add_edges();
  return std::all_of(heights_.begin(), heights_.end(), [](double height) { return std::isfinite(height); });
}

// Whether a cell under pressure has a neighbour that the body does not cover: its rim may end the contact.
bool ClosingPress::ends_at_rim(const Lattice& lattice) const {
  for (std::uint32_t cell = 0; cell < lattice.cells(); ++cell) {
    const std::int32_t place = cells_.place(cell);
    if (place < 0 || !contact_.pressed()[static_cast<std::size_t>(place)]) continue;
    const std::size_t column = cell % lattice.columns, row = cell / lattice.columns;
    if (column > 0 && !covered_[cell - 1]) return true;
    if (column + 1 < lattice.columns && !covered_[cell + 1]) return true;
    if (row > 0 && !covered_[cell - lattice.columns]) return true;
    if (row + 1 < lattice.rows && !covered_[cell + lattice.columns]) return true;
  }
  return false;
}

// Heights averaged over each cell, exactly for a quadratic surface; that of the middle where not all of it is covered.
void ClosingPress::mean_heights(const GapMap& gap) {
  heights_.clear();
  for (std::size_t i = 0; i < cells_.face().cells(); ++i) {
    const Point* points = cells_.quadrature(i);
    double mean = 0.0;
    for (int k = 0; k < 4; ++k) mean += gap.height(points[k].x, points[k].y) / 4;
    const Point& middle = cells_.face().centroids[i];
    heights_.push_back(std::isfinite(mean) ? mean : gap.height(middle.x, middle.y));
  }
}

// Force times softness that presses more than a few of the cells.
double ClosingPress::spreading_force() {
  lowest_.assign(heights_.begin(), heights_.end());
  const std::size_t last = std::min(kSpreadCells, lowest_.size()) - 1;
  std::partial_sort(lowest_.begin(), lowest_.begin() + static_cast<std::ptrdiff_t>(last) + 1,
                    lowest_.end());
  const auto& areas = cells_.face().areas;
  const double least = *std::min_element(areas.begin(), areas.end());
  return (lowest_[last] - lowest_.front()) * std::sqrt(least) / kCellGive;
}

}  // namespace mjtactile
