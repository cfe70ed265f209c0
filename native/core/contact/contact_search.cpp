#include "contact/contact_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "linalg/angles.hpp"
#include "linalg/kernels.hpp"

namespace mjtactile {
namespace {

// The grid on a part is refined until at least kEnough points are below the level, at most kLooks times.
constexpr std::size_t kEnough = 25;
constexpr int kLooks = 4, kBisections = 16, kStripBisections = 8;
// The level is bisected until at most this many samples lie between the bounds. Then their heights are bisected.
constexpr std::size_t kFewSamples = 16;
// Samples that are higher than the level by less than this share count as below it. Nearly symmetric bodies have pairs
// of samples of nearly equal heights, and a level between the two would make the contact one-sided.
constexpr double kTogether = 1e-3;
// Largest number of parts that are sampled on their own. If there are more, they are treated as one part.
constexpr std::size_t kMostParts = 64;
// Points within this many grid steps belong to one part, because the grid misses some points of narrow contacts.
constexpr int kNear = 2;
// Parts are collected up to the level that carries this multiple of the load, because slightly higher ones may touch.
constexpr double kSpare = 4.0;
// A part without points below the level is kept if it has some below this multiple of it.
constexpr double kReached = 2.5;
// A part is long if its standard deviation along is more than this multiple of that across. The value is not a ratio
// that small counts of samples can have, so that rounding does not decide.
constexpr double kElongated = 1.503;
// A row of points is no wider than this, over their distance.
constexpr double kOneRow = 1.503;
// A load within this distance of a spring acts on it, over the length of the sampled area.
constexpr double kOnSpring = 1e-6;
// A load may pass beside the parts by this, over the extent: forces on the sheet's rim do by rounding.
constexpr double kOnRim = 1e-9;
// Springs are first laid under samples up to this height, over the level.
constexpr double kLowSprings = 6.003;
// Stiffness of the springs that resist any tilt, over that of the others; and the slope up to which they do.
constexpr double kLevelling = 1e-6, kSteepest = 10.0;
// Contacts are searched for along ridges if these are at least this long, over the length of the spots that were found,
// and if kMostlyNarrow of this length is of parts narrower than kNarrowPart, over the length of the region about them.
// The lengths are estimates, each off by a factor of 1.3 at most. No value is a ratio that counts of samples have.
constexpr double kLongRidges = 0.603, kMostlyNarrow = 0.503, kNarrowPart = 0.203;
// Largest number of points at which the grid's lines cross ridges. Each takes some 18 heights. A ring has some 130. A
// sharp edge, of which the grid sees little, has less than two for each of the lines.
constexpr std::size_t kMostCrossings = 512, kMostOfEdges = 100;
// The grid misses most of a sharp edge if the spots it sees are shorter than this share of it. A strip along it is then
// made twice as high, at most kWidenings times, until it bears the load.
constexpr double kMissedEdge = 0.503;
constexpr int kWidenings = 8;
// Ridges' heights are found up to this share of the level that these spots would need.
constexpr double kRidgeTolerance = 0.1;
// Perimeter of a circle over that of its staircase outline on a grid, pi / 4.
constexpr double kRound = kHalfTurn / 4;

bool is_outside(const Point& at, const std::vector<Region>& regions) {
  return std::none_of(regions.begin(), regions.end(), [&](const Region& one) { return one.holds(at); });
}

}  // namespace

Region region_about(const std::vector<Point>& points, const double sides[2], double angle, const HeightMap& map) {
  const double count = static_cast<double>(points.size()), c = std::cos(angle), s = std::sin(angle);
  Point middle = {0.0, 0.0};
  for (const Point& point : points) middle.x += point.x / count, middle.y += point.y / count;
  double xx = (c * c * sides[0] * sides[0] + s * s * sides[1] * sides[1]) / 12;
  double yy = (s * s * sides[0] * sides[0] + c * c * sides[1] * sides[1]) / 12;
  double xy = c * s * (sides[0] * sides[0] - sides[1] * sides[1]) / 12;
  for (const Point& point : points) {
    const double x = point.x - middle.x, y = point.y - middle.y;
    xx += x * x / count, xy += x * y / count, yy += y * y / count;
  }
  const double mean = (xx + yy) / 2, apart = std::hypot((xx - yy) / 2, xy);
  const bool elongated = mean + apart > kElongated * kElongated * (mean - apart);
  const double turned = elongated ? map.straightened(0.5 * std::atan2(2.0 * xy, xx - yy)) : 0.0;
  const double cosine = std::cos(turned), sine = std::sin(turned);
  const double along = std::abs(cosine * c + sine * s), across = std::abs(cosine * s - sine * c);
  const double half[2] = {(along * sides[0] + across * sides[1]) / 2, (across * sides[0] + along * sides[1]) / 2};
  double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
  for (const Point& point : points) {
    const double place[2] = {cosine * point.x + sine * point.y, -sine * point.x + cosine * point.y};
    for (int i = 0; i < 2; ++i) {
      low[i] = std::min(low[i], place[i] - half[i]);
      high[i] = std::max(high[i], place[i] + half[i]);
    }
  }
  const double x = (low[0] + high[0]) / 2, y = (low[1] + high[1]) / 2;
  return {{cosine * x - sine * y, sine * x + cosine * y}, turned, high[0] - low[0], high[1] - low[1]};
}

bool ContactSearch::look(const HeightMap& map) {
  least_ = kNowhere;
  bounds_ = map.bounds();
  const double width = bounds_.east - bounds_.west, height = bounds_.north - bounds_.south;
  if (!(width > 0.0 && height > 0.0)) return false;
  step_[0] = width / kLines, step_[1] = height / kLines;
  spacing_ = std::max(step_[0], step_[1]);
  points_.resize(kLines * kLines);
  moved_.clear();
  Point diagonal[kLines];
  for (std::size_t line = 0; line < kLines; ++line) diagonal[line] = grid_point(line * (kLines + 1));
  for (std::size_t sample = 0; sample < kLines * kLines; ++sample) {
    points_[sample] = {diagonal[sample % kLines].x, diagonal[sample / kLines].y};
  }
  map.heights(points_, raw_);
  grid_ = raw_;
  for (const Point& at : map.candidates()) {
    const double height_there = map.height(at.x, at.y);
    if (std::isfinite(height_there)) offer(at, height_there);
  }
  corners_ = map.corners();
  look_at_rim(map);
  least_ = *std::min_element(raw_.begin(), raw_.end());
  return std::isfinite(least_);
}

// The grid's column or row that is some steps from its first side.
std::size_t ContactSearch::line_at(double steps) {
  return static_cast<std::size_t>(std::min(std::max(steps, 0.0), kLines - 1.0));
}

// The sample in whose cell of the grid a point lies.
std::size_t ContactSearch::sample_about(const Point& at) const {
  return line_at((at.y - bounds_.south) / step_[1]) * kLines + line_at((at.x - bounds_.west) / step_[0]);
}

// Replace the grid point of the cell in which a point lies, if the point is lower. Of several equally low ones, the one
// nearest to the grid point is used. A point on the line between cells, within rounding, is offered to all of them.
void ContactSearch::offer(const Point& at, double height) {
  const double column = (at.x - bounds_.west) / step_[0], row = (at.y - bounds_.south) / step_[1];
  for (std::size_t j = line_at(row - Lattice::kOnLine); j <= line_at(row + Lattice::kOnLine); ++j) {
    for (std::size_t i = line_at(column - Lattice::kOnLine); i <= line_at(column + Lattice::kOnLine); ++i) {
      const std::size_t sample = j * kLines + i;
      const Point middle = grid_point(sample), &kept = points_[sample];
      const bool nearer =
          std::hypot(at.x - middle.x, at.y - middle.y) < std::hypot(kept.x - middle.x, kept.y - middle.y);
      if (!(height < raw_[sample] - (nearer ? -same() : same()))) continue;
      points_[sample] = at, raw_[sample] = height;
      moved_.push_back(sample);
    }
  }
}

// Sample the heights on the sheet's rim where the body goes on beyond it.
void ContactSearch::look_at_rim(const HeightMap& map) {
  const Rectangle whole = map.whole();
  const bool beyond[4] = {whole.west < bounds_.west, whole.south < bounds_.south, whole.east > bounds_.east,
                          whole.north > bounds_.north};
  const double inside[2] = {(1.0 - kWithin) * (bounds_.east - bounds_.west),
                            (1.0 - kWithin) * (bounds_.north - bounds_.south)};
  const double ends[4] = {bounds_.west + inside[0], bounds_.south + inside[1], bounds_.east - inside[0],
                          bounds_.north - inside[1]};
  rim_count_ = 0;
  for (std::size_t number = 0; number < 4; ++number) {
    if (!beyond[number]) continue;
    RimSide& side = rim_[rim_count_++];
    const bool along_y = number % 2 == 0;
    const double sign = number < 2 ? 1.0 : -1.0;
    side.inward = {along_y ? sign : 0.0, along_y ? 0.0 : sign};
    side.points.clear();
    for (std::size_t line = 0; line < kLines; ++line) {
      Point at = grid_point(line * (kLines + 1));
      (along_y ? at.x : at.y) = ends[number];
      side.points.push_back(at);
    }
    map.heights(side.points, side.heights);
  }
}

// Grid points are the middles of equal cells of the bounds, because the body ends at the bounds themselves.
Point ContactSearch::grid_point(std::size_t sample) const {
  return {bounds_.west + (bounds_.east - bounds_.west) * (static_cast<double>(sample % kLines) + 0.5) / kLines,
          bounds_.south + (bounds_.north - bounds_.south) * (static_cast<double>(sample / kLines) + 0.5) / kLines};
}

void ContactSearch::set_heights(const Plane& plane) {
  const std::size_t count = raw_.size();
  heights_.resize(count);
  // Local copies, so that the compiler vectorises the loops.
  double* const heights = heights_.data();
  const double* const raw = raw_.data();
  const Point* const at = points_.data();
  const Plane from = plane;
  for (std::size_t i = 0; i < count; ++i) heights[i] = raw[i] - from(at[i].x, at[i].y);
  double least[4] = {kNowhere, kNowhere, kNowhere, kNowhere};  // four independent minima for speed
  for (std::size_t i = 0; i + 4 <= count; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) least[k] = std::min(least[k], heights[i + k]);
  }
  for (std::size_t i = count - count % 4; i < count; ++i) least[0] = std::min(least[0], heights[i]);
  const double lowest = lowest_ = std::min({least[0], least[1], least[2], least[3]}), level = same();
  for (std::size_t i = 0; i < count; ++i) heights[i] = levelled(heights[i] - lowest, level);
}

