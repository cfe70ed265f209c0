#include "contact/patch_press.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mjtactile {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Looks. A look lays cells on the spots that may touch, as one plane sees the body, and presses them.
constexpr int kLooks = 4;                // looks at one contact, at most
constexpr double kWorse = 0.04;          // more energy than this share of a contact's own makes another look the
                                         // worse one
constexpr double kMissed = 0.01;         // distance of the centre of pressure from the load, over the contact's size,
                                         // from which on the load is missed
constexpr double kInside = 1e-12;        // distance from the rim of what the body covers that still lies inside [m]

// Height up to which cells are laid, over the level: the height of a flat punch that would carry the load.
constexpr double kGenerous = 2.5;        // in the first look
constexpr double kCompact = 1.5;         // in the first look at one compact spot; a ball's contact ends at 1.2 levels
constexpr double kAsLongAsWide = 2.003;  // length over width up to which a spot is compact
constexpr double kLeastGenerous = 0.25, kMostGenerous = 64.0;   // in later looks
constexpr double kBeyond = 1.6;          // at least, where the bound on pressure sets the level
constexpr double kDeep = 1.7;            // a contact this many times as deep as its cells are high gets higher ones:
constexpr double kShareOfDepth = 0.75;   // this share of the depth,
constexpr double kMostWider = 8.0;       // and no more than so many times as high at once
constexpr double kEnds = 1.25;           // where contacts of cones and paraboloids end, over what a flat punch says
constexpr double kSinks = 1.05;          // margin on the height up to which the body was found to touch
constexpr double kTouches = 0.6;         // share of the depth up to which parts of a tilted body touch

// When cells are laid anew.
constexpr double kLeastPressed = 0.2;    // fewer than this share of them press,
constexpr double kMuchLower = 0.7;       // and the contact ends below this share of their height
constexpr double kGoesOn = 0.5;          // more than this share of the cells cut off at that height press,
constexpr double kWithin = 0.5;          // the others have more than this share of their area,
constexpr double kHigher = 1.2;          // and the body sinks in this many times as deep

// Regions about the spots in which cells are laid. Sides and areas of spots are whole numbers of the search's samples:
// at ratios that such numbers have, rounding would decide.
constexpr double kLeastWider = 1.5;      // size over that of the spot, at least
constexpr double kTrimmed = 0.6;         // share of an open spot's region that is kept, at least
constexpr double kElongated = 3.003;     // length over width from which on no spot is open
constexpr double kOpen = 0.499;          // share of its rectangle below which a spot is open: bent, or hollow
constexpr double kApart = 2.0;           // size over the region's beyond which another part of the body begins

// Number of cells.
constexpr double kMostCells = 2.0;       // over the number asked for, at most,
constexpr std::size_t kMoreCells = 24;   // and so many more
constexpr double kCheap = 2.0;           // over that number, under laws that solve for little
constexpr double kFilled = 0.7;          // share of its rectangle below which a spot takes more cells,
constexpr double kMostFor = 3.0;         // and at most so many times as many
constexpr double kAskew = 1.27;          // cells that a line askew to a lattice meets, over those of a line along it
constexpr double kTooFew = 0.85;         // share of the cells wanted below which smaller ones are laid,
constexpr double kLeastFiner = 0.25;     // down to this share of their size
constexpr double kNearly = 1.1;          // over the most cells: symmetric bodies may have a few more;
constexpr double kLeastCoarser = 1.25;   // beyond that cells grow at least by this factor,
constexpr int kRounds = 10;              // so many times at most
constexpr double kMostSounded = 32.0;    // places looked at for one cell, at most
constexpr double kSpareArea = 3.0;       // area of the cells over what the force needs at the bound on pressure

