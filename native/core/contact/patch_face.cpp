#include "contact/patch_face.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "contact/laws/cell_contact.hpp"
#include "linalg/angles.hpp"
#include "linalg/dense.hpp"
#include "linalg/kernels.hpp"

namespace mjtactile {
namespace {

// Rectangles of parts whose variances have at least this ratio are turned along the part's length.
constexpr double kSlanted = 2.25;
// A cell beside others is left out under a flat face if less than this fraction of it counts.
constexpr double kSliver = 5e-3;
// A body ends in a cell at a cliff if it is higher beyond than this, over the largest height of cells. Nor does it go
// on if the cell is all but whole.
constexpr double kCliff = 2.0, kNearlyWhole = 0.99;
// Rise of the body across a cell from which it is rough, over the disagreement of neighbours from which these are.
constexpr double kSteep = 4.0;
// Least force on a cell that tells how much its roughness matters, over the mean of cells that press.
constexpr double kLittleForce = 0.3;
// Columns and rows from a cell to those that share a side with it.
constexpr int kSides[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
// Cells longer than this, over the compliance's resolution, have quadrature points.
constexpr double kSpread = 1.0;
// Rectangles at the sheet's edge whose sides have more than the ratio kLong are shortened, if at least the fraction
// kLeastLength of their length is left. The ratio is not one of small whole numbers, as rounding would decide there.
constexpr double kLong = 1.503, kLeastLength = 0.7;
// A rectangle may exceed the room up to the sheet's edge by this fraction, because rounding must not decide whether one
// that ends there is beyond it.
constexpr double kFlush = 1e-9;

// Rise per step through three points at equal distances, from the last one to the first one; 0 if only one of them is
// finite. The middle one counts if another is not finite.
double slope_between(double first, double middle, double last) {
  if (std::isfinite(first) && std::isfinite(last)) return (first - last) / 2.0;
  const double beside = std::isfinite(first) ? first - middle : middle - last;
  return std::isfinite(beside) ? beside : 0.0;
}

}  // namespace

void PatchFace::clear() {
  cells_.clear();
  heights_.clear();
  gradients_.clear();
  goes_on_.clear();
  face_.centroids.clear();
  face_.areas.clear();
  face_.edges.clear();
}

void PatchFace::split(const std::vector<std::uint8_t>& chosen, const HeightWindow& view, double narrowest,
                      std::vector<std::size_t>& from) {
  lattices_.split(chosen, view, narrowest);
  lay(view);
  from.clear();
  for (const Cell& cell : cells_) from.push_back(lattices_.former(cell.lattice, cell.place));
}

void PatchFace::lay(const HeightWindow& view) {
  clear();
  for (std::size_t lattice = 0; lattice < lattices_.size(); ++lattice) {
    for (std::size_t place = 0; place < lattices_[lattice].cells(); ++place) {
      if (lattices_.number(lattice, place) != SampledLattices::kCounted) continue;
      const auto number = static_cast<std::int32_t>(cells_.size());
      lattices_.set_number(lattice, place, cut_out(view, lattice, place) ? number : SampledLattices::kNone);
    }
  }
  find_slivers(view);
  set_heights(view);
}

// Add a cell, without its height. False if too little of it counts.
bool PatchFace::cut_out(const HeightWindow& view, std::size_t number, std::size_t place) {
  const Lattice& lattice = lattices_[number];
  Cell cell = {number, static_cast<std::uint32_t>(place), false, lattice.cosine, lattice.sine,
               {lattice.size, lattice.width()}};
  const auto column = static_cast<double>(place % lattice.columns), row = static_cast<double>(place / lattice.columns);
  Point middle = lattice.middle(place);
  bool goes_on = false;
  CoveredPart covered;
  if (lattices_.follows_ridges(number)) {
    if (!find_covered(lattice, lattices_.spans(number, place), covered)) return false;
    if (!clip(view.map->bounds(), lattice, middle, covered)) return false;
  } else {
    const SampledLattices::Nodes nodes = lattices_.nodes(number, place);
    cell.whole = nodes.under == 9;
    goes_on = nodes.goes_on(kCliff * view.highest);
    const double* const over = nodes.finite == 9 ? nodes.over : nullptr;
    if (!cell.whole && !find_covered({lattice, view, column, row, over}, covered)) return false;
  }
  if (!cell.whole) {
    goes_on = goes_on && covered.area < kNearlyWhole * lattice.size * lattice.width();
    middle = lattice.at(column + 0.5 + covered.x / lattice.size, row + 0.5 + covered.y / lattice.width());
    // Ends are only accurate to a fraction of a cell, so the middle of a sliver may be beyond the sheet.
    if (!view.map->bounds().holds(middle.x, middle.y)) return false;
    replace(lattice, covered, cell);
  }
  cells_.push_back(cell);
  goes_on_.push_back(goes_on ? 1 : 0);
  face_.centroids.push_back(middle);
  return true;
}

// Set a cell to a rectangle with the area of its part that counts, and as long over its width as that. If the part is
// long, the rectangle is turned along it.
void PatchFace::replace(const Lattice& lattice, const CoveredPart& covered, Cell& cell) {
  const double mean = (covered.xx + covered.yy) / 2, apart = std::hypot((covered.xx - covered.yy) / 2, covered.xy);
  double longer = covered.xx, shorter = covered.yy;
  if (mean + apart > kSlanted * (mean - apart)) {
    const double angle = principal_angle(covered.xx, covered.xy, covered.yy);
    const double c = std::cos(angle), s = std::sin(angle);
    cell.cosine = lattice.cosine * c - lattice.sine * s;
    cell.sine = lattice.sine * c + lattice.cosine * s;
    longer = mean + apart;
    shorter = covered.area * covered.area / (144.0 * longer);  // variance of a rectangle of that length and area
  }
  cell.sides[0] = std::sqrt(covered.area * std::sqrt(longer / shorter));
  cell.sides[1] = covered.area / cell.sides[0];
}

// Find the slivers of cells beside others under a flat face. They would bear little, but at a pressure that concerns no
// other cell. Under other bodies a sliver may be a peak, which bears much.
void PatchFace::find_slivers(const HeightWindow& view) {
  slivers_.assign(cells_.size(), 0);
  if (view.map->corners().empty()) return;
  const auto is_sliver = [&](const Cell& cell) {
    const Lattice& lattice = lattices_[cell.lattice];
    return cell.sides[0] * cell.sides[1] < kSliver * lattice.size * lattice.width();
  };
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (!is_sliver(cells_[i])) continue;
    for (const auto& [columns, rows] : kSides) {
      const std::int32_t beside = number_beside(i, columns, rows);
      if (beside >= 0 && !is_sliver(cells_[static_cast<std::size_t>(beside)])) slivers_[i] = 1;
    }
  }
}

// Set heights and gradients of all cells, and number those that stay. Heights are looked up together, because that is
// faster. Slivers and cells without a body above are removed.
void PatchFace::set_heights(const HeightWindow& view) {
  points_.clear();
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Point& middle = face_.centroids[i];
    const Arms arms = arms_of(cells_[i]);
    points_.insert(points_.end(), {{middle.x + arms.ends[0].x, middle.y + arms.ends[0].y},
                                   {middle.x + arms.ends[1].x, middle.y + arms.ends[1].y},
                                   {middle.x - arms.ends[0].x, middle.y - arms.ends[0].y},
                                   {middle.x - arms.ends[1].x, middle.y - arms.ends[1].y}});
  }
  view.map->heights(points_, found_);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const Cell cell = cells_[i];
    Point gradient;
    const double height = mean_height(view, i, gradient);
    const bool stays = std::isfinite(height) && !slivers_[i];
    lattices_.set_number(cell.lattice, cell.place, stays ? static_cast<std::int32_t>(kept) : SampledLattices::kNone);
    if (!stays) continue;
    cells_[kept] = cell, goes_on_[kept] = goes_on_[i], face_.centroids[kept] = face_.centroids[i];
    heights_.push_back(height);
    gradients_.push_back(gradient);
    ++kept;
  }
  cells_.resize(kept), goes_on_.resize(kept), face_.centroids.resize(kept);
}