// Raise the level until the parts below it carry kSpare times the load or the contact ends, then connect the parts.
void ContactSearch::flood(const SearchLoad& load) {
  rising_.begin(heights_);
  const double cell = bounds_.area() / (kLines * kLines);
  under_.assign(heights_.size(), 0);
  double around = 0.0, area = 0.0;
  sees_all_ = true;
  for (; !rising_.empty(); rising_.take_lowest()) {
    const auto [height, sample] = rising_.lowest();
    const bool carried = kRound * load.modulus * around / 2 * height >= kSpare * load.force && area >= load.least_area;
    if ((carried && height > std::max((1.0 + kTogether) * level_ + same(), load.reach)) || height > load.end) {
      sees_all_ = false;
      break;
    }
    level_ = height;
    area += cell;
    under_[sample] = 1;
    const std::size_t column = sample % kLines, row = sample / kLines;
    const std::size_t across = (column > 0 && under_[sample - 1]) + (column + 1 < kLines && under_[sample + 1]);
    const std::size_t along = (row > 0 && under_[sample - kLines]) + (row + 1 < kLines && under_[sample + kLines]);
    around += 2.0 * ((1.0 - static_cast<double>(along)) * step_[0] + (1.0 - static_cast<double>(across)) * step_[1]);
  }
  connect();
}