// Tilts.
constexpr double kSmallTilt = 0.2;       // lift of the contact, over the level, up to which a tilt needs no other look
constexpr double kMostTilt = 2.0;        // lift that one look adds, over the level, at most
constexpr double kNarrow = 1.5;          // width along the tilt, over the narrowest cells, that tells little of it
constexpr double kMostSlope = 1.0;       // steepest slope that is looked at
constexpr double kNearlyFallen = 0.9;    // share of it from which on a body that goes on tilting falls over
constexpr double kLeastLean = 0.5;       // least approach along a cell's own normal over that along the plane's

// Loads near the rim of what the body covers.
constexpr double kNearRim = 0.15;        // distance from a side, over what lies behind it, that is near
constexpr double kStrip = 3.0;           // width of the strip that is pressed then, over that distance
constexpr double kCorner = 0.7;          // sum of the normals of two sides at a right corner, over that of their sizes
constexpr double kOneSide = 0.1;         // the same where sides have no direction in common

// How high a contact ends, over the level, of a body whose height grows with the radius to the power m. It sinks in c_m
// times as deep as that, c_m = sqrt(pi) Gamma(m/2 + 1) / Gamma(m/2 + 1/2), under 2 m c_m / (m + 1) times what that
// height takes on a flat punch of its area (Sneddon, Int. J. Engng Sci. 3, 1965).
double end_over_level(double m) {
  const double c = std::sqrt(kPi / 2.0 * (m + 0.5));  // within 2 % from cones on
  return kEnds * std::pow((m + 1.0) / (m * c), m / (m + 1.0));
}

// Heights nearer to the level than this, over it, tell of no power; cusps sharper than the least power are not known.
constexpr double kHigherAtLeast = 1.01, kLeastPower = 0.5;

// The power m of a body of which so many times the area lies under a height so many times the level; 0 where none is
// told.
double power_of(double higher, double more) {
  if (!(higher > kHigherAtLeast) || !(more > 1.0) || !std::isfinite(higher) || !std::isfinite(more)) return 0.0;
  return std::max(2.0 * std::log(higher) / std::log(more), kLeastPower);
}

// Centre a region on a point no further from its middle than a cell: of symmetric bodies it is their middle, and where
// a body slides the cells go with it.
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

// Breadth of the strip of a depth along a hull's side.
double breadth(const std::vector<Point>& hull, const double* inward, double depth) {
  double first = INFINITY, least = INFINITY, most = -INFINITY;
  const auto deep = [&](const Point& at) { return inward[0] * at.x + inward[1] * at.y; };
  const auto along = [&](const Point& at) { return inward[0] * at.y - inward[1] * at.x; };
  for (const Point& corner : hull) first = std::min(first, deep(corner));
  const auto add = [&](double at) { least = std::min(least, at), most = std::max(most, at); };
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Point &a = hull[i], &b = hull[(i + 1) % hull.size()];
    const double from = deep(a) - first - depth, to = deep(b) - first - depth;
    if (from <= 0.0) add(along(a));
    if ((from < 0.0) != (to < 0.0)) add(along(a) + from / (from - to) * (along(b) - along(a)));
  }
  return most - least;
}

// Share of a tilt that is taken after another one: where it goes back, as far as a straight line between the two says
// (Anderson, J. ACM 12, 1965, with one step kept), where it goes on, all of it.
double secant_share(const double* slopes, const double* before) {
  double along = 0.0, square = 0.0;
  for (int k = 0; k < 2; ++k) {
    along += slopes[k] * (slopes[k] - before[k]);
    square += (slopes[k] - before[k]) * (slopes[k] - before[k]);
  }
  const bool back = slopes[0] * before[0] + slopes[1] * before[1] < 0.0;
  return back ? 1.0 - along / square : 1.0;
}

}  // namespace

