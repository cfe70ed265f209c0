#include "contact/patch_press.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "linalg/angles.hpp"

namespace mjtactile {
namespace {

// Looks. A look finds the spots that may touch as one plane sees the body, lays cells on them and presses them.
constexpr int kLooks = 6;                // largest number of looks at one contact,
constexpr int kLooksBeforeNested = 2;    // and looks after which a contact of several spots is pressed on nested cells,
                                         // for less than more looks; one look does not tell the tilt of a rough body
constexpr int kMoves = 2;                // largest number of looks for other parts, if those seen do not carry the load
constexpr double kRaise = 2.0;           // factor on the height up to which these are searched for
constexpr int kStepsBack = 2;            // largest number of steps back from a tilt that was too large
// A contact is worse if its energy is higher by this share of its own elastic energy. Energies of many cells are more
// exact, and tell which contact misses a part of the body.
constexpr double kEnergyMargin = 0.04, kFineEnergyMargin = 0.005;
constexpr std::size_t kManyCells = 100;
constexpr double kOverlooking = 0.15;    // what is added for a part that is overlooked, because few cells may tell too
                                         // little energy
constexpr double kLacking = 1e-3;        // a contact bears the load if it bears all but less than this share of it
constexpr double kMissed = 0.01;         // a contact misses the load if its centre of pressure is farther from it than
                                         // this, over the contact's size
constexpr double kInside = 1e-12;        // least distance from the hull's rim at which a point lies inside [m]

constexpr double kOverloaded = 2.0;      // level over what it is without a bound on the pressure, from which that bound
                                         // is likely met
constexpr double kSpareArea = 3.0;       // area of the cells over the least area that bears the force at the strength

// Heights up to which cells are laid, over the level. The level is the depth of a flat punch that carries the load. See
// also spot_lattices.hpp.
constexpr double kCompact = 1.6;         // in the first look at one compact spot; a ball's contact ends at 1.2 levels
constexpr double kLikelyEnd = 1.2;       // cells up to which the search for those that press begins
constexpr double kMostHeightFactor = 64.0;   // in later looks
// If the contact is kTooDeep times as deep as its cells are high, cells are laid higher: up to kShareOfDepth times the
// depth, but at most kMostHigher times as high as before.
constexpr double kTooDeep = 1.7, kShareOfDepth = 0.75, kMostHigher = 8.0;
constexpr double kTouchMargin = 1.05;    // safety factor on the height up to which the body was found to touch
constexpr double kTiltedShare = 0.6;     // height up to which parts of a tilted body touch, over the depth;
constexpr double kTiltedShareOfRings = 1.0;   // the same along a bent ridge, beside which the surface sinks in little

// Cells are laid again, lower, if less than a share of them press and the contact ends below a share of their height.
// A body that does not tilt is mostly looked at once, so its cells should fit more closely.
struct LaidLower {
  double pressed, height;
};
constexpr LaidLower kLaidLowerTilting = {0.6, 0.5}, kLaidLowerUpright = {0.66, 0.9};
constexpr double kOtherPart = 2.0;       // other parts of the body begin outside a region enlarged by this factor

// Contacts whose cells tell the body's shape badly are pressed on more of them, in proportion to their roughness.
constexpr double kSmooth = 0.05;         // roughness over the depth of the contact up to which cells are fine enough
constexpr double kWorthwhile = 1.1;      // least factor on their number
constexpr double kMostFiner = 4.0;       // largest factor,
constexpr double kManyFiner = 150.0;     // and number of cells beyond which there is none;
constexpr double kManySheared = 60.0;    // that number if shear is solved for as well
constexpr double kFinerMargin = 0.5;     // see kEnergyMargin; small cells see more of a body that has no ridges

// Nested cells, on which contacts are pressed whose tilt has not settled, that overlook a part of the body, or that are
// rough and have several spots.
constexpr double kNestedSmooth = 1.0;    // roughness over the depth, times the number of cells asked for, up to which a
                                         // contact is smooth
constexpr double kOverlooked = 0.5;      // height of the lowest cell, over how far the body comes down, from which
                                         // cells overlook a part of it,
constexpr double kStillOverlooked = 0.25;   // and the same for a cell's height over a point of it while cells are split
constexpr double kUncovered = 0.05;      // share of its low points that may lie under none of many cells, as parts of
                                         // these are cut away at the body's rim
constexpr double kGenerous = 1.2;        // height up to which coarse cells are laid, over the depth,
constexpr double kCoarse = 0.3;          // their number over that asked for,
constexpr double kFewest = 16.0;         // and their least number where they are laid under all of the body,
constexpr std::size_t kManySpots = 5;    // which tells nothing of this many spots
constexpr int kGenerousLooks = 4;        // largest number of looks with coarse cells,
constexpr double kMostLift = 0.4;        // and lift of the contact, over the depth, from which there is another one
constexpr int kSplits = 4;               // largest number of times that cells are split
constexpr double kUneven = 0.05;         // disagreement of neighbours, over the depth, from which they are split again,
constexpr double kMoreUneven = 1.3;      // and factor on it if there are too many
constexpr double kMostSplit = 4.0;       // largest number of cells over that asked for,
constexpr double kManySplit = 240.0;     // and largest number,
constexpr double kMostOfMany = 2.0;      // or this times the number asked for, unless shear is solved for as well
// Cells are split at the rim of a bottom, up to this number, if it is flat there: if it rises across a cell by at most
// kFlat times the depth, under kMostlyFlat of the rim's force. A box that leans by two degrees, or the end of a lying
// cylinder, is not flat: smaller cells would cost its time for little. kMostlyFlat is no share of a few equal forces.
constexpr double kManyAtRim = 300.0, kFlat = 0.1, kMostlyFlat = 0.503;

// Tilts.
constexpr double kSmallTilt = 0.2;       // lift of the contact, over the level, up to which a tilt needs no other look
constexpr double kSmallTiltOfStrips = 0.4;   // the same for cells along ridges, which stay as a body tilts
constexpr double kLeastShare = 0.5;      // least share of a tilt that is taken in a view of all parts that touch
constexpr double kNarrow = 1.5;          // largest width along the tilt, over the narrowest cells, at which the tilt is
                                         // not determined
constexpr double kMostSlope = 1.0;       // largest slope of a plane from which the body is looked at
constexpr double kNearlyFallen = 0.9;    // a body that tilts further beyond this share of kMostSlope falls over

// Loads near the rim of the area that the body covers.
constexpr double kNearRim = 0.15;        // largest distance of a near load from a side, over the hull's depth behind it
constexpr double kStrip = 3.0;           // width of the strip that such a load presses, over that distance
constexpr double kCorner = 0.7;          // length of the sum of two sides' unit normals at a right corner, over two
constexpr double kOneSide = 0.1;         // below this value the sides have no direction in common

// Length of the strip along a hull's side that extends inward to a given depth [m].
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

// If a step of the slopes goes as far as others that were too far, take half the way to these.
void stay_before(const double* too_far, const double* from, double* to) {
  double along = 0.0, square = 0.0;
  for (int k = 0; k < 2; ++k) {
    const double way = too_far[k] - from[k];
    along += way * (to[k] - from[k]), square += way * way;
  }
  if (along < square) return;
  for (int k = 0; k < 2; ++k) to[k] = (from[k] + too_far[k]) / 2;
}

// Share of a tilt to take after the last one. If the tilt has changed direction, it is that of the secant step
// (Anderson, J. ACM 12, 1965, with one step kept). Otherwise it is 1.
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
  if (!(wrench[2] < 0.0) || !search_.look(map)) return false;
  Problem problem = {map, surface, surface.options, wrench, workspace, load_of(wrench, surface), {}};
  if (problem.options.tilting) problem.hull = search_.covered();
  settled_ = false;
  Looks looks;
  looks.view = first_view(problem);
  looks.best = looks.onward = looks.view;
  if (!look_first(problem, looks)) return false;
  for (int look = 1; look < kLooks; ++look) {
    if (look == kLooksBeforeNested && nests_early(problem, looks)) {
      if (press_nested(problem, looks)) return true;
      looks.nested = true;
      laid_.place(surface, workspace);   // the workspace has other cells
    }
    if (!choose_view(problem, looks)) break;
    if (looks.last_is_best) std::swap(laid_, best_);
    find_spots(problem, looks.view);
    judge(problem, press(problem, looks.view), looks);
  }
  settled_ = !looks.goes_on && looks.best_merit.missed == 0.0;
  if (!looks.last_is_best) std::swap(laid_, best_);
  if (!looks.nested && can_nest(problem, looks) && needs_nested(problem.options)) {
    if (press_nested(problem, looks)) return true;
    looks.last_is_best = false;
  }
  // If the tilt has not settled, finer cells do not help.
  const double finer = settled_ ? needs_finer(problem.options) : 1.0;
  const bool last_laid = finer > 1.0 ? refine(problem, looks, finer) : looks.last_is_best;
  if (!last_laid) laid_.place(surface, workspace);  // the workspace has other cells
  return true;
}

// Depth of an exact contact on coupled cells [m]; 0 for others, which more cells do not improve.
double PatchPress::exact_depth(const LawOptions& options) const {
  return options.law->couples() && laid_.contact().exact() ? laid_.contact().indentation() : 0.0;
}

// Whether the best contact, which is laid, can be pressed on nested cells.
bool PatchPress::can_nest(const Problem& problem, const Looks& looks) const {
  const LawOptions& options = problem.options;
  if (looks.best_merit.missed > 0.0 || !options.tilting || !(exact_depth(options) > 0.0)) return false;
  // The first nested cells are coarser by this factor in length and width. They are in vain if they cannot be split,
  // unless they are laid under other parts of the body as well.
  return laid_.cells().lattices().can_split(std::sqrt(kCoarse) * options.narrowest) || next_part().share < 1.0;
}

// Whether the best contact is pressed on nested cells before other looks. Looks at a single spot soon agree, those at
// cells along ridges do as well, and many cells are dear to split.
bool PatchPress::nests_early(const Problem& problem, const Looks& looks) const {
  const bool suits = spots_.size() > 1 && problem.options.cells < kManyCells && !along_ridges();
  return suits && looks.goes_on && looks.last_is_best && can_nest(problem, looks);
}

// Whether a contact that can be pressed on nested cells is to be, after all looks.
bool PatchPress::needs_nested(const LawOptions& options) {
  const double depth = exact_depth(options);
  // If no cell tells of the body's lowest part, cells are too large for it.
  const double least = *std::min_element(laid_.heights().begin(), laid_.heights().end());
  if (least > kOverlooked * laid_.contact().lowered()) return true;
  const bool apart = spots_.size() > 1 || spots_.front().is_open(), many = options.cells >= kManyCells;
  if (apart && !along_ridges() && leaves_uncovered(many ? kUncovered : 0.0)) return true;
  if (many) return overlooks();
  if (!settled_) return true;
  const double smooth = kNestedSmooth / static_cast<double>(options.cells) * depth;
  return spots_.size() > 1 && laid_.cells().roughness(laid_.pressed(), depth) > smooth;
}

// Press the body on few cells under all parts that may touch, then split the cells where it does. All these presses see
// the body from one plane, so one tilt leads to the next. Looks may contradict each other, because each lays other
// cells. False if no contact is found that is as good as the best one; that one stays then.
bool PatchPress::press_nested(const Problem& problem, const Looks& looks) {
  const bool open = laid_.tilt() > kMostSlope || laid_.tilts_openly();
  best_ = laid_;
  // A contact that leaves its tilt open is not looked at anew. Energies count from what the search sees.
  if (open && !looks.last_is_best) find_spots(problem, looks.best);
  bool solved = open || press_generous(problem, looks.best);
  const std::size_t coarse = laid_.count();
  for (int split = 0; solved && split < kSplits; ++split) {
    const std::size_t before = laid_.count();
    choose_to_split(problem.options, split == 0);
    solved = split_pressed(problem);
    if (laid_.count() == before) break;
  }
  // A contact that looks agree on is replaced only by one of clearly less energy, because rounding may decide between
  // cells that tell the same.
  const double margin = settled_ ? -kFineEnergyMargin : kEnergyMargin;
  const bool better = solved && laid_.count() > coarse &&
                      !is_worse(merit(problem.load, next_part(), problem.options), looks.best_merit, margin);
  if (!better) std::swap(laid_, best_);
  settled_ = settled_ || better;
  return better;
}

// Press the body, tilted as found, on few cells under all parts that may touch. If others touch nevertheless, cells are
// laid wherever the body is low enough. False if no contact is found.
bool PatchPress::press_generous(const Problem& problem, Viewpoint view) {
  view.finer = kCoarse;
  view.end_height = view.spot_end = 0.0;
  bool ends_early = false;
  NextPart next = next_part();
  for (int look = 0; look < kGenerousLooks; ++look) {
    if (view.everywhere) view.finer = std::max(kCoarse, kFewest / static_cast<double>(problem.options.cells));
    double highest = kGenerous * laid_.touched_height(true);
    if (look > 0) highest = std::max(highest, (ends_early ? kGenerous : 1.0) * view.least_height);
    if (next.share < 1.0) highest = std::max(highest, kTouchMargin * next.height);
    view.spot_height = view.least_height = view.most_height = highest;
    for (int k = 0; k < 2; ++k) view.plane.slopes[k] += std::min(next.share, 1.0) * laid_.contact().slopes()[k];
    find_spots(problem, view);
    if (!press(problem, view) || !laid_.contact().exact()) return false;
    const CellContact& contact = laid_.contact();
    const bool lifts = laid_.lifted(contact.slopes()) > kMostLift * contact.indentation();
    const bool open = leaves_uncovered(0.0);
    ends_early = laid_.ends_early();
    if (!lifts && !open && !ends_early) break;
    next = next_part();
    // A contact that misses a part of the body does not tell where cells are needed.
    view.everywhere = view.everywhere || ((open || next.share < 1.0) && spots_.size() < kManySpots);
  }
  return true;
}

// Choose cells to split: all that press or are beside such, or those with uneven neighbours. If they are too many, only
// the most uneven ones. Those that overlook a part of the body are split as well, as long as cells are not too many for
// any number asked for.
void PatchPress::choose_to_split(const LawOptions& options, bool all) {
  const auto cells = static_cast<double>(options.cells);
  const double many = std::max((options.tangential->couples() ? 1.0 : kMostOfMany) * cells, kManySplit);
  const double most = std::min(kMostSplit * cells, many);
  if (all) {
    laid_.cells().find_around(laid_.pressed(), chosen_);
    if (split_count(options.narrowest) <= most) return;
  }
  double least = kUneven * laid_.contact().indentation(), much = kStillOverlooked * laid_.contact().lowered();
  for (;;) {
    laid_.cells().find_rough(laid_.contact(), least, chosen_);
    const bool few = split_count(options.narrowest) <= most;
    if (few) add_overlooking(much);
    if (few && split_count(options.narrowest) <= many) return;
    (few ? much : least) *= kMoreUneven;
  }
}

// Add the cells that hold a point of the body lower than their height tells by `much` [m].
void PatchPress::add_overlooking(double much) {
  const double lowered = laid_.contact().lowered();
  search_.each_sample(seen_plane(), [&](const Point& at, double height) {
    if (!(height < lowered)) return;
    laid_.cells().lattices().each_number_at(at, [&](std::size_t cell) {
      if (laid_.heights()[cell] - height > much) chosen_[cell] = 1;
    });
  });
}

// Whether some cell holds a point of the body that is much lower than its height tells.
bool PatchPress::overlooks() {
  chosen_.assign(laid_.count(), 0);
  add_overlooking(kStillOverlooked * laid_.contact().lowered());
  return std::find(chosen_.begin(), chosen_.end(), 1) != chosen_.end();
}

// Whether of the points that the body presses deeply more than a share lie under no cell.
bool PatchPress::leaves_uncovered(double share) const {
  const double deep = (1.0 - kStillOverlooked) * laid_.contact().lowered();
  double count = 0.0, uncovered = 0.0;
  search_.each_sample(seen_plane(), [&](const Point& at, double height) {
    if (!(height < deep)) return;
    bool covered = false;
    laid_.cells().lattices().each_number_at(at, [&](std::size_t) { covered = true; });
    count += 1.0;
    if (!covered) uncovered += 1.0;
  });
  return uncovered > share * count;
}

// Number of cells after the chosen ones are split; 0 if none of them can be.
double PatchPress::split_count(double narrowest) const {
  const auto count = static_cast<double>(laid_.cells().count_splittable(chosen_, narrowest));
  return count > 0.0 ? static_cast<double>(chosen_.size()) + 3.0 * count : 0.0;
}

void PatchPress::refine_flat_rim(const HeightMap& map, const ContactSurface& surface, const double* wrench,
                                 CellContact::Workspace& workspace) {
  const double depth = exact_depth(surface.options);
  if (!(depth > 0.0) || along_ridges()) return;   // cells along ridges cannot be split
  laid_.cells().find_rim(laid_.pressed(), chosen_);
  if (!(laid_.cells().flat_share(laid_.contact(), chosen_, kFlat * depth) > kMostlyFlat)) return;
  refine_rim(map, surface, wrench, workspace);
}

void PatchPress::refine_rim(const HeightMap& map, const ContactSurface& surface, const double* wrench,
                            CellContact::Workspace& workspace) {
  const LawOptions& options = surface.options;
  const double most = options.tangential->couples() ? kManySheared : kManyAtRim;
  if (!options.law->couples() || !laid_.contact().exact()) return;
  laid_.cells().find_rim(laid_.pressed(), chosen_);
  laid_.cells().add_ends(laid_.pressed(), chosen_);
  if (split_count(options.narrowest) > most) laid_.cells().find_rim(laid_.pressed(), chosen_);
  const double count = split_count(options.narrowest);
  if (count == 0.0 || count > most) return;
  best_ = laid_;
  if (split_pressed({map, surface, options, wrench, workspace, {}, {}})) return;
  std::swap(laid_, best_);
  laid_.place(surface, workspace);
}

// Split the chosen cells and press the body on the new ones. False if no contact is found.
bool PatchPress::split_pressed(const Problem& problem) {
  if (split_count(problem.options.narrowest) == 0.0) return true;
  if (!laid_.split(chosen_, problem.surface, start_, problem.workspace)) return false;
  laid_.press(problem.surface, problem.wrench, start_, overloads(), problem.workspace);
  return laid_.contact().exact();
}

// Number of cells that the contact needs, over that asked for; 1 if its own are fine enough.
double PatchPress::needs_finer(const LawOptions& options) const {
  const double depth = exact_depth(options);
  if (!(depth > 0.0)) return 1.0;
  const double wanted = laid_.cells().roughness(laid_.pressed(), depth) / (kSmooth * depth);
  const double many = options.tangential->couples() ? kManySheared : kManyFiner;
  const double most = std::min(kMostFiner, many / static_cast<double>(options.cells));
  return wanted > kWorthwhile ? std::max(std::min(wanted, most), 1.0) : 1.0;
}

// Press the body on more cells, as the best look sees it. False if that finds no contact, or one of much more energy,
// whose cells miss a part of the body; what was found stays then.
bool PatchPress::refine(const Problem& problem, const Looks& looks, double finer) {
  Viewpoint view = looks.best;
  view.finer = finer;
  const double margin = along_ridges() ? kEnergyMargin : kFinerMargin;
  std::swap(laid_, best_);
  if (!looks.last_is_best) find_spots(problem, view);
  const bool solved = press(problem, view) && laid_.contact().exact();
  const Merit found = solved ? merit(problem.load, next_part(), problem.options) : Merit{};
  if (solved && !is_worse(found, looks.best_merit, margin)) return true;
  std::swap(laid_, best_);
  return false;
}

SearchLoad PatchPress::load_of(const double* wrench, const ContactSurface& surface) {
  SearchLoad load;
  load.force = -wrench[2];
  load.through = centre_of_pressure(wrench);
  load.modulus = 1.0 / (kHalfTurn * surface.compliance.factor());
  load.least_area = surface.options.strength > 0.0 ? kSpareArea * load.force / surface.options.strength : 0.0;
  load.narrowest = surface.options.narrowest;
  load.follows = surface.options.law->couples();
  return load;
}

PatchPress::Viewpoint PatchPress::first_view(const Problem& problem) const {
  constexpr double first = SpotLattices::kHeightFactor;
  Viewpoint view = {{{0.0, 0.0}, problem.load.through}, first, 0.0, 0.0, 0.0, 0.0, 0.0, {0.0, 0.0}, 1.0, false};
  if (problem.options.tilting) view.plane = first_plane(problem);
  return view;
}

// The first look, on which the others build. False if no part of the body faces the pad.
bool PatchPress::look_first(const Problem& problem, Looks& looks) {
  const LawOptions& options = problem.options;
  find_spots(problem, looks.view);
  if (options.tilting && !search_.supported(problem.load)) {
    // The spots do not support the load. So the body tilts until the force passes through the area on which it rests.
    rest_on_springs(problem, looks);
    find_spots(problem, looks.view);
  }
  // Under a law without coupling, contact extends further out than on an elastic surface.
  if (options.law->couples() && SpotLattices::is_compact(spots_, options)) looks.view.height_factor = kCompact;
  if (!press(problem, looks.view)) return false;
  if (laid_.contact().exact()) judge(problem, true, looks);
  return true;
}

// Choose the next view. False if the best contact is found, or no other view is known.
bool PatchPress::choose_view(const Problem& problem, Looks& looks) {
  const bool lost = problem.options.law->couples() && looks.best_merit.missed > 0.0 && problem.hull.size() > 2 &&
                    holds(problem.hull, problem.load.through, kInside);
  if (looks.last_is_best) {
    if (laid_.contact().exact() && presses_all()) return false;
    // If no contact is found or it misses the load, other parts of the body carry the load, and the body first tilts
    // onto them. This is not tried for a load outside the hull, because the first plane is tilted as far as possible
    // already. Nor is it tried for laws that do not couple cells, because the body would rest in the same way again.
    looks.resting_tried = lost && !looks.rested;
    if (looks.resting_tried) {
      looks.view = looks.best;
      rest_on_springs(problem, looks);
      return true;
    }
  } else if (!looks.resting_tried && !looks.moved) {
    if (!looks.view.sees_tilted_as(looks.best)) {
      // The tilt was too large. The mean of this view and the best one is tried.
      if (++looks.steps_back > kStepsBack) return false;
      std::copy(looks.view.plane.slopes, looks.view.plane.slopes + 2, looks.too_far);
      looks.turned_back = true;
      for (int k = 0; k < 2; ++k) looks.view.plane.slopes[k] = (looks.too_far[k] + looks.best.plane.slopes[k]) / 2;
      return true;
    }
  }
  // Another look with the same tilt would miss the load as well.
  const bool tilts_on = looks.goes_on && !looks.onward.sees_tilted_as(looks.best);
  looks.moved = lost && !tilts_on && looks.moves < kMoves;
  if (looks.moved) return move_to_others(problem, looks);
  Viewpoint onward = looks.onward;
  if (looks.turned_back) stay_before(looks.too_far, looks.best.plane.slopes, onward.plane.slopes);
  const bool in_vain = !looks.last_is_best && onward.sees_as(looks.view);   // the last look was this one
  looks.view = onward;
  looks.resting_tried = false;
  return looks.goes_on && !in_vain;
}

// Set the view to one that may see other parts, because those seen so far do not carry the load. False if there are
// none.
bool PatchPress::move_to_others(const Problem& problem, Looks& looks) {
  const bool solved = looks.last_is_best && laid_.contact().exact();
  ++looks.moves;
  looks.view = looks.best;
  if (solved) return roll(problem.load, looks.view);
  // Springs are softer than the surface where the contact is narrow, so the body may need parts above the spots.
  looks.view.spot_height = kRaise * std::max(search_.reached(), search_.level());
  return true;
}

// Roll the view from the last contact toward the load, which it misses, until another part touches. The cells of an
// edge do not tell the tilt about it. False if no part touches within the largest slope.
bool PatchPress::roll(const SearchLoad& load, Viewpoint& view) const {
  Point centre;
  if (!laid_.centre(centre)) return false;
  const double along[2] = {load.through.x - centre.x, load.through.y - centre.y};
  const double away = std::hypot(along[0], along[1]);
  if (!(away > 0.0)) return false;
  const double toward[2] = {along[0] / away, along[1] / away};
  const NextPart next = next_part(toward, centre);
  const double to[2] = {view.plane.slopes[0] + next.share * toward[0], view.plane.slopes[1] + next.share * toward[1]};
  if (!(std::hypot(to[0], to[1]) <= kMostSlope)) return false;
  std::copy(to, to + 2, view.plane.slopes);
  view.spot_height = kRaise * next.height;
  view.most_height = view.end_height = view.spot_end = 0.0;
  return true;
}

// Set the view to the tilt at which the body rests on springs, with the slope bounded.
void PatchPress::rest_on_springs(const Problem& problem, Looks& looks) {
  Plane& plane = looks.view.plane = search_.resting(problem.load);
  const double slope = std::hypot(plane.slopes[0], plane.slopes[1]);
  for (double& one : plane.slopes) one *= std::min(1.0, kMostSlope / std::max(slope, kMostSlope));
  looks.rested = true;
}

void PatchPress::find_spots(const Problem& problem, const Viewpoint& view) {
  SearchLoad load = problem.load;
  load.reach = view.spot_height;
  if (view.spot_end > 0.0) load.end = view.spot_end;
  spots_ = search_.find(problem.map, view.plane, load);
  if (view.everywhere) spots_ = {search_.everything()};
}

// Lay cells on the spots and press them. False if there are no cells.
bool PatchPress::press(const Problem& problem, const Viewpoint& view) {
  const LawOptions& options = problem.options;
  SampledLattices& sampled = laid_.see({&problem.map, {view.plane.slopes[0], view.plane.slopes[1]}, view.plane.middle,
                                        search_.lowest(), highest_cells(options, view) + search_.same()});
  const double strip = view.finer < 1.0 ? 0.0 : search_.strip();   // cells along ridges cannot be split
  lattices_.lay({spots_, laid_.view(), search_, options, view.finer, view.height_factor, strip, view.everywhere},
                sampled);
  if (!laid_.lay(problem.surface, problem.workspace)) return false;
  start_.clear();
  for (const double height : laid_.heights()) start_.push_back(height <= kLikelyEnd * search_.level() ? 1 : 0);
  laid_.press(problem.surface, problem.wrench, start_, overloads(), problem.workspace);
  return true;
}

bool PatchPress::overloads() const { return search_.level() > kOverloaded * search_.loaded(); }

// Compare the contact of the last look with the best one, and find the view to which it leads.
void PatchPress::judge(const Problem& problem, bool pressed, Looks& looks) const {
  const bool solved = pressed && laid_.contact().exact();
  const NextPart next = solved ? next_part() : NextPart{};
  const Merit found = solved ? merit(problem.load, next, problem.options) : Merit{};
  const double margin = problem.options.cells < kManyCells ? kEnergyMargin : kFineEnergyMargin;
  looks.last_is_best = solved && !is_worse(found, looks.best_merit, margin);
  if (!looks.last_is_best) return;
  looks.best = looks.onward = looks.view;
  looks.best_merit = found;
  looks.nested = false;
  looks.steps_back = 0;
  looks.goes_on = next_view(found, next, problem.options, looks.onward) && !looks.onward.sees_as(looks.view);
}

bool PatchPress::presses_all() const {
  return search_.sees_all() && laid_.all_press();
}

// A load close to the rim of the hull tilts the body onto a strip along the rim. A load close to two sides that meet
// tilts it onto their corner. Each side's weight grows with its length beside the load and with its closeness. So the
// plane is a continuous function of the load, also if a side consists of several pieces. A hull that is narrower than
// the narrowest cells does not tilt across, because rounding alone may tell its sides.
Plane PatchPress::first_plane(const Problem& problem) const {
  const SearchLoad& load = problem.load;
  const std::vector<Point>& hull = problem.hull;
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
    if (!(depth > problem.options.narrowest)) continue;
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
  // 0 if the sides form a right corner, 1 if they are one straight line.
  const double straight = std::max((size / all - kCorner) / (1.0 - kCorner), 0.0);
  double strip = kStrip * distance / all;
  const double length = straight * breadth(hull, inward, strip), corner = 1.0 - straight;
  const double across = length + corner * std::sqrt(load.least_area);
  strip = std::max(strip, load.least_area / std::max(across, std::sqrt(load.least_area)));
  const double level = load.force / (load.modulus * (length + corner * strip + strip));
  for (int k = 0; k < 2; ++k) plane.slopes[k] = -level / strip * inward[k];
  return plane;
}

double PatchPress::missed(const SearchLoad& load) const {
  Point centre;
  if (!laid_.centre(centre)) return 0.0;
  const double away = std::hypot(centre.x - load.through.x, centre.y - load.through.y);
  return away > std::max(kMissed * laid_.face().length, load.narrowest) ? away : 0.0;
}

PatchPress::Merit PatchPress::merit(const SearchLoad& load, const NextPart& next, const LawOptions& options) const {
  if (!options.tilting || !options.law->couples()) return {};
  const double elastic = laid_.contact().energy(), overlooked = next.share < 1.0 ? kOverlooking * elastic : 0.0;
  const std::vector<double>& areas = laid_.face().areas;
  const double borne = options.strength * std::accumulate(areas.begin(), areas.end(), 0.0);
  const double lacks = options.strength > 0.0 ? std::max(1.0 - borne / load.force, 0.0) : 0.0;
  return {lacks, missed(load), laid_.energy(load.force) + overlooked, elastic};
}

bool PatchPress::is_worse(const Merit& one, const Merit& other, double margin) {
  if ((one.lacks > kLacking) != (other.lacks > kLacking)) return one.lacks > kLacking;
  if (one.missed > 0.0 || other.missed > 0.0) return one.missed > (1.0 + kMissed) * other.missed;
  return one.energy > other.energy + margin * one.elastic;
}

// Height up to which cells are laid in a view.
double PatchPress::highest_cells(const LawOptions& options, const Viewpoint& view) const {
  double highest = std::max(search_.level(), options.facing_gap);
  if (options.law->shapes()) {
    highest = std::max(search_.loaded() * view.height_factor, search_.reached());
    const double bounded = SpotLattices::kBoundedHeightFactor * search_.level();
    if (search_.lacks_area()) highest = std::max(highest, bounded);
  }
  if (view.most_height > 0.0) highest = std::min(highest, std::max(view.most_height, search_.level()));
  if (view.end_height > 0.0) highest = std::min(highest, view.end_height);
  return std::max(highest, view.least_height);
}

// The depth that the rise of a tilt is compared with [m].
double PatchPress::depth_of_tilts() const { return std::max(search_.loaded(), laid_.contact().indentation()); }

// The part of the body that first touches the surface during the tilt that the last look found. A small tilt counts as
// none.
PatchPress::NextPart PatchPress::next_part() const {
  const double* slopes = laid_.contact().slopes();
  if (!(std::hypot(slopes[0], slopes[1]) * search_.extent() > kSmallTilt * depth_of_tilts())) return {};
  Point centre;
  if (!laid_.centre(centre)) return {};
  return next_part(slopes, centre);
}

// The part that first touches during a tilt about the contact's centre of pressure.
PatchPress::NextPart PatchPress::next_part(const double* tilt, const Point& centre) const {
  const double* slopes = laid_.contact().slopes();
  const double sunk = laid_.lowered_at_origin() + slopes[0] * centre.x + slopes[1] * centre.y;
  widen_regions(kOtherPart);
  return {search_.share_until(seen_plane(), {{tilt[0], tilt[1]}, centre}, sunk, wider_), sunk};
}

// Whether the body comes down to other parts of it than those with cells. A part that rises from its edge, as a wedge
// does, goes on beyond its region in proportion to the height.
bool PatchPress::reaches_other_part() const {
  const double lowered = laid_.contact().lowered();
  if (along_ridges()) return search_.has_more_ridges(lowered);
  if (search_.sees_all()) return false;
  widen_regions(std::max(kOtherPart, 2.0 * lowered / laid_.view().highest));
  return search_.lower_than(seen_plane(), lowered, wider_);
}

void PatchPress::widen_regions(double factor) const {
  wider_ = lattices_.regions();
  for (Region& one : wider_) one.width *= factor, one.height *= factor;
}

Plane PatchPress::seen_plane() const {
  return {{laid_.view().slopes[0], laid_.view().slopes[1]}, laid_.view().middle};
}

// Find the next view. False if the contact agrees with the view: it is not deeper than the cells are high, enough cells
// press, and the body does not tilt.
bool PatchPress::next_view(const Merit& found, const NextPart& next, const LawOptions& options, Viewpoint& view) const {
  const bool carries = found.missed == 0.0;
  if (tilts(carries, next, options)) return tilt_view(carries, next, options, view);
  return raise_cells(view) || find_other_parts(view) || drop_needless_cells(options, view) || raise_ends(options, view);
}

// Whether the body tilts. Where the contact carries the load, a small tilt or that of a narrow strip needs no other
// look, unless another part touches during the tilt.
bool PatchPress::tilts(bool carries, const NextPart& next, const LawOptions& options) const {
  if (carries && next.share < 1.0) return true;
  const double* slopes = laid_.contact().slopes();
  const double lift = laid_.lifted(slopes);
  if (carries && lift <= kNarrow * options.narrowest * std::hypot(slopes[0], slopes[1])) return false;
  return lift > (along_ridges() ? kSmallTiltOfStrips : kSmallTilt) * depth_of_tilts();
}

// Tilt the view as the body does, or less. False if the body falls over: no tilt within the largest slope carries the
// load.
bool PatchPress::tilt_view(bool carries, const NextPart& next, const LawOptions& options, Viewpoint& view) const {
  const double* slopes = laid_.contact().slopes();
  const double rolling = secant_share(slopes, view.last_tilt);
  // The tilt ends at the next part that touches. A part that was searched for before is not apart from the others.
  const bool searched = carries && kTouchMargin * next.height <= view.spot_height;
  const double share = std::min(rolling, searched ? std::max(next.share, kLeastShare) : next.share);
  std::copy(slopes, slopes + 2, view.last_tilt);
  const double to[2] = {view.plane.slopes[0] + share * slopes[0], view.plane.slopes[1] + share * slopes[1]};
  const double slope = std::hypot(to[0], to[1]);
  if (slope > kMostSlope && std::hypot(view.plane.slopes[0], view.plane.slopes[1]) > kNearlyFallen * kMostSlope) {
    return false;
  }
  const double least_share = std::min(1.0, kMostSlope / slope);
  for (int k = 0; k < 2; ++k) view.plane.slopes[k] = least_share * to[k];
  const double touched = laid_.touched_height(options.tilting);
  if (laid_.contact().exact()) view.most_height = laid_.goes_beyond() ? 0.0 : touched;
  view.least_height = laid_.ends_early() ? kTouchMargin * touched : 0.0;
  view.end_height = view.spot_end = 0.0;
  // If there is one spot that fills its rectangle, no part of the body is outside it.
  const bool open = any_is_open(spots_);
  const double share_of_depth = open && along_ridges() ? kTiltedShareOfRings : kTiltedShare;
  view.spot_height = spots_.size() > 1 || open ? share_of_depth * laid_.contact().indentation() : 0.0;
  if ((carries && next.share < 1.0) || share < rolling) {
    view.spot_height = std::max(view.spot_height, kTouchMargin * next.height);
    if (view.most_height > 0.0) view.most_height = std::max(view.most_height, view.spot_height);
  }
  return true;
}

// Lay cells higher if the contact is so deep that parts above the cells touch as well. Cells along ridges are as wide
// as the contact, which is deeper than they are high.
bool PatchPress::raise_cells(Viewpoint& view) const {
  const double deep = laid_.contact().indentation(), high = laid_.view().highest;
  if (!(search_.level() > 0.0) || along_ridges() || !(deep > kTooDeep * high)) return false;
  if (!(view.height_factor < kMostHeightFactor)) return false;
  const double deeper = std::min(kShareOfDepth * deep / high, kMostHigher);
  view.height_factor = std::min(view.height_factor * deeper, kMostHeightFactor);
  return true;
}

// Gather spots up to the height to which the body sinks in, if other parts of it are that low.
bool PatchPress::find_other_parts(Viewpoint& view) const {
  const double lowered = laid_.contact().lowered();
  if (!(view.spot_height < lowered) || !reaches_other_part()) return false;
  view.spot_height = kTouchMargin * lowered;
  return true;
}

// End the cells at the height to which the body sinks in, if too few of them press.
bool PatchPress::drop_needless_cells(const LawOptions& options, Viewpoint& view) const {
  if (!(search_.level() > 0.0) || along_ridges()) return false;
  const LaidLower& lower = options.tilting ? kLaidLowerTilting : kLaidLowerUpright;
  const auto pressed = static_cast<double>(std::count(laid_.pressed().begin(), laid_.pressed().end(), 1));
  const double touching = kTouchMargin * laid_.touched_height(options.tilting);
  if (!(pressed < lower.pressed * static_cast<double>(laid_.count()))) return false;
  if (!(touching < lower.height * laid_.view().highest)) return false;
  view.end_height = touching;
  // Spots up to a level above the contact's end may hold several places where the body touches.
  if (search_.level() > touching) view.spot_end = touching;
  return true;
}

// Lay cells up to the contact's end, with its margin, if they end before it. Those that were laid so before go up to
// it unless the body touches above them.
bool PatchPress::raise_ends(const LawOptions& options, Viewpoint& view) const {
  if (!laid_.ends_early()) return false;
  const double touched = laid_.touched_height(options.tilting), touching = kTouchMargin * touched;
  if (!((view.least_height > 0.0 ? touched : touching) > laid_.view().highest)) return false;
  view.least_height = touching;
  return true;
}

}  // namespace mjtactile