// Join samples below the level that are near each other.
void ContactSearch::connect() {
  constexpr auto kLast = static_cast<int>(kLines) - 1;
  flooded_.clear();
  sets_.reset(heights_.size());
  for (std::size_t at = 0; at < under_.size(); ++at) {
    const void* const next = std::memchr(under_.data() + at, 1, under_.size() - at);
    if (next == nullptr) break;
    at = static_cast<std::size_t>(static_cast<const std::uint8_t*>(next) - under_.data());
    flooded_.push_back(at);
  }
  for (const std::size_t sample : flooded_) {
    const auto column = static_cast<int>(sample % kLines), row = static_cast<int>(sample / kLines);
    // If the sample to the left is below the level, it has been joined to all samples near both.
    const bool beside = column > 0 && under_[sample - 1];
    for (int j = std::max(row - kNear, 0); j <= row; ++j) {
      const int first = !beside ? column - kNear : j < row ? column + kNear : column - 1;
      for (int i = std::max(first, 0); i <= std::min(j < row ? column + kNear : column - 1, kLast); ++i) {
        const std::size_t other = static_cast<std::size_t>(j) * kLines + static_cast<std::size_t>(i);
        if (under_[other]) sets_.join(sample, other);
      }
    }
  }
}

void ContactSearch::gather_parts() {
  labels_.resize(heights_.size());
  std::size_t count = 0;
  for (const std::size_t sample : flooded_) {
    if (sets_.root(sample) == sample) labels_[sample] = count++;
  }
  const bool together = count > kMostParts;
  part_count_ = together ? 1 : count;
  if (members_.size() < part_count_) members_.resize(part_count_);
  if (parts_.size() < part_count_) parts_.resize(part_count_);
  for (std::size_t k = 0; k < part_count_; ++k) members_[k].clear();
  owners_.assign(heights_.size(), nullptr);
  for (const std::size_t sample : flooded_) {
    const std::size_t part = together ? 0 : labels_[sets_.root(sample)];
    members_[part].push_back(grid_point(sample));
    owners_[sample] = &parts_[part];
  }
  for (std::size_t k = 0; k < part_count_; ++k) {
    Region region = region_about(members_[k], step_, 0.0, *map_);
    region.width += 2.0 * spacing_;
    region.height += 2.0 * spacing_;
    parts_[k].region = region;
    parts_[k].thin = false;
  }
}