// Offsets from a cell's middle to its sample points, of which there is one on either side along both axes.
PatchFace::Arms PatchFace::arms_of(const Cell& cell) {
  const double lengths[2] = {cell.sides[0] / std::sqrt(6.0), cell.sides[1] / std::sqrt(6.0)};
  return {{lengths[0], lengths[1]},
          {{cell.cosine * lengths[0], cell.sine * lengths[0]}, {-cell.sine * lengths[1], cell.cosine * lengths[1]}}};
}

// Mean height over a cell from the heights at its four sample points, and its gradient. The mean is exact for a
// quadratic surface. Points without a body above are left out.
double PatchFace::mean_height(const HeightWindow& view, std::size_t own, Point& gradient) const {
  const Cell& cell = cells_[own];
  double sum = 0.0, heights[4];
  int count = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    heights[k] = view.measured(points_[4 * own + k], found_[4 * own + k]);
    if (!std::isfinite(heights[k])) continue;
    sum += heights[k];
    ++count;
  }
  const double middle = count < 4 ? view.height(face_.centroids[own]) : 0.0;
  const Arms arms = arms_of(cell);
  double slopes[2];
  for (std::size_t axis = 0; axis < 2; ++axis) {
    slopes[axis] = slope_between(heights[axis], middle, heights[axis + 2]) / arms.lengths[axis];
  }
  gradient = {cell.cosine * slopes[0] - cell.sine * slopes[1], cell.sine * slopes[0] + cell.cosine * slopes[1]};
  return count > 0 ? sum / count : middle;
}