bool PatchPress::solve(const HeightMap& map, const ContactSurface& surface, const double* wrench,
                       CellContact::Workspace& workspace) {
  bends_ = surface.plane != nullptr;
  if (!(wrench[2] < 0.0) || !search_.look(map)) return false;
  Problem problem = {map, surface, surface.options, wrench, workspace, load_of(wrench, surface), {}};
  if (problem.options.tilting) problem.hull = search_.covered();
  Looks looks;
  looks.view = first_view(problem);
  looks.best = looks.onward = looks.view;
  if (!look_first(problem, looks)) return false;
  for (int look = 1; look < kLooks && turn(problem, looks); ++look) {
    if (looks.last_is_best) std::swap(laid_, best_);
    find_spots(problem, looks.view);
    judge(problem, press(problem, looks.view), look + 2 < kLooks, looks);
  }
  if (looks.last_is_best) return true;
  std::swap(laid_, best_);
  place(surface, workspace);
  return true;
}

SearchLoad PatchPress::load_of(const double* wrench, const ContactSurface& surface) {
  SearchLoad load;
  load.force = -wrench[2];
  load.through = {-wrench[4] / wrench[2], wrench[3] / wrench[2]};
  load.modulus = 1.0 / (kPi * surface.compliance.factor());
  load.least_area = surface.options.strength > 0.0 ? kSpareArea * load.force / surface.options.strength : 0.0;
  return load;
}

PatchPress::Viewpoint PatchPress::first_view(const Problem& problem) const {
  Viewpoint view = {{{0.0, 0.0}, problem.load.through}, kGenerous, 0.0, 0.0, 0.0, {0.0, 0.0}};
  if (problem.options.tilting) view.plane = first_plane(problem.load, problem.hull);
  return view;
}

// The first look, from which the others go on; false where nothing of the body faces the pad.
bool PatchPress::look_first(const Problem& problem, Looks& looks) {
  const LawOptions& options = problem.options;
  find_spots(problem, looks.view);
  if (options.tilting && !search_.supported(problem.load)) {
    // The body leans: it tilts until the force passes through what it rests on.
    rest(problem, looks);
    find_spots(problem, looks.view);
  }
  // Springs are pressed farther out than an elastic surface.
  if (options.law->couples() && compact(options)) looks.view.generosity = kCompact;
  if (!press(problem, looks.view)) return false;
  if (laid_.contact.exact()) judge(problem, true, true, looks);
  return true;
}

// Turn to the next view; false where the best contact is found, or no other view is known.
bool PatchPress::turn(const Problem& problem, Looks& looks) {
  if (looks.last_is_best) {
    if (laid_.contact.exact() && presses_all()) return false;
    // Where no contact is found, or it misses the load, other parts of the body carry that, onto which it tilts first.
    // Onto a load beside all that the body covers the first plane has tilted it as far as it goes; under laws whose
    // cells do not know of each other it would rest in the same way again.
    looks.resting_tried = !looks.rested && problem.options.law->couples() && looks.best_merit.missed > 0.0 &&
                          problem.hull.size() > 2 && holds(problem.hull, problem.load.through, kInside);
    if (looks.resting_tried) {
      looks.view = looks.best;
      rest(problem, looks);
      return true;
    }
  } else if (!looks.resting_tried) {
    if (looks.ended) {
      // More of the body touches there than there were cells for.
      looks.view.reaches = sinks();
      looks.view.sinks = 0.0;
      return true;
    }
    // It tilted too far onto what lies there.
    for (int k = 0; k < 2; ++k) {
      looks.view.plane.slopes[k] = (looks.view.plane.slopes[k] + looks.best.plane.slopes[k]) / 2;
    }
    return true;
  }
  looks.view = looks.onward;
  looks.resting_tried = false;
  return looks.goes_on;
}

// How the body rests on springs; farther than it may tilt none is looked at.
void PatchPress::rest(const Problem& problem, Looks& looks) {
  Plane& plane = looks.view.plane = search_.resting(problem.load);
  const double slope = std::hypot(plane.slopes[0], plane.slopes[1]);
  for (double& one : plane.slopes) one *= std::min(1.0, kMostSlope / std::max(slope, kMostSlope));
  looks.rested = true;
}