Point ContactSearch::point_of(const Part& part, std::size_t place) const {
  const double u = (static_cast<double>(place % kCloser) + 0.5) / kCloser - 0.5;
  const double v = (static_cast<double>(place / kCloser) + 0.5) / kCloser - 0.5;
  const double x = kWithin * u * part.region.width, y = kWithin * v * part.region.height;
  return {part.region.centre.x + part.cosine * x - part.sine * y,
          part.region.centre.y + part.sine * x + part.cosine * y};
}

void ContactSearch::look_closer(const HeightMap& map, const Plane& plane, Part& part) {
  part.cosine = std::cos(part.region.angle), part.sine = std::sin(part.region.angle);
  closer_.clear();
  for (std::size_t place = 0; place < kCloser * kCloser; ++place) closer_.push_back(point_of(part, place));
  map.heights(closer_, part.heights);
  for (std::size_t place = 0; place < closer_.size(); ++place) {
    const Part* const owner = owners_[sample_about(closer_[place])];
    const bool other = owner != nullptr && owner != &part;   // as of a body inside a ring
    part.heights[place] = other ? kNowhere : part.heights[place] - plane(closer_[place].x, closer_[place].y) - lowest_;
  }
}

// Add what lies below a level in a part.
void ContactSearch::add_below(const Part& part, Below& below) {
  const PointsBelow found = kernels().count_below(part.heights.data(), kCloser, kCloser, below.level);
  below.points += found.points;
  below.area += static_cast<double>(found.points) * part.cell();
  below.perimeter += static_cast<double>(found.edges_x) * part.region.height / kCloser +
                     static_cast<double>(found.edges_y) * part.region.width / kCloser;
}

ContactSearch::Below ContactSearch::all_below(double level) const {
  Below below = {level};
  for (std::size_t k = 0; k < part_count_; ++k) add_below(parts_[k], below);
  return below;
}

// The same, with samples that are higher by rounding only. Rows of samples along an edge have equal heights, and a part
// of a row has a longer perimeter than the whole row.
ContactSearch::Below ContactSearch::all_up_to(double level) const {
  Below below = all_below(level + same());
  below.level = level;
  return below;
}

// Find the level at which all parts together carry the load.
void ContactSearch::set_level(const SearchLoad& load) {
  double deepest = 0.0, highest = 0.0;
  for (std::size_t k = 0; k < part_count_; ++k) {
    for (const double one : parts_[k].heights) {
      if (!std::isfinite(one)) continue;
      deepest = std::min(deepest, one);
      highest = std::max(highest, one);
    }
  }
  if (deepest < -same()) {  // a closer look found a lower point
    lowest_ += deepest;
    highest -= deepest;
  } else {
    deepest = 0.0;
  }
  for (std::size_t k = 0; k < part_count_; ++k) {
    for (double& one : parts_[k].heights) one = levelled(one - deepest, same());
  }
  highest = levelled(highest, same());
  level_ = loaded_ = level_for(load, 0.0, highest);
  if (all_below(level_).area < load.least_area) level_ = level_for(load, load.least_area, highest);
  level_ = std::min(level_, load.end), loaded_ = std::min(loaded_, load.end);
}