std::int32_t PatchFace::number_beside(std::size_t own, int columns, int rows) const {
  return lattices_.beside(cells_[own].lattice, cells_[own].place, columns, rows);
}

std::int32_t PatchFace::whole_beside(std::size_t own, int columns, int rows) const {
  const std::int32_t number = number_beside(own, columns, rows);
  return number >= 0 && cells_[static_cast<std::size_t>(number)].whole ? number : -1;
}

// Visit all pairs of neighbours in a lattice of which one presses at least, with what their heights and gradients
// disagree by [m].
template <typename Visit>
void PatchFace::each_pair(const std::vector<std::uint8_t>& pressed, Visit&& visit) const {
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    for (const std::int32_t beside : {number_beside(i, 1, 0), number_beside(i, 0, 1)}) {
      if (beside < 0) continue;
      const auto next = static_cast<std::size_t>(beside);
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

void PatchFace::find_rough(const CellContact& contact, double least, std::vector<std::uint8_t>& rough) const {
  const std::vector<std::uint8_t>& pressed = contact.pressed();
  const std::vector<double>& normal = contact.normal();
  const double* const tilt = contact.slopes();
  const auto count = static_cast<double>(std::count(pressed.begin(), pressed.end(), 1));
  const double mean = std::accumulate(normal.begin(), normal.end(), 0.0) / count;
  const auto weight = [mean](double force) { return std::sqrt(std::max(force / mean, kLittleForce)); };
  rough.assign(cells_.size(), 0);
  each_pair(pressed, [&](std::size_t one, std::size_t other, double apart) {
    if (apart * weight((normal[one] + normal[other]) / 2) > least) rough[one] = rough[other] = 1;
  });
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (!pressed[i]) continue;
    if (rise_across(i, tilt) * weight(normal[i]) > kSteep * least) rough[i] = 1;
  }
}

// Rise of the body, tilted, across a cell [m].
double PatchFace::rise_across(std::size_t own, const double* tilt) const {
  return std::hypot(gradients_[own].x - tilt[0], gradients_[own].y - tilt[1]) * std::sqrt(face_.areas[own]);
}

double PatchFace::flat_share(const CellContact& contact, const std::vector<std::uint8_t>& chosen, double most) const {
  double flat = 0.0, all = 0.0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    if (!chosen[i]) continue;
    all += contact.normal()[i];
    if (rise_across(i, contact.slopes()) <= most) flat += contact.normal()[i];
  }
  return all > 0.0 ? flat / all : 0.0;
}