void PatchPress::find_spots(const Problem& problem, const Viewpoint& view) {
  SearchLoad load = problem.load;
  load.reach = view.touches;
  spots_ = search_.find(problem.map, view.plane, load);
}

// Lay cells on the spots and press them; false where there are none.
bool PatchPress::press(const Problem& problem, const Viewpoint& view) {
  if (!add_cells(problem.map, problem.surface, view)) return false;
  if (bends_) laid_.bent.lay(laid_.cells.face(), *problem.surface.plane);
  place(problem.surface, problem.workspace);
  set_heights();
  start_.clear();
  const double likely = likely_height();
  for (const double height : laid_.heights) start_.push_back(height <= likely ? 1 : 0);
  const bool known = std::count(start_.begin(), start_.end(), 1) >= 3;
  laid_.contact.press(laid_.cells.face(), problem.surface,
                      {problem.wrench, laid_.heights.data(), known ? start_.data() : nullptr}, problem.workspace);
  return true;
}

// Compare what the last look found with the best, and say where it leads to. `more`: whether another look is left after
// the next one.
void PatchPress::judge(const Problem& problem, bool pressed, bool more, Looks& looks) const {
  const bool solved = pressed && laid_.contact.exact();
  const Merit found = solved ? merit(problem.load, problem.options) : Merit{};
  looks.last_is_best = solved && !is_worse(found, looks.best_merit);
  looks.ended = solved && more && ends_early();
  if (!looks.last_is_best) return;
  looks.best = looks.onward = looks.view;
  looks.best_merit = found;
  looks.goes_on = next_view(found, problem.options.narrowest, looks.onward);
}

bool PatchPress::presses_all() const {
  const std::vector<std::uint8_t>&pressed = laid_.contact.pressed(), &goes_on = laid_.cells.goes_on();
  return search_.sees_all() && std::find(pressed.begin(), pressed.end(), 0) == pressed.end() &&
         std::find(goes_on.begin(), goes_on.end(), 1) == goes_on.end();
}

void PatchPress::place(const ContactSurface& surface, CellContact::Workspace& workspace) {
  laid_.contact.place(laid_.cells.face(), kUnmoved, surface, workspace, bends_ ? &laid_.bent : nullptr);
}

// Above each cell, on a curved pad where the cell's own normal meets the body.
void PatchPress::set_heights() {
  laid_.heights = laid_.cells.heights();
  for (std::size_t i = 0; bends_ && i < laid_.heights.size(); ++i) {
    const Point& gradient = laid_.cells.gradients()[i];
    const double *slopes = laid_.bent.slopes().data() + 2 * i, stretch = laid_.bent.stretches()[i];
    const double leans = (slopes[0] * gradient.x + slopes[1] * gradient.y) / (stretch * stretch);
    laid_.heights[i] /= std::max(1.0 + leans, kLeastLean);
  }
}

bool PatchPress::compact(const LawOptions& options) const {
  if (spots_.size() != 1) return false;
  // Few cells, as narrow as they may be, do not tell where in the outermost ones the contact ends.
  const double cell = spots_.front().area * std::sqrt(kGenerous) / static_cast<double>(options.cells);
  if (cell < options.narrowest * options.narrowest) return false;
  const Region region = spots_.front().region.lengthwise();
  return region.width < kAsLongAsWide * region.height && spots_.front().area > kOpen * region.area();
}

// How high the outermost cells that press are likely to stand.
double PatchPress::likely_height() const {
  double under = 0.0, all = 0.0;
  for (std::size_t i = 0; i < laid_.heights.size(); ++i) {
    all += laid_.cells.face().areas[i];
    if (laid_.heights[i] <= search_.level()) under += laid_.cells.face().areas[i];
  }
  const double power = power_of(laid_.seen.highest / search_.level(), all / under);
  return power > 0.0 ? end_over_level(power) * search_.level() : search_.level();
}