// The least level below which the parts carry the load and have an area. If there is none, the highest one.
double ContactSearch::level_for(const SearchLoad& load, double least_area, double highest) {
  const auto stiffness = [&](const Below& below) { return kRound * load.modulus * below.perimeter / 2; };
  const auto carries = [&](const Below& below) {
    return stiffness(below) * below.level >= load.force && below.area >= least_area;
  };
  if (!(highest > 0.0)) return 0.0;
  Below low = all_up_to(0.0), high = all_up_to(highest);
  if (!carries(high)) return highest + same();
  for (int step = 0; step < kBisections && high.points > low.points + kFewSamples; ++step) {
    const Below middle = all_up_to((low.level + high.level) / 2);
    (carries(middle) ? high : low) = middle;
  }
  between_.clear();
  for (std::size_t k = 0; k < part_count_; ++k) {
    for (const double one : parts_[k].heights) {
      if (one > low.level && one <= high.level) between_.push_back(one);
    }
  }
  std::sort(between_.begin(), between_.end());
  for (std::size_t first = 0, last = between_.size(); first < last;) {
    const std::size_t middle = (first + last) / 2;
    const Below next = all_up_to(between_[middle]);
    if (carries(next)) {
      high = next, last = middle;
    } else {
      low = next, first = middle + 1;
    }
  }
  // From one sample's height to the next, the perimeter and the area do not change.
  const double exact = low.area >= least_area ? std::max(load.force / stiffness(low), low.level) : highest;
  return (1.0 + kTogether) * std::min(exact, high.level) + same();
}

// The rectangle around the points of a part below a level. Sets their area [m^2] and their number.
Region ContactSearch::region_under(const Part& part, double level, double& area, std::size_t& count) {
  chosen_.clear();
  for (std::size_t place = 0; place < part.heights.size(); ++place) {
    if (part.heights[place] <= level) chosen_.push_back(point_of(part, place));
  }
  count = chosen_.size();
  area = static_cast<double>(count) * part.cell();
  const double sides[2] = {part.width(), part.height()};
  if (chosen_.empty()) return {};
  return region_about(chosen_, sides, part.region.angle, *map_);
}

// How far the points of a part are from one another along a region's sides [m]. The part ends somewhere between the
// last point below the level and the next one.
Point ContactSearch::end_of(const Part& part, const Region& region) {
  const double c = std::abs(std::cos(region.angle - part.region.angle));
  const double s = std::abs(std::sin(region.angle - part.region.angle));
  return {c * part.width() + s * part.height(), s * part.width() + c * part.height()};
}

// Whether a look saw one row of the body's points, all of them below the level, as of a wire thinner than their
// distance. A look as far beyond it across as along would see one row again.
bool ContactSearch::is_one_row(const Part& part, const Region& below, std::size_t count) {
  const Point end = end_of(part, below);
  if (!(below.width < kOneRow * end.x || below.height < kOneRow * end.y)) return false;
  const std::vector<double>& heights = part.heights;
  const auto seen = std::count_if(heights.begin(), heights.end(), [](double one) { return std::isfinite(one); });
  return static_cast<std::size_t>(seen) == count;
}

const std::vector<Spot>& ContactSearch::find(const HeightMap& map, const Plane& plane, const SearchLoad& load) {
  map_ = &map;
  spots_.clear();
  level_ = 0.0;
  set_heights(plane);
  flood(load);
  gather_parts();
  for (std::size_t k = 0; k < part_count_; ++k) look_closer(map, plane, parts_[k]);
  set_level(load);
  double area;
  std::size_t count;
  for (int look = 1; look < kLooks; ++look) {
    bool closer = false;
    for (std::size_t k = 0; k < part_count_; ++k) {
      Part& part = parts_[k];
      const Region region = region_under(part, level_, area, count);
      if (count == 0 || count >= kEnough) continue;
      part.thin = part.thin || is_one_row(part, region, count);
      const double wide = std::max(part.width(), part.height());
      const Point margin = part.thin ? end_of(part, region) : Point{wide, wide};
      part.region = region;
      part.region.width += 2.0 * margin.x;
      part.region.height += 2.0 * margin.y;
      look_closer(map, plane, part);
      closer = true;
    }
    if (!closer) break;
    set_level(load);
  }
  reached_ = level_;
  for (std::size_t k = 0; k < part_count_; ++k) {
    const Part& part = parts_[k];
    double level = std::max(level_, load.reach);
    Region region = region_under(part, level, area, count);
    if (count == 0) level *= kReached, region = region_under(part, level, area, count);
    if (count == 0) continue;
    reached_ = std::max(reached_, level);
    const Point margin = end_of(part, region);
    region.width += margin.x;
    region.height += margin.y;
    Below below = {level};
    add_below(part, below);
    spots_.push_back({region, area, kRound * below.perimeter / 2});
  }
  follow_ridges(map, plane, load);
  add_rim_strips(map, plane);
  return spots_;
}