void PatchFace::find_rim(const std::vector<std::uint8_t>& pressed, std::vector<std::uint8_t>& rim) const {
  rim.assign(cells_.size(), 0);
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    rim[i] = pressed[i] && !cells_[i].whole;
    for (const auto& [columns, rows] : kSides) rim[i] |= pressed[i] && number_beside(i, columns, rows) < 0;
  }
}

void PatchFace::add_ends(const std::vector<std::uint8_t>& pressed, std::vector<std::uint8_t>& to) const {
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    for (const auto& [columns, rows] : kSides) {
      const std::int32_t beside = number_beside(i, columns, rows);
      if (beside >= 0 && pressed[static_cast<std::size_t>(beside)] != pressed[i]) to[i] = 1;
    }
  }
}

std::size_t PatchFace::count_splittable(const std::vector<std::uint8_t>& chosen, double narrowest) const {
  std::size_t count = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) count += chosen[i] && lattices_.splits(cells_[i].lattice, narrowest);
  return count;
}

void PatchFace::find_around(const std::vector<std::uint8_t>& pressed, std::vector<std::uint8_t>& around) const {
  around = pressed;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    for (int k = 0; k < 9 && !around[i]; ++k) {
      const std::int32_t beside = number_beside(i, k % 3 - 1, k / 3 - 1);
      if (beside >= 0 && pressed[static_cast<std::size_t>(beside)]) around[i] = 1;
    }
  }
}

// Shorten the long rectangle that replaces a part to what there is room for along x and y. False if it is not long, or
// if too little is left.
bool PatchFace::shortened(const double* room, Cell& cell) {
  const std::size_t longer = cell.sides[0] >= cell.sides[1] ? 0 : 1;
  if (!(cell.sides[longer] > kLong * cell.sides[1 - longer])) return false;
  const double c = std::abs(cell.cosine), s = std::abs(cell.sine);
  const double along[2] = {longer == 0 ? c : s, longer == 0 ? s : c};
  double length = cell.sides[longer];
  for (std::size_t k = 0; k < 2; ++k) {
    const double left = room[k] - along[1 - k] * cell.sides[1 - longer];
    if (length * along[k] > left) length = left / along[k];
  }
  if (!(length >= kLeastLength * cell.sides[longer])) return false;
  cell.sides[longer] = length;
  return true;
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
  if (shortened(room, cell)) return;
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
    face_.areas.push_back(cell.sides[0] * cell.sides[1]);
    area += face_.areas.back();
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
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const bool between = cells_[i].whole && whole_beside(i, -1, 0) >= 0 && whole_beside(i, 1, 0) >= 0;
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
    for (std::size_t k = 0; k < face.lattices_.size(); ++k) {
      const Lattice& lattice = face.lattices_[k];
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
  integrals.clear(count);
  PairShear alone = {};
  std::vector<double> middles;   // (2, cells)
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
    face_.edges.push_back({start, end, left, right});
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
    const auto x = static_cast<double>(cell.place % lattice.columns);
    const auto y = static_cast<double>(cell.place / lattice.columns);
    const Point corners[4] = {lattice.at(x, y), lattice.at(x + 1, y), lattice.at(x + 1, y + 1), lattice.at(x, y + 1)};
    // Its right and upper edges; also the left and lower ones if no neighbour adds them.
    add(corners[1], corners[2], own, whole_beside(i, 1, 0));
    add(corners[2], corners[3], own, whole_beside(i, 0, 1));
    if (whole_beside(i, -1, 0) < 0) add(corners[3], corners[0], own, -1);
    if (whole_beside(i, 0, -1) < 0) add(corners[0], corners[1], own, -1);
  }
}

}  // namespace mjtactile