// A load that passes close to the rim tilts the body about it, onto a strip along the rim; one close to sides that meet
// tilts it onto their corner. Sides count the more the closer they are, and as far as they run beside the load: nothing
// jumps where another is nearer, or where one is made of pieces.
Plane PatchPress::first_plane(const SearchLoad& load, const std::vector<Point>& hull) const {
  Plane plane = {{0.0, 0.0}, load.through};
  double all = 0.0, distance = 0.0, inward[2] = {0.0, 0.0};
  for (std::size_t i = 0; hull.size() > 2 && i < hull.size(); ++i) {
    const Point &a = hull[i], &b = hull[(i + 1) % hull.size()];
    const double length = std::hypot(b.x - a.x, b.y - a.y);
    const double along[2] = {(b.x - a.x) / length, (b.y - a.y) / length}, normal[2] = {-along[1], along[0]};
    double depth = 0.0;
    for (const Point& corner : hull) {
      depth = std::max(depth, normal[0] * (corner.x - a.x) + normal[1] * (corner.y - a.y));
    }
    const double near = kNearRim * depth;
    const double away = std::max(normal[0] * (load.through.x - a.x) + normal[1] * (load.through.y - a.y), 1e-3 * depth);
    const double from = along[0] * (a.x - load.through.x) + along[1] * (a.y - load.through.y);
    const double beside = std::min(from + length, near) - std::max(from, -near);
    if (!(beside > 0.0 && away < near)) continue;
    const double weight = beside * (1.0 - away / near);
    all += weight;
    distance += weight * away;
    for (int k = 0; k < 2; ++k) inward[k] += weight * normal[k];
  }
  const double size = std::hypot(inward[0], inward[1]);
  if (!(size > kOneSide * all)) return plane;
  for (double& one : inward) one /= size;
  // How much the sides are one, from a corner's to that of a straight line.
  const double straight = std::max((size / all - kCorner) / (1.0 - kCorner), 0.0);
  double strip = kStrip * distance / all;
  const double length = straight * breadth(hull, inward, strip), corner = 1.0 - straight;
  const double across = length + corner * std::sqrt(load.least_area);
  strip = std::max(strip, load.least_area / std::max(across, std::sqrt(load.least_area)));
  const double level = load.force / (load.modulus * (length + corner * strip + strip));
  for (int k = 0; k < 2; ++k) plane.slopes[k] = -level / strip * inward[k];
  return plane;
}

double PatchPress::energy(const SearchLoad& load) const {
  double sum = laid_.contact.energy() + load.force * search_.lowest();
  for (std::size_t i = 0; i < laid_.heights.size(); ++i) sum += laid_.contact.normal()[i] * laid_.heights[i];
  return sum;
}

double PatchPress::missed(const SearchLoad& load, double narrowest) const {
  double force = 0.0;
  Point centre = {0.0, 0.0};
  for (std::size_t i = 0; i < laid_.heights.size(); ++i) {
    const double own = laid_.contact.normal()[i];
    force += own;
    centre.x += own * laid_.cells.face().centroids[i].x, centre.y += own * laid_.cells.face().centroids[i].y;
  }
  const double away = std::hypot(centre.x / force - load.through.x, centre.y / force - load.through.y);
  return away > std::max(kMissed * laid_.cells.face().length, narrowest) ? away : 0.0;
}

PatchPress::Merit PatchPress::merit(const SearchLoad& load, const LawOptions& options) const {
  if (!options.tilting || !options.law->couples()) return {};
  return {missed(load, options.narrowest), energy(load), laid_.contact.energy()};
}

bool PatchPress::is_worse(const Merit& one, const Merit& other) {
  if (one.missed > 0.0 || other.missed > 0.0) return one.missed > (1.0 + kMissed) * other.missed;
  return one.energy > other.energy + kWorse * one.elastic;
}

double PatchPress::tilt() const {
  return std::hypot(laid_.seen.slopes[0] + laid_.contact.slopes()[0], laid_.seen.slopes[1] + laid_.contact.slopes()[1]);
}