Spot ContactSearch::everything() const {
  const double width = bounds_.east - bounds_.west, height = bounds_.north - bounds_.south;
  return {{bounds_.middle(), 0.0, width, height}, width * height, width + height};
}

// Find ridges if there are several spots, or one is open, as narrow and bent contacts are. Spots that cannot bear the
// force may be what the grid sees of a sharp edge; then ridges count if they are much longer. `length`: of all spots
// [m]. False if the ridges do not account for these.
bool ContactSearch::find_ridges(const HeightMap& map, const Plane& plane, const SearchLoad& load, double length) {
  if (!load.follows || !(level_ > 0.0)) return false;
  if (!lacks_area() && spots_.size() < 2 && !any_is_open(spots_)) return false;
  Ridges::Grid grid = {bounds_, kLines, grid_, {nullptr, nullptr, nullptr, nullptr}};
  for (std::size_t k = 0; k < rim_count_; ++k) {
    const Point& inward = rim_[k].inward;
    grid.ends[inward.x > 0.0 ? 0 : inward.x < 0.0 ? 1 : inward.y > 0.0 ? 2 : 3] = &rim_[k].heights;
  }
  const double ceiling = kSpare * std::max(reached_, load.reach);
  const HeightWindow view = {&map, {plane.slopes[0], plane.slopes[1]}, plane.middle, lowest_, ceiling};
  const std::size_t most = lacks_area() ? kMostOfEdges : kMostCrossings;
  const double least = lacks_area() ? length / kMissedEdge : kLongRidges * length;
  const double tolerance = kRidgeTolerance * load.force / (load.modulus * length);
  return ridges_.find(view, grid, tolerance, {std::max(reached_, load.reach), least, most});
}

// Replace the spots by others along ridges if the contact is narrow. A line contact of length L carries the force
// F = E* l L at a level l.
void ContactSearch::follow_ridges(const HeightMap& map, const Plane& plane, const SearchLoad& load) {
  strip_ = 0.0;
  double length = 0.0;
  for (const Spot& spot : spots_) length += spot.length;
  if (!find_ridges(map, plane, load, length)) return;
  const double product = load.force / load.modulus, deepest = std::min(ridges_.lowest(), 0.0);
  ridges_.count_from(deepest);
  const double end = load.end - deepest, level = std::min(ridges_.level_for(product), end);
  const double gathered = std::min(std::max(level, load.reach - deepest), end);
  const double found = ridges_.length_below(gathered);
  double strip = product / found;
  // A sharp edge, most of which the grid missed, is pressed until the surface can bear its force.
  const bool sharp = found > length / kMissedEdge;
  for (int k = 0; sharp && k < kWidenings && ridges_.area_below(gathered, strip) < load.least_area; ++k) strip *= 2.0;
  ridges_.connect(gathered, kNear * spacing_, strip);
  if (ridges_.count() > kMostParts) return;
  double all = 0.0, narrow = 0.0, area = 0.0;
  along_ridges_.clear();
  for (std::size_t k = 0; k < ridges_.count(); ++k) {
    const Ridges::Stretch& one = ridges_.stretch(k);
    const double sides[2] = {one.width(), one.width()};
    along_ridges_.push_back({region_about(one.points, sides, 0.0, map), one.area, one.length});
    all += one.length, area += one.area;
    if (one.width() < kNarrowPart * along_ridges_.back().region.lengthwise().width) narrow += one.narrow;
  }
  if (!(narrow > kMostlyNarrow * all) || !(all > kLongRidges * length) || area < load.least_area) return;
  spots_ = along_ridges_;
  // Heights count from the lowest point.
  lowest_ += deepest;
  level_ = loaded_ = level;
  reached_ = gathered;
  strip_ = strip;
}

bool ContactSearch::has_more_ridges(double height) const {
  return ridges_.length_below(height) > (1.0 + kTogether) * ridges_.length_below(reached_);
}

