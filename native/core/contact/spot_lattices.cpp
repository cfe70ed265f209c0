#include "contact/spot_lattices.hpp"

#include <algorithm>
#include <cmath>

#include "contact/cells/covered_part.hpp"
#include "contact/solvers/height_power.hpp"

namespace mjtactile {
namespace {

// Sides and areas of spots are whole numbers of the search's samples. Limits on their ratios are not ratios of small
// whole numbers, because rounding would decide at such ratios.
constexpr double kAsLongAsWide = 2.003;  // largest length of a compact spot over its width
constexpr double kLeastWider = 1.5;      // least size of a region over that of the spot
constexpr double kTrimmed = 0.6;         // least share of an open spot's region that is kept
constexpr double kElongated = 3.003;     // spots that are longer than this, over their width, do not count as open

// Number of cells.
constexpr double kMostCells = 2.0;       // largest number is this times the number asked for,
constexpr double kMoreCells = 24.0;      // plus this
constexpr double kMostCompact = 1.5;     // a compact spot gets at most this many times the number asked for, or
                                         // kMoreCells more: its cells are much alike, and others add little
constexpr double kCheap = 2.0;           // factor on the wanted number under laws without compliance
constexpr double kFilled = 0.7;          // spots that fill less than this of their rectangle get more cells,
constexpr double kMostFilling = 3.0;     // up to this factor,
constexpr double kMostFillingStrips = 2.0;   // or up to this one if their cells follow ridges
constexpr double kLeastShare = 4.0;      // least number of cells of a spot
constexpr double kAskew = 1.27;          // mean number of lattice cells that a line of any direction crosses, over the
                                         // number along an axis of the lattice
constexpr double kTooFew = 0.85;         // smaller cells are laid if there are fewer than this share of those wanted,
constexpr double kLeastFiner = 0.25;     // with at least this share of their area
constexpr double kNearly = 1.1;          // symmetric bodies may have this many cells, over the largest number
constexpr double kLeastCoarser = 1.25;   // least factor by which cells grow if there are too many,
constexpr int kRounds = 10;              // and largest number of times
// Strips along ridges.
constexpr double kNarrowStrip = 2.0;     // a strip up to this many cells wide is narrow: its cells are made as wide,
constexpr double kStripCell = 1.3;       // times this, so that a slanted strip is within them, too
constexpr double kMostSamples = 32.0;    // largest number of heights computed per cell
// Parallel ridges divide a region's height into one part less than they are. Lines half a cell apart tell them from
// each other if cells are smaller than such a part by this factor,
constexpr double kTelling = 1.6;
constexpr double kManyTelling = 150.0;   // and if they are not more than these

// Centre a region on a point, if it is within a cell of the region's middle. The point is the middle of a symmetric
// body, and the cells then move with a sliding body.
void centre_on(const Point& at, double cell, Region& region) {
  const double c = std::cos(region.angle), s = std::sin(region.angle);
  const double x = at.x - region.centre.x, y = at.y - region.centre.y;
  const double along = c * x + s * y, across = c * y - s * x;
  if (std::abs(along) <= cell) {
    region.centre.x += along * c, region.centre.y += along * s;
    region.width += 2.0 * std::abs(along);
  }
  if (std::abs(across) <= std::min(cell, region.height / 4)) {
    region.centre.x -= across * s, region.centre.y += across * c;
    region.height += 2.0 * std::abs(across);
  }
}

// Make a region hold a flat face's low corners, by which the lines pass on which it was trimmed. `largest`: what the
// region may grow to, roughly.
void include_corners(const HeightWindow& seen, const Region& largest, Region& region) {
  for (const Point& corner : seen.map->corners()) {
    if (!largest.holds(corner) || region.holds(corner)) continue;
    if (seen.height(corner) <= seen.highest) region.include(corner);
  }
}

}  // namespace

bool SpotLattices::is_compact(const std::vector<Spot>& spots, const LawOptions& options) {
  if (spots.size() != 1) return false;
  const Spot& spot = spots.front();
  // If the cells have the least width, they are few, and the end of the contact in the outermost ones is not resolved.
  const double cell = spot.area * std::sqrt(kHeightFactor) / static_cast<double>(options.cells);
  if (cell < options.narrowest * options.narrowest) return false;
  const Region region = spot.region.lengthwise();
  return region.width < kAsLongAsWide * region.height && !spot.is_open();
}

void SpotLattices::lay(const Look& look, SampledLattices& lattices) {
  if (look.along_ridges() && lay_along_ridges(look, lattices)) return;
  Look elsewhere = look;
  elsewhere.strip = 0.0;
  follows_.assign(look.spots.size(), 0);
  lay_all(elsewhere, lattices);
}

// False if a strip is wide for its cells, which then need not follow the ridge.
bool SpotLattices::lay_along_ridges(const Look& look, SampledLattices& lattices) {
  follows_.clear();
  for (const Spot& spot : look.spots) follows_.push_back(spot.is_open() ? 1 : 0);
  lay_all(look, lattices);
  for (std::size_t k = 0; k < look.spots.size(); ++k) {
    if (follows_[k] && look.spots[k].area >= kNarrowStrip * lattices[k].size * look.spots[k].length) return false;
  }
  return true;
}

void SpotLattices::lay_all(const Look& look, SampledLattices& lattices) {
  set_regions(look);
  const Number number = number_of_cells(look);
  double coarser = 1.0;   // factor on the cells' area
  for (int round = 0; round < kRounds; ++round) {
    lattices.clear(look.along_ridges());
    for (std::size_t k = 0; k < look.spots.size(); ++k) {
      const Lattice lattice = lattice_over(look, k, number.wanted, coarser);
      if (follows_[k]) {
        lattices.add_along_ridges(lattice, look.seen, {regions_, k}, look.strip);
      } else {
        lattices.add(lattice, look.seen, {regions_, k});
      }
    }
    lattices.settle(regions_);
    const auto count = static_cast<double>(lattices.counted());
    if (round == 0 && count < kTooFew * number.wanted && look.options.law->shapes() && !look.along_ridges()) {
      // The body ends, or rises more steeply, than was assumed.
      coarser = std::max(count / number.wanted, kLeastFiner);
      continue;
    }
    if (count <= kNearly * number.most) break;
    coarser *= std::max(kLeastCoarser, count / number.most);
  }
}

// Bent and open spots get more cells, and each spot gets its own. Laws without compliance get more cells as well,
// because they are cheap.
SpotLattices::Number SpotLattices::number_of_cells(const Look& look) const {
  const LawOptions& options = look.options;
  const double cells = (options.law->shapes() ? look.finer : kCheap) * static_cast<double>(options.cells);
  Number number = {0.0, kMostCells * cells + kMoreCells};
  for (const Spot& spot : look.spots) {
    const double filled = spot.area / spot.region.area();
    const double most = look.along_ridges() ? kMostFillingStrips : kMostFilling;
    double wanted = cells * std::min(std::max(kFilled / filled, 1.0), most);
    if (look.along_ridges()) {
      const Region region = spot.region.lengthwise();
      const double between = std::max(spot.length / region.width - 1.0, 0.0) / region.height;
      wanted = std::max(wanted, std::min(kTelling * kAskew * spot.length * between, kManyTelling));
      number.most = std::max(number.most, wanted);
    }
    number.wanted += wanted;
  }
  if (options.law->couples() && look.search.level() > 0.0 && is_compact(look.spots, options)) {
    number.most = std::min(number.most, std::max(kMostCompact * cells, cells + kMoreCells));
  }
  number.wanted = std::min(number.wanted, number.most);
  return number;
}

// Set the regions around the spots in which the body may touch. They assume that the height grows linearly beyond a
// spot.
void SpotLattices::set_regions(const Look& look) {
  const ContactSearch& search = look.search;
  // The level of a flat face is 0.
  const double wider = search.level() > 0.0 ? std::max(look.seen.highest / search.level(), kLeastWider) : kLeastWider;
  regions_.clear();
  for (std::size_t k = 0; k < look.spots.size(); ++k) {
    const Spot& spot = look.spots[k];
    Region region = spot.region.lengthwise();
    if (follows_[k] || look.everywhere) {
      regions_.push_back(region);
      continue;
    }
    // A line into a bent or hollow region may meet nothing of the body for a long way, so most of it is kept.
    const bool open = spot.is_open() && region.width < kElongated * region.height;
    const Region largest = {region.centre, region.angle, wider * region.width, wider * region.height};
    trim(look.seen, open ? kTrimmed : 0.0, wider, region);
    // Pressure rises toward corners, unless the load is more than the pad can bear.
    if (!search.lacks_area()) include_corners(look.seen, largest, region);
    region.width *= kWithin, region.height *= kWithin;
    regions_.push_back(region.lengthwise());
  }
}

// The lattice of cells over a spot. `cells`: wanted number in all; `coarser`: factor on the cells' area.
Lattice SpotLattices::lattice_over(const Look& look, std::size_t number, double cells, double coarser) const {
  const ContactSearch& search = look.search;
  const double narrowest = look.options.narrowest;
  const Spot& spot = look.spots[number];
  double roots = 0.0;
  for (const Spot& one : look.spots) roots += std::sqrt(one.area);
  const double share = std::max(cells * std::sqrt(spot.area) / roots, kLeastShare);
  const bool breaks = search.loaded() * kHeightFactor < search.level();
  const double higher = breaks ? kBoundedHeightFactor : std::max(look.height_factor, kHeightFactor);
  double cell = spot.area * std::sqrt(higher) / share;
  // If the body's area grows fast with the height, the contact is larger than the area below the level.
  const double power =
      height_power(look.seen.highest / search.level(), regions_[number].area() / spot.region.lengthwise().area());
  if (power > 0.0) cell *= std::max(std::pow(end_over_level(power), 2.0 / power), 1.0);
  // Side of the cells if `share` of them lie along a line of the spot's length at any angle to the lattice.
  const double askew = kAskew * spot.length / share;
  if (spot.is_open()) cell = std::max(cell, askew * askew);
  Region region = regions_[number];
  if (follows_[number]) {
    // A cell holds the whole width of a narrow strip, because parts of it would not lie along it.
    const double strip = spot.area / spot.length, side = kStripCell * strip;
    if (strip < kNarrowStrip * std::sqrt(cell)) cell = std::max(cell, side * side);
    // Nor does it end at a straight strip's sides, between which a ridge that is not quite straight is lost.
    region.height = std::max(region.height, std::max(std::sqrt(cell), narrowest));
  }
  cell = std::max({cell, region.area() / (kMostSamples * cells), narrowest * narrowest}) * coarser;
  // The spot may be a small sample of a larger body, so no region is smaller than the narrowest cell.
  if (!(region.area() > 0.0) || std::max(region.width, region.height) < narrowest) {
    region.width = std::max(region.width, narrowest);
    region.height = std::max(region.height, narrowest);
  }
  if (coarser > 1.0 && region.area() < cell) {
    // One cell of the wanted area. It keeps the region's length if that is long enough.
    const double longer = std::max({region.width, region.height, std::sqrt(cell)});
    const bool along = region.width > region.height;
    region.width = along ? longer : cell / longer;
    region.height = along ? cell / longer : longer;
  }
  if (look.spots.size() == 1) centre_on(look.seen.middle, std::sqrt(cell), region);
  return region.lattice(cell, narrowest);
}

}  // namespace mjtactile