void PatchPress::press_again(const ContactSurface& surface, const double* wrench, const std::vector<double>& sunk,
                             CellContact::Workspace& workspace) {
  set_heights();
  for (std::size_t i = 0; i < laid_.heights.size(); ++i) laid_.heights[i] += sunk[i];
  const std::vector<std::uint8_t> start = laid_.contact.pressed();
  laid_.contact.press(laid_.cells.face(), surface, {wrench, laid_.heights.data(), start.data()}, workspace);
}

bool PatchPress::add_cells(const HeightMap& map, const ContactSurface& surface, const Viewpoint& view) {
  const LawOptions& options = surface.options;
  double highest = !options.law->shapes() ? std::max(search_.level(), options.facing_gap)
                                          : std::max(search_.loaded() * view.generosity, kBeyond * search_.level());
  if (options.law->shapes()) highest = std::max(highest, search_.reached());
  if (view.sinks > 0.0) highest = std::min(highest, std::max(view.sinks, search_.level()));
  highest = std::max(highest, view.reaches);
  laid_.seen = {&map, {view.plane.slopes[0], view.plane.slopes[1]}, view.plane.middle, search_.lowest(),
                highest + search_.same()};
  // Long, bent and open spots take more cells, and several spots more than one; a law that knows no shapes solves
  // little.
  const double cells = (options.law->shapes() ? 1.0 : kCheap) * static_cast<double>(options.cells);
  double wanted = 0.0;
  for (const Spot& spot : spots_) {
    const double filled = spot.area / spot.region.area();
    wanted += cells * std::min(std::max(kFilled / filled, 1.0), kMostFor);
  }
  const double most = kMostCells * cells + static_cast<double>(kMoreCells);
  wanted = std::min(wanted, most);
  reach_out();
  double coarser = 1.0;
  for (int round = 0; round < kRounds; ++round) {
    laid_.cells.clear();
    for (std::size_t k = 0; k < spots_.size(); ++k) {
      laid_.cells.sound(lattice_over(k, options, view, wanted, coarser), laid_.seen, {regions_, k});
    }
    const auto count = static_cast<double>(laid_.cells.sounded());
    if (round == 0 && count < kTooFew * wanted && options.law->shapes()) {
      // The body ends, or rises, sooner than most do.
      coarser = std::max(count / wanted, kLeastFiner);
      continue;
    }
    if (count <= kNearly * most) break;
    coarser *= std::max(kLeastCoarser, count / most);
  }
  laid_.cells.lay(laid_.seen);
  if (laid_.cells.heights().empty()) return false;
  laid_.cells.finish(surface.sheet);
  return true;
}

// Regions about the spots as far as the body may touch there: what stands linearly higher from the spot on is reached.
void PatchPress::reach_out() {
  // Flat faces stand nowhere higher.
  const double wider =
      search_.level() > 0.0 ? std::max(laid_.seen.highest / search_.level(), kLeastWider) : kLeastWider;
  regions_.clear();
  for (const Spot& spot : spots_) {
    Region region = spot.region.lengthwise();
    // On lines through what is bent or hollow there may be nothing far into it.
    const bool open = spot.area < kOpen * spot.region.area() && region.width < kElongated * region.height;
    laid_.cells.trim(laid_.seen, open ? kTrimmed : 0.0, wider, region);
    regions_.push_back(region);
  }
}