// Add strips along the sheet's rim that are below the level and too narrow for the grids.
void ContactSearch::add_rim_strips(const HeightMap& map, const Plane& plane) {
  const std::size_t parts = spots_.size();
  const auto beside_part = [&](const Point& at) {
    return std::any_of(spots_.begin(), spots_.begin() + static_cast<std::ptrdiff_t>(parts), [&](const Spot& spot) {
      Region wider = spot.region;
      wider.width += 2.0 * kNear * spacing_, wider.height += 2.0 * kNear * spacing_;
      return wider.holds(at);
    });
  };
  double deepest = 0.0;
  for (std::size_t k = 0; k < rim_count_; ++k) {
    const RimSide& side = rim_[k];
    const auto below = [&](std::size_t line) { return over(plane, side.points[line], side.heights[line]) <= level_; };
    for (std::size_t first = 0, last = 0; first < kLines && spots_.size() < kMostParts; first = last + 1) {
      last = first;
      if (!below(first)) continue;
      while (last + 1 < kLines && below(last + 1)) ++last;
      const auto begin = side.points.begin() + static_cast<std::ptrdiff_t>(first);
      if (std::any_of(begin, begin + static_cast<std::ptrdiff_t>(last - first + 1), beside_part)) continue;
      deepest = std::min(deepest, add_rim_strip(map, plane, side, first, last));
    }
  }
  // Heights count from the lowest point.
  lowest_ += deepest;
  level_ -= deepest, loaded_ -= deepest, reached_ -= deepest;
  ridges_.count_from(deepest);
}

// Add the strip between two samples of a side. Returns the least height of its samples.
double ContactSearch::add_rim_strip(const HeightMap& map, const Plane& plane, const RimSide& side, std::size_t first,
                                std::size_t last) {
  const bool along_y = side.inward.x != 0.0;
  const double length = step_[along_y ? 1 : 0] * static_cast<double>(last - first + 1);
  double width = 0.0, least = kNowhere;
  for (std::size_t line = first; line <= last; ++line) {
    const Point& rim = side.points[line];
    least = std::min(least, over(plane, rim, side.heights[line]));
    const auto below = [&](double depth) {
      const Point at = {rim.x + depth * side.inward.x, rim.y + depth * side.inward.y};
      return over(plane, at, map.height(at.x, at.y)) <= level_;
    };
    if (!below(width)) continue;
    // Each line from its own end, so that the order of the lines makes no difference.
    double within = 0.0, beyond = step_[along_y ? 0 : 1] / 2;   // a grid point is there
    for (int halving = 0; halving < kStripBisections; ++halving) {
      const double middle = (within + beyond) / 2;
      (below(middle) ? within : beyond) = middle;
    }
    width = std::max(width, within);
  }
  if (!(width > 0.0)) return 0.0;
  const Point &from = side.points[first], &to = side.points[last];
  const Point middle = {(from.x + to.x + width * side.inward.x) / 2, (from.y + to.y + width * side.inward.y) / 2};
  spots_.push_back({{middle, 0.0, along_y ? width : length, along_y ? length : width}, length * width, length + width});
  return least;
}

bool ContactSearch::supported(const SearchLoad& load) const {
  std::vector<Point> corners;
  for (const Spot& spot : spots_) {
    const double c = std::cos(spot.region.angle), s = std::sin(spot.region.angle);
    for (const double u : {-0.5, 0.5}) {
      for (const double v : {-0.5, 0.5}) {
        const double x = u * spot.region.width, y = v * spot.region.height;
        corners.push_back({spot.region.centre.x + c * x - s * y, spot.region.centre.y + s * x + c * y});
      }
    }
  }
  return holds(convex_hull(std::move(corners)), load.through, -kOnRim * extent());
}

std::vector<Point> ContactSearch::covered() const {
  // All corners of the hull are those of a flat face, ends of a row of the grid or points that were moved off the grid.
  std::vector<Point> ends = corners_;
  for (const std::size_t sample : moved_) ends.push_back(points_[sample]);
  const auto counts = [this](std::size_t sample) {
    return std::isfinite(raw_[sample]) && std::find(moved_.begin(), moved_.end(), sample) == moved_.end();
  };
  for (std::size_t start = 0; start < kLines * kLines; start += kLines) {
    std::size_t first = start, last = start + kLines;
    while (first < last && !counts(first)) ++first;
    while (last > first && !counts(last - 1)) --last;
    if (first == last) continue;
    ends.push_back(points_[first]);
    if (last > first + 1) ends.push_back(points_[last - 1]);
  }
  return convex_hull(std::move(ends));
}