// Cells on a spot, larger by a factor than wanted.
Lattice PatchPress::lattice_over(std::size_t number, const LawOptions& options, const Viewpoint& view, double wanted,
                                 double coarser) const {
  const Spot& spot = spots_[number];
  double roots = 0.0;
  for (const Spot& one : spots_) roots += std::sqrt(one.area);
  const double share = std::max(wanted * std::sqrt(spot.area) / roots, 4.0);
  const bool breaks = search_.loaded() * kGenerous < search_.level();
  double cell =
      coarser * spot.area * (breaks ? std::sqrt(1.6) : std::sqrt(std::max(view.generosity, kGenerous))) / share;
  // Bodies whose area grows fast with the height press on more than what lies under the level.
  const double power =
      power_of(laid_.seen.highest / search_.level(), regions_[number].area() / spot.region.lengthwise().area());
  if (power > 0.0) cell *= std::max(std::pow(end_over_level(power), 2.0 / power), 1.0);
  // So many cells of one size lie along a line that runs askew to them.
  const double askew = coarser * kAskew * spot.length / share;
  if (spot.area < kOpen * spot.region.area()) cell = std::max(cell, askew * askew);
  Region region = regions_[number];
  cell = std::max(cell, std::max(coarser, 1.0) * region.area() / (kMostSounded * wanted));
  // Lattices grow as far as the body goes on: one cell on a speck of it may not stay as small as that.
  if (!(region.area() > 0.0) || std::max(region.width, region.height) < options.narrowest) {
    region.width = std::max(region.width, options.narrowest);
    region.height = std::max(region.height, options.narrowest);
  }
  if (coarser > 1.0 && region.area() < cell) {
    // One cell, no longer than the region where that is long enough.
    const double longer = std::max({region.width, region.height, std::sqrt(cell)});
    const bool along = region.width > region.height;
    region.width = along ? longer : cell / longer;
    region.height = along ? cell / longer : longer;
  }
  if (spots_.size() == 1) centre_on(view.plane.middle, std::sqrt(cell), region);
  return region.lattice(cell, options.narrowest);
}

// Whether cells press that end for the height alone: the contact goes on beyond them.
bool PatchPress::goes_beyond() const {
  std::size_t at_end = 0, ends = 0;
  for (std::size_t i = 0; i < laid_.heights.size(); ++i) {
    ends += laid_.cells.goes_on()[i];
    at_end += laid_.cells.goes_on()[i] && laid_.contact.pressed()[i];
  }
  return static_cast<double>(at_end) > kGoesOn * static_cast<double>(ends);
}

// Whether it surely does: of a single row of cells all end on their sides.
bool PatchPress::ends_early() const {
  double within = 0.0, at_end = 0.0;
  for (std::size_t i = 0; i < laid_.heights.size(); ++i) {
    (laid_.cells.goes_on()[i] ? at_end : within) += laid_.cells.face().areas[i];
  }
  return goes_beyond() && within > kWithin * at_end;
}

// How high a part of the body may stand that touches, and a little over that.
double PatchPress::sinks() const {
  double lowest = kNowhere;
  for (std::size_t i = 0; i < laid_.heights.size(); ++i) {
    if (laid_.contact.pressed()[i]) lowest = std::min(lowest, laid_.heights[i]);
  }
  return kSinks * (laid_.contact.indentation() + std::max(lowest, 0.0));
}

// The part of the body that the tilt which the last look found brings down onto the surface first.
PatchPress::NextPart PatchPress::next_part() const {
  const double* slopes = laid_.contact.slopes();
  double force = 0.0, deepest = -kNowhere;
  Point centre = {0.0, 0.0};
  for (std::size_t i = 0; i < laid_.heights.size(); ++i) {
    if (!laid_.contact.pressed()[i]) continue;
    const Point& at = laid_.cells.face().centroids[i];
    const double own = laid_.contact.normal()[i];
    force += own;
    centre.x += own * at.x, centre.y += own * at.y;
    deepest = std::max(deepest, slopes[0] * at.x + slopes[1] * at.y - laid_.heights[i]);
  }
  if (!(force > 0.0)) return {kNowhere, 0.0};
  centre = {centre.x / force, centre.y / force};
  const double sunk = laid_.contact.indentation() - deepest + slopes[0] * centre.x + slopes[1] * centre.y;
  wider_ = regions_;
  for (Region& one : wider_) one.width *= kApart, one.height *= kApart;
  const Plane seen = {{laid_.seen.slopes[0], laid_.seen.slopes[1]}, laid_.seen.middle};
  return {search_.share_until(seen, {{slopes[0], slopes[1]}, centre}, sunk, wider_), sunk};
}