double ContactSearch::share_until(const Plane& seen, const Plane& tilt, double height,
                                  const std::vector<Region>& regions) const {
  double least = kNowhere;
  for (std::size_t i = 0; i < raw_.size(); ++i) {
    const Point& at = points_[i];
    const double falls = tilt(at.x, at.y);
    if (!(falls > 0.0) || !std::isfinite(raw_[i])) continue;
    const double share = std::max(over(seen, at, raw_[i]) - height, 0.0) / falls;
    if (share < least && is_outside(at, regions)) least = share;
  }
  return least;
}

bool ContactSearch::lower_than(const Plane& seen, double height, const std::vector<Region>& regions) const {
  for (std::size_t i = 0; i < raw_.size(); ++i) {
    if (over(seen, points_[i], raw_[i]) < height && is_outside(points_[i], regions)) return true;
  }
  return false;
}

Plane ContactSearch::resting(const SearchLoad& load) {
  SpringFrame frame;
  frame.length = std::sqrt(bounds_.area());
  frame.middle = bounds_.middle();
  Plane plane = {{0.0, 0.0}, load.through};
  Point inside;
  if (std::isinf(load.modulus)) return plane;  // a law without compliance, for which the pad may have none
  if (!nearest_inside(covered(), load.through, 1e-3 * frame.length, inside)) return plane;
  // If the load passes a spring within rounding, it acts exactly on it. Otherwise rounding would decide to which side
  // the body falls.
  const double near = kOnSpring * frame.length;
  for (std::size_t i = 0; i < raw_.size(); ++i) {
    const double x = points_[i].x - inside.x, y = points_[i].y - inside.y;
    if (x * x + y * y <= near * near && std::isfinite(raw_[i])) inside = points_[i];
  }
  const double resultants[3] = {load.force, load.force * (inside.x - frame.middle.x) / frame.length,
                                load.force * (inside.y - frame.middle.y) / frame.length};
  // Springs under high parts of the body are laid only if it comes down to them.
  for (const double highest : {kLowSprings * level_, kNowhere}) {
    lay_springs(frame, highest, load.modulus);
    if (stiffness_.size() < 3) continue;
    resist_tilt(frame);
    if (!springs_.solve(stiffness_, modes_.data(), 3, bed_heights_.data(), resultants) ||
        presses_above(frame, highest)) {
      continue;
    }
    plane.slopes[0] = springs_.motion()[1] / frame.length;
    plane.slopes[1] = springs_.motion()[2] / frame.length;
    break;
  }
  return plane;
}

// Lay springs under the samples up to a height above the lowest one.
void ContactSearch::lay_springs(const SpringFrame& frame, double highest, double modulus) {
  stiffness_.clear();
  modes_.clear();
  bed_heights_.clear();
  // Stiffness per area of the surface under a flat face a tenth as long as the sampled area.
  const double stiffness = frame.length * 20.0 * modulus / (kLines * kLines);
  for (std::size_t i = 0; i < raw_.size(); ++i) {
    if (!std::isfinite(raw_[i]) || raw_[i] - least_ > highest) continue;
    stiffness_.push_back(stiffness);
    modes_.insert(modes_.end(), {1.0, (points_[i].x - frame.middle.x) / frame.length,
                                 (points_[i].y - frame.middle.y) / frame.length});
    bed_heights_.push_back(raw_[i] - least_);
  }
}

// Add weak springs that resist any tilt. The load may rest on one of the other springs, or on several in a line, which
// leaves the tilt open. With these springs the least tilt results; without them rounding would choose one.
void ContactSearch::resist_tilt(const SpringFrame& frame) {
  const double stiffness = kLevelling * stiffness_.front();
  for (const double sign : {1.0, -1.0}) {
    stiffness_.insert(stiffness_.end(), 2, stiffness);
    modes_.insert(modes_.end(), {0.0, sign, 0.0, 0.0, 0.0, sign});
    bed_heights_.insert(bed_heights_.end(), 2, -kSteepest * frame.length);  // always pressed, against each other
  }
}

// Whether the body that rests on the springs also comes down to samples above a height.
bool ContactSearch::presses_above(const SpringFrame& frame, double highest) const {
  const double* motion = springs_.motion();
  for (std::size_t i = 0; i < raw_.size(); ++i) {
    const double sunk = motion[0] + (motion[1] * (points_[i].x - frame.middle.x) +
                                     motion[2] * (points_[i].y - frame.middle.y)) / frame.length;
    const double height = raw_[i] - least_;
    if (height > highest && sunk > height) return true;
  }
  return false;
}

}  // namespace mjtactile