// How to look next; false where the contact found is the one that was looked at: no deeper, on enough of its cells, and
// not tilted away from them.
bool PatchPress::next_view(const Merit& found, double narrowest, Viewpoint& view) const {
  const double* slopes = laid_.contact.slopes();
  std::size_t pressed = 0;
  double least = kNowhere, most = -kNowhere, lowest = kNowhere;
  for (std::size_t i = 0; i < laid_.heights.size(); ++i) {
    if (!laid_.contact.pressed()[i]) continue;
    ++pressed;
    lowest = std::min(lowest, laid_.heights[i]);
    const Point& at = laid_.cells.face().centroids[i];
    const double lift = slopes[0] * at.x + slopes[1] * at.y;
    least = std::min(least, lift);
    most = std::max(most, lift);
  }
  const double level = std::max(search_.loaded(), laid_.contact.indentation());
  const double lifted = pressed > 0 ? most - least : 0.0;
  const bool beyond = goes_beyond();
  // A strip that carries the load stays one, however it tilts, where nothing else touches then.
  const bool narrow = found.missed == 0.0 && lifted <= kNarrow * narrowest * std::hypot(slopes[0], slopes[1]);
  const bool tilted = lifted > kSmallTilt * level && !(narrow && next_part().share >= 1.0);
  const bool few = static_cast<double>(pressed) < kLeastPressed * static_cast<double>(laid_.heights.size());
  if (tilted) {
    // Where it carries the load, what else it comes down on is for the next look to find.
    const NextPart next = found.missed > 0.0 ? next_part() : NextPart{kNowhere, 0.0};
    const double rolling = std::min(1.0, kMostTilt * level / lifted) * secant_share(slopes, view.from);
    const double share = std::min(rolling, next.share);
    std::copy(slopes, slopes + 2, view.from);
    const double to[2] = {view.plane.slopes[0] + share * slopes[0], view.plane.slopes[1] + share * slopes[1]};
    const double slope = std::hypot(to[0], to[1]);
    // It falls over: no tilt would carry the load, and farther than this none is looked at.
    if (slope > kMostSlope && std::hypot(view.plane.slopes[0], view.plane.slopes[1]) > kNearlyFallen * kMostSlope) {
      return false;
    }
    const double least_share = std::min(1.0, kMostSlope / slope);
    for (int k = 0; k < 2; ++k) view.plane.slopes[k] = least_share * to[k];
    if (laid_.contact.exact()) view.sinks = beyond ? 0.0 : laid_.contact.indentation() + std::max(lowest, 0.0);
    view.reaches = ends_early() ? sinks() : 0.0;
    // One spot that fills its rectangle has no parts that a level could leave out.
    const bool apart = spots_.size() > 1 || spots_.front().area < kOpen * spots_.front().region.area();
    view.touches = apart ? kTouches * laid_.contact.indentation() : 0.0;
    if (next.share < rolling) view.touches = std::max(view.touches, kSinks * next.height);
    return true;
  }
  if (search_.level() > 0.0 && laid_.contact.indentation() > kDeep * laid_.seen.highest &&
      view.generosity < kMostGenerous) {
    // Where the surface was pressed this deep, what stands a good part of that higher touches as well.
    const double deeper = kShareOfDepth * laid_.contact.indentation() / laid_.seen.highest;
    view.generosity = std::min(view.generosity * std::min(deeper, kMostWider), kMostGenerous);
    return true;
  }
  // What stands higher than the body sinks in at its lowest is not touched.
  if (few && search_.level() > 0.0 && sinks() < kMuchLower * laid_.seen.highest) {
    view.generosity = std::max(sinks() / search_.level(), kLeastGenerous);
    return true;
  }
  if (ends_early() && sinks() > kHigher * laid_.seen.highest) {
    view.reaches = sinks();
    return true;
  }
  return false;
}

}  // namespace mjtactile
