#include "contact/pad_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

#include "geometry/hash.hpp"
#include "linalg/angles.hpp"
#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

// Number of steps at one pose after which a basis is made.
constexpr double kSteady = 8.0;
// A face that extends beyond the sheet is cut at the sheet's edge, for a placement rounded to this [m, rad]. The error
// of the edge is a hundredth of the depth of the first taxels. A right angle is a multiple of the angle's step, so that
// scenes turned by it are cut alike.
constexpr double kCutStep = 5e-6, kCutTurn = kRightAngle / 3142;
constexpr std::size_t kMostCutFaces = 64;
// Share of a cut outline that must lie on the sheet's rim for cells along the sheet's axes. It is not a ratio of simple
// shapes.
constexpr double kMostlyRim = 0.503;
// Least cosine of a face's slope with which it may face the pad alone.
constexpr double kFacing = 0.9;
// Largest distance of a pressing face from the surface, above it or, with soft contacts, below it, over the pad's
// depth.
constexpr double kNear = 0.8;
// Parts of a body that are deeper in the pad than MuJoCo's contacts, by the factor kDeeper and the length kDeeperBy
// [m], may be beside the pad. They are taken to be if the body tilts by more than the slope kTurned to rest on them,
// and by less than the fraction kTurnsLess of that without them.
constexpr double kDeeper = 1.5, kDeeperBy = 1e-4;
constexpr double kTurned = 0.05, kTurnsLess = 0.5;
// Parts of meshes that are higher than this above the lowest one, over the pad's thickness, are looked at only if the
// body sinks in or tilts so far that they may touch.
constexpr double kReach = 0.3;
// A contact counts as carrying all of the force if it carries this fraction.
constexpr double kBears = 0.99;
// Least side of the squares about contact points, over the facing gap. They carry a body whose geometry does not face
// the pad.
constexpr double kLeastSpot = 4.0;
// Several bodies are solved in turn for at most this many rounds, or until no cell's force changes by more than this
// fraction of the body's force.
constexpr int kRounds = 12;
constexpr double kSettled = 1e-8;
// A residual above this fraction of the wrench is reported. Smaller ones come from rounding and the margin at a face's
// rim.
constexpr double kLeftOver = 5e-3;
// Forces outside 2^-20 to 2^20 N are scaled, because single precision must hold the squares of stresses.
constexpr int kCommonPowers = 20;
// Width of the narrowest cells over the pad's depth.
constexpr double kNarrowest = 0.01;
// Number of contact cells up to which shear is solved within the time of a step. With more cells, the allowed time
// grows with the cube of their number.
constexpr double kQuick = 100.0;
// Hashes are kept as doubles, which hold whole numbers up to 2^53 exactly.
constexpr std::uint64_t kHashMask = (std::uint64_t{1} << 52) - 1;
// Whether deviatoric coordinates and the mean stress change their sign under x -> -x and y -> -y
// (mjtactile/influence/matrices.py).
constexpr bool kOdd[kDeviatoric][2] = {{false, false}, {false, false}, {true, true}, {false, true}, {true, false}};
constexpr bool kEven[1][2] = {{false, false}};

std::array<std::int64_t, 12> rounded(const Pose& pose, double tolerance) {
  std::array<std::int64_t, 12> whole;
  for (std::size_t i = 0; i < 3; ++i) whole[i] = std::llround(pose.position[i] / tolerance);
  for (std::size_t i = 0; i < 9; ++i) whole[3 + i] = std::llround(pose.rotation[i] / tolerance);
  return whole;
}

Pose at(const std::array<std::int64_t, 12>& whole, double tolerance) {
  Pose pose;
  for (std::size_t i = 0; i < 3; ++i) pose.position[i] = static_cast<double>(whole[i]) * tolerance;
  for (std::size_t i = 0; i < 9; ++i) pose.rotation[i] = static_cast<double>(whole[3 + i]) * tolerance;
  return pose;
}

double pressing(const Touch& touch) { return -touch.wrench[2]; }

// The largest absolute number in the wrenches; not finite if one of them is not finite.
double largest_of(const Touch* touches, std::size_t count) {
  double largest = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    for (const double part : touches[i].wrench) {
      if (!std::isfinite(part)) return part;
      largest = std::max(largest, std::abs(part));
    }
  }
  return largest;
}

double borne_by(const CellContact& contact) {
  return std::accumulate(contact.normal().begin(), contact.normal().end(), 0.0);
}

}  // namespace

Point on_pad(const SolvedCells& solved, const double* at) {
  return solved.bent == nullptr ? solved.placement({at[0], at[1]}) : solved.bent->plane().on_pad(at);
}

// Add the edges of a contact's area under pressure.
void add_rim(const SolvedCells& solved, std::vector<Segment>& edges) {
  const auto pressed = [&](std::int32_t cell) { return cell >= 0 && solved.forces.forces[3 * cell + 2] < 0.0; };
  for (const CellEdge& edge : solved.face->edges) {
    const bool left = pressed(edge.left);
    if (left == pressed(edge.right)) continue;
    const Point start = on_pad(solved, edge.start), end = on_pad(solved, edge.end);
    edges.push_back(left ? Segment{start, end} : Segment{end, start});
  }
}

PadSensor::PadSensor(std::shared_ptr<const Pad> pad, LawOptions options, double facing_gap, double tolerance)
    : pad_(std::move(pad)), options_(options), facing_gap_(facing_gap), tolerance_(tolerance),
      response_(std::visit([this](const auto& maps) -> decltype(response_) {
        return Response(maps, pad_->has_mean());
      }, pad_->maps())) {
  if (!(options_.narrowest > 0.0)) options_.narrowest = kNarrowest * pad_->depth();
  options_.facing_gap = facing_gap_;
  shear_.set_patience(std::max(std::pow(static_cast<double>(options_.cells) / kQuick, 3.0), 1.0));
  forces_.resize(3 * pad_->surface().nodes_x() * pad_->surface().nodes_y());
}

void PadSensor::press(const Touch* touches, std::size_t count, const Steadiness& before) {
  begin(count);
  if (!touched_) return;
  key_ = key_of(touches, count);
  const double largest = largest_of(touches, count);
  if (!std::isfinite(largest)) {
    // The simulation has diverged, so no result would be right.
    set_response(std::numeric_limits<double>::quiet_NaN());
    std::fill(pressed_.carried, pressed_.carried + 6, std::numeric_limits<double>::quiet_NaN());
    pressed_.range = std::numeric_limits<double>::quiet_NaN();
    note(Event::refused, touches[0], largest, largest);
    return;
  }
  // The surface carries no more than its bound on pressure allows, however large the contact force is.
  const double most = options_.strength > 0.0 ? options_.strength * sheet().area() : largest;
  const int power = std::ilogb(std::max(std::min(largest, most), std::numeric_limits<double>::min()));
  if (std::abs(power) > kCommonPowers) power_ = power;
  const bool steady = count == 1 && before.pose == key_ && before.steps >= kSteady && !pad_->has_mean() &&
                      !keeps_forces_ && options_.law->couples();
  for (std::size_t i = 0; i < count; ++i) press_alone(touches[i], i, steady);
  const auto solved = std::count(solved_.begin(), solved_.end(), 1);
  if (solved > 1 && options_.law->couples()) couple(touches, count);
  for (std::size_t i = 0; i < count; ++i) {
    if (!solved_[i]) continue;
    finish(touches[i], *presses_[i]);
    if (keeps_forces_) add_rim(solved_cells(i), rims_[i]);
  }
  if (!begun_) set_response(0.0);  // nothing was added
}

// Reset all results to those of a pad without contact.
void PadSensor::begin(std::size_t count) {
  touched_ = count > 0;
  key_ = 0.0;
  power_ = 0;
  std::fill(pressed_.carried, pressed_.carried + 6, 0.0);
  pressed_.range = pressed_.indentation = pressed_.area = pressed_.peak = 0.0;
  pressed_.notes.clear();
  if (rims_.size() < count) rims_.resize(count);
  for (std::vector<Segment>& rim : rims_) rim.clear();
  if (keeps_forces_) total_.assign(forces_.size(), 0.0);
  begun_ = false;
  if (!touched_) return;
  while (presses_.size() < count) presses_.push_back(std::make_unique<BodyPress>());
  solved_.assign(count, 0);
}

void PadSensor::set_response(double value) {
  std::visit([value](auto& own) {
    std::fill(own.deviatoric.begin(), own.deviatoric.end(), value);
    std::fill(own.mean.begin(), own.mean.end(), value);
  }, response_);
  begun_ = true;
  kept_.basis.reset();
}

// Hash of the touching bodies and their rounded poses.
double PadSensor::key_of(const Touch* touches, std::size_t count) const {
  std::uint64_t hash = count;
  for (std::size_t i = 0; i < count; ++i) {
    hash = mixed(hash, static_cast<std::uint64_t>(touches[i].body));
    for (const std::int64_t one : rounded(touches[i].pose, tolerance_)) {
      hash = mixed(hash, static_cast<std::uint64_t>(one));
    }
  }
  return static_cast<double>(hash & kHashMask);
}

// Solve one body's contact as if it were alone. `place`: index of its BodyPress.
void PadSensor::press_alone(const Touch& seen, std::size_t place, bool steady) {
  BodyPress& press = *presses_[place];
  // A body without a load keeps the plane in which its last contact lies.
  const bool loaded = std::any_of(seen.wrench, seen.wrench + 6, [](double one) { return one != 0.0; });
  const Touch& touch = curved() && loaded ? turned(seen, press) : seen;
  if (!(pressing(touch) > 0.0)) {
    note_carried(seen, std::array<double, 6>{}.data());
    return;
  }
  Placement placement = kUnmoved;
  // A whole flat side cannot touch a curved pad.
  const std::shared_ptr<const Face> face = curved() ? nullptr : face_towards(touch, placement);
  if (face != nullptr && steady && press_steady(touch, face)) return;
  if (face != nullptr && !options_.law->shapes() && press_linear(touch, *face, placement, place)) return;
  solved_[place] = solve(touch, press, face, placement) ? 1 : 0;
  if (solved_[place] || press_points(seen, press, place)) return;
  note(Event::refused, touch, 0.0, 0.0);
  note_carried(seen, std::array<double, 6>{}.data());
}

Steadiness PadSensor::after(const Steadiness& before) const {
  if (!touched_) return {};
  return {key_, before.pose == key_ ? std::min(before.steps + 1.0, kSteady) : 1.0};
}

// Solve one body's contact on cells, on a flat face or by its shape. False if its geometry does not face the pad.
bool PadSensor::solve(const Touch& touch, BodyPress& press, const std::shared_ptr<const Face>& face,
                             const Placement& placement) {
  press.keeps = face;
  press.flat = face != nullptr;
  const bool whole = touch.map == nullptr && touch.geometry != nullptr && !touch.geometry->shapes().empty();
  if (press.flat && press.face.solve(*face, placement, surface(sheet()), touch.wrench, press.workspace)) {
    // If the body tips over, or the face cannot carry all of the force, other parts of the body touch as well.
    const bool bears = borne_by(press.face.contact()) > kBears * pressing(touch);
    if (!whole || (bears && !press.face.tips_over())) return true;
  }
  press.flat = false;
  if (touch.map != nullptr) return press_map(touch, press);
  return whole && press_shapes(touch, press);
}

// Solve the contact of a body's own shapes. False if none of them faces the pad.
bool PadSensor::press_shapes(const Touch& touch, BodyPress& press) {
  const auto bears = [&](double force) { return force > kBears * pressing(touch); };
  const double whole = press_above(touch, press, -pad_->depth());
  const double turned = press.patch.tilt();
  const double sunk = std::min(kDeeper * touch.sunk + kDeeperBy, pad_->depth());
  const bool deeper = press.patch.least() < -sunk && sunk < pad_->depth();
  if (!deeper || (bears(whole) && turned < kTurned)) return whole > 0.0;
  // Parts deeper in the pad than MuJoCo's contacts may be beside it. The body then tilts less without them.
  std::swap(press.patch, press.other_patch);
  std::swap(press.gap, press.other_gap);
  const double above = press_above(touch, press, -sunk);
  if (bears(above) ? !bears(whole) || press.patch.tilt() < kTurnsLess * turned : above > whole) return true;
  std::swap(press.patch, press.other_patch);
  std::swap(press.gap, press.other_gap);
  const TangentPlane* plane = plane_of(press);
  if (whole > 0.0) {
    press.patch.place(surface(plane == nullptr ? sheet() : plane->whole().bounds, plane), press.workspace);
  }
  return whole > 0.0;
}

// Solve the contact of the parts of a body's shapes above a floor [m]. Returns the force that it carries [N], 0 if
// there is no contact.
double PadSensor::press_above(const Touch& touch, BodyPress& press, double floor) {
  const double reach = kReach * pad_->depth(), borne = press_within(touch, press, floor, reach);
  const bool beyond = borne > 0.0 && touches_beyond(reach, touch, press);
  return beyond ? press_within(touch, press, floor, pad_->depth()) : borne;
}

// Whether the contact is so deep, or tilts the body so far, that parts of its meshes out of reach touch. If the tilt is
// not settled, whether they may.
bool PadSensor::touches_beyond(double reach, const Touch& touch, BodyPress& press) const {
  const Rectangle over = press.gap.bounds();
  const Point at = centre_of_pressure(touch.wrench);
  const double farthest =
      std::hypot(std::max(at.x - over.west, over.east - at.x), std::max(at.y - over.south, over.north - at.y));
  const double lowered = press.patch.contact().indentation() + press.patch.tilt() * farthest;
  if (!(lowered > reach)) return false;
  InclinedPlane plane = {{0.0, 0.0}, kNowhere};
  if (press.patch.settled()) plane = press.patch.reached();
  if (curved()) plane.height += press.plane.whole().highest;
  return press.gap.left_out_below(plane);
}

// As press_above(), with meshes up to a height above their lowest point [m].
double PadSensor::press_within(const Touch& touch, BodyPress& press, double floor, double reach) {
  const TangentPlane* plane = plane_of(press);
  const Rectangle part = plane == nullptr ? sheet() : plane->whole().bounds;
  // Over a curved pad, the body may be anywhere between the surface's lowest and highest point.
  const double lowest = plane == nullptr ? 0.0 : plane->whole().lowest;
  const double highest = plane == nullptr ? 0.0 : plane->whole().highest;
  const HeightRange range = {lowest + floor, highest + pad_->depth(), highest, reach};
  // If none of the shapes is there, the map is empty and no contact is found.
  press.gap.place(touch.geometry->shapes(), touch.pose, part, range);
  const HeightMap* map = &press.gap;
  if (plane != nullptr) {
    press.over.place(press.gap, *plane, floor, pad_->depth());
    map = &press.over;
  }
  if (!press.patch.solve(*map, surface(part, plane), touch.wrench, press.workspace)) return 0.0;
  return borne_by(press.patch.contact());
}

// Press with MuJoCo's contact points, each with its own force, if the geometry does not face the pad.
bool PadSensor::press_points(const Touch& seen, const BodyPress& press, std::size_t place) {
  const TangentPlane* plane = plane_of(press);
  const Touch& touch = curved() ? press.here : seen;
  const Rectangle over = plane == nullptr ? sheet() : plane->whole().bounds;
  if (!points_.lay(touch.points, {kLeastSpot * facing_gap_, options_.strength, over})) return false;
  double carried[6];
  if (plane == nullptr) {
    points_.nodal_forces(pad_->surface(), carried, forces_.data());
  } else {
    std::copy(seen.wrench, seen.wrench + 6, carried);
    points_.nodal_forces(pad_->surface(), *plane, carried, forces_.data());
  }
  // The squares' area is not that of the body. So strains are judged over squares as wide as the largest small
  // indentation.
  const double wide = pad_->range().indentation;
  pressed_.area += points_.area();
  note_range(touch, carried, std::max(points_.area(), static_cast<double>(points_.face().cells()) * wide * wide), 0.0);
  pressed_.peak = std::max(pressed_.peak, points_.peak());
  note_carried(seen, carried);
  const auto here = [plane](const double* at) { return plane == nullptr ? Point{at[0], at[1]} : plane->on_pad(at); };
  for (const CellEdge& edge : points_.face().edges) {
    if (keeps_forces_) rims_[place].push_back({here(edge.start), here(edge.end)});
  }
  add_forces();
  return true;
}

// Solve the contact of a body that is given by its heights over the pad.
bool PadSensor::press_map(const Touch& touch, BodyPress& press) {
  const TangentPlane* plane = plane_of(press);
  if (plane == nullptr) {
    return press.patch.solve(*touch.map, surface(sheet()), touch.wrench, press.workspace);
  }
  press.turned.place(*touch.map, *plane);
  press.over.place(press.turned, *plane, -kNowhere, kNowhere);
  return press.patch.solve(press.over, surface(plane->whole().bounds, plane), touch.wrench, press.workspace);
}

// Transform a touch into the frame of the tangent plane at the body's centre of pressure on a curved pad.
const Touch& PadSensor::turned(const Touch& touch, BodyPress& press) const {
  Point foot = {0.0, 0.0};
  if (!centre_of_pressure(pad_->outer(), touch.wrench, foot)) {
    double all = 0.0;
    for (const ContactPoint& point : touch.points) {
      all += point.force;
      foot.x += point.force * point.x, foot.y += point.force * point.y;
    }
    if (all > 0.0) foot.x /= all, foot.y /= all;
  }
  press.plane.touch(pad_->outer(), foot);
  press.here = touch;
  press.here.pose = press.plane.into(touch.pose);
  press.plane.wrench_into(touch.wrench, press.here.wrench);
  for (ContactPoint& point : press.here.points) {
    const double on_pad[3] = {point.x, point.y, pad_->outer().at(point.x, point.y).z};
    double seen[3];
    press.plane.into(on_pad, seen);
    point.x = seen[0], point.y = seen[1];
    double wrench[6];
    press.plane.wrench_into(point.wrench, wrench);
    std::copy(wrench, wrench + 6, point.wrench);
  }
  return press.here;
}

// Solve each body in turn on the surface as deformed by the others, until no force changes (Gauss-Seidel).
void PadSensor::couple(const Touch* touches, std::size_t count) {
  for (int round = 0; round < kRounds; ++round) {
    double change = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!solved_[i]) continue;
      BodyPress& own = *presses_[i];
      const std::size_t cells = own.cells().cells();
      own.sunk.assign(cells, 0.0);
      for (std::size_t j = 0; j < count; ++j) {
        if (j == i || !solved_[j]) continue;
        sink(*presses_[j], own);
      }
      const Touch& touch = curved() ? own.here : touches[i];
      own.forces.assign(own.contact().normal().begin(), own.contact().normal().end());
      if (own.flat) {
        own.face.press_again(surface(sheet()), touch.wrench, own.sunk, own.workspace);
      } else {
        own.patch.press_again(surface(sheet()), touch.wrench, own.sunk, own.workspace);
      }
      for (std::size_t k = 0; k < cells; ++k) {
        change = std::max(change, std::abs(own.contact().normal()[k] - own.forces[k]) / pressing(touch));
      }
    }
    if (change <= kSettled) return;
  }
}

// Add to press.sunk how far another body lowers the surface under this body's cells [m].
void PadSensor::sink(const BodyPress& other, BodyPress& press) {
  const auto on_surface = [this](const BodyPress& one, const Bend& bend) {
    const double* points = curved() ? one.laid().on_pad().data() : one.workspace.placed.data();
    return SurfaceCells{one.cells().cells(), points, 1, one.cells().areas.data(), nullptr, curved() ? &bend : nullptr};
  };
  const Bend bent = curved() ? press.laid().bend() : Bend{}, pressed = curved() ? other.laid().bend() : Bend{};
  pad_->compliance().add_sinking(on_surface(press, bent), on_surface(other, pressed), other.contact().normal().data(),
                                 others_, press.sunk.data());
}

void PadSensor::finish(const Touch& touch, BodyPress& press) {
  const CellContact& contact = press.contact();
  const Face& cells = press.cells();
  press.forces.resize(3 * cells.cells());
  press.leans.clear();
  if (curved()) {
    put_on_curved_nodes(press);
  } else {
    if (!shear(touch, press)) contact.forces(cells, touch.wrench, press.forces.data());
    bound_stress(cells, options_.strength, press.forces.data());
    CellContact::sum(press.workspace, cells.cells(), press.forces.data(), press.carried);
    balance_leans(press);
    contact.nodal_forces(cells, pad_->surface(), press.on_cells(), press.workspace, forces_.data());
  }
  if (!contact.exact()) note(Event::approximated, touch, 0.0, 0.0);
  double borne[3] = {};
  for (std::size_t i = 0; i < 3 * cells.cells(); ++i) borne[i % 3] += press.forces[i];
  note_contact(touch, borne, contact.pressed_area(), contact.indentation());
  for (std::size_t i = 0; i < cells.cells(); ++i) {
    pressed_.peak = std::max(pressed_.peak, contact.normal()[i] / cells.areas[i]);
  }
  note_carried(touch, press.carried);
  add_forces();
}

// Compute the nodal forces of a contact on a curved pad. Cells press along their own normals, which have components
// along the tangent plane. These carry a part of the tangential force, and shear carries the rest.
void PadSensor::put_on_curved_nodes(BodyPress& press) {
  const CellContact& contact = press.contact();
  const Face& cells = press.cells();
  double along[3], carried[6];
  press.laid().along_plane(contact.normal().data(), along);
  double* wrench = press.here.wrench;
  wrench[0] -= along[0], wrench[1] -= along[1], wrench[5] -= along[2];
  if (!shear(press.here, press)) contact.forces(cells, wrench, press.forces.data());
  bound_stress(cells, options_.strength, press.forces.data());
  CellContact::sum(press.workspace, cells.cells(), press.forces.data(), carried);
  carried[0] += along[0], carried[1] += along[1], carried[5] += along[2];
  press.plane.wrench_out_of(carried, press.carried);
  balance_leans(press);
  press.laid().nodal_forces(cells, pad_->surface(), press.on_cells(), press.carried, press.bent, forces_.data());
}

// Gradients of the body's height above cells that lean; null if none leans. All cells of a flat face lean alike. A law
// without shapes does not follow the body's.
const std::vector<Point>* PadSensor::gradients(const BodyPress& press) const {
  const bool leans = !press.flat && options_.law->shapes() && options_.tangential->leans();
  return leans ? &press.patch.gradients() : nullptr;
}

// Compute the leans of a contact's cells under the forces on them.
void PadSensor::balance_leans(BodyPress& press) {
  const std::vector<Point>* gradients = this->gradients(press);
  if (gradients == nullptr) return;
  press.pressing.resize(gradients->size());
  for (std::size_t i = 0; i < press.pressing.size(); ++i) press.pressing[i] = -press.forces[3 * i + 2];
  balance_lean(*gradients, press.cells().centroids.data(), press.pressing.data(), press.leans);
}

// Compute the forces on the cells if shear is bounded by friction or is not in proportion to the pressure. False if it
// is plainly in proportion, or if no solution was found.
bool PadSensor::shear(const Touch& touch, BodyPress& press) {
  const TangentialChoice& choice = *options_.tangential;
  const bool plain = !choice.couples() && options_.friction < 0.0 && !(any_torsion_ && touch.wrench[5] != 0.0);
  if (plain || !press.contact().exact()) return false;
  const Face& cells = press.cells();
  const BentCells* bent = curved() ? &press.laid() : nullptr;
  const Bend bend = curved() ? bent->bend() : Bend{};
  if (choice.couples()) {
    const bool whole = press.flat && &cells == press.keeps.get();
    if (!whole || press.sheared != press.keeps) {
      if (press.flat) {
        press.face.integrate_shear(press.integrals);
      } else {
        press.patch.integrate_shear(press.integrals);
      }
    }
    press.sheared = whole ? press.keeps : nullptr;
    const Matrix* normal = options_.law->couples() ? &press.workspace.matrix : nullptr;
    press.full.begin(pad_->compliance(),
                     {CellContact::on_surface(cells, press.workspace, bent, bend), &press.integrals, press.placement()},
                     normal, press.workspace.compliance);
  }
  PressedCells pressed = press.contact().pressed_cells(cells, press.heights(), press.workspace);
  pressed.gradients = gradients(press);
  const double friction = options_.friction < 0.0 && choice.slips() ? touch.friction : options_.friction;
  const ShearProblem problem = {pressed, choice.couples() ? &press.full : nullptr, touch.wrench, friction};
  const ShearOutcome outcome = shear_.solve(choice, problem, press.forces.data());
  if (outcome.simplified) note(Event::approximated, touch, 0.0, 0.0);
  return !outcome.refused;
}

// Solve law "uniform" on a flat face exactly, without cells.
bool PadSensor::press_linear(const Touch& touch, const Face& face, const Placement& placement, std::size_t place) {
  if (!uniform_.solve(face, placement, pad_->surface(), touch.wrench, options_.friction, forces_.data())) return false;
  const double area = uniform_.traction().integrals().area;
  if (options_.strength > 0.0 && pressing(touch) > options_.strength / 2 * area) return false;
  note_contact(touch, uniform_.carried(), area, 0.0);
  pressed_.peak = std::max(pressed_.peak, uniform_.peak());
  note_carried(touch, uniform_.carried());
  if (keeps_forces_) rims_[place] = uniform_.traction().edges();
  add_forces();
  return true;
}

bool PadSensor::press_steady(const Touch& touch, const std::shared_ptr<const Face>& face) {
  if (options_.tangential->couples() || options_.friction >= 0.0 || power_ != 0) return false;
  const BasisKey key = {pad_.get(), face.get(), rounded(touch.pose, tolerance_), options_};
  std::shared_ptr<const Basis> basis = BasisCache::shared().find(key, touch.wrench, weights_, workspace_);
  if (basis == nullptr) basis = make_basis(key, face, touch.wrench);
  if (basis == nullptr) return false;
  double carried[6];
  basis->contact.carried(*face, touch.wrench, carried);
  note_contact(touch, carried, basis->contact.pressed_area(),
               basis->contact.indentation() * pressing(touch) / basis->contact.pressed_with());
  note_carried(touch, carried);
  std::visit([&](auto& own) { combine(basis, own); }, response_);
  return true;
}

// A basis of a face at a pose, for loads like this one, and the weights of its parts; null if it has none.
std::shared_ptr<const Basis> PadSensor::make_basis(const BasisKey& key, const std::shared_ptr<const Face>& face,
                                                   const double* wrench) {
  Placement placement = kUnmoved;
  if (!face->cut && !place(*face, at(key.pose, tolerance_), placement)) return nullptr;
  CellContact contact;
  contact.place(*face, placement, surface(sheet()), workspace_);
  contact.press(*face, surface(sheet()), {wrench}, workspace_);
  std::vector<std::uint8_t> at_end;
  // Another load would need other cells.
  if (!contact.linear() || ends_coarsely(*face, contact, at_end)) return nullptr;
  if (!contact.make_parts(*face, *options_.law, workspace_)) return nullptr;
  if (!contact.weights(*face, options_, wrench, weights_, workspace_)) return nullptr;
  auto responses = std::visit([&](auto& own) -> decltype(Basis::responses) {
    return responses_to_parts(contact, *face, own);
  }, response_);
  auto basis = std::make_shared<const Basis>(Basis{face, pad_, std::move(contact), std::move(responses)});
  BasisCache::shared().keep(key, basis);
  return basis;
}

template <typename Value>
Columns<Value> PadSensor::responses_to_parts(const CellContact& contact, const Face& face, Response<Value>& own) {
  const StressMap<Value>& map = own.maps->deviatoric;
  // A column has one scale for all layers, so bytes would leave the deep layers too few digits.
  const Precision stored = pad_->precision() == Precision::byte ? Precision::half : pad_->precision();
  Columns<Value> responses(contact.parts(), map.response_size, stored);
  std::vector<Value> response(map.response_size);
  std::vector<double> unit(contact.parts()), twofold(map.response_size);
  part_forces_.resize(3 * face.cells());
  for (std::size_t p = 0; p < contact.parts(); ++p) {
    std::fill(unit.begin(), unit.end(), 0.0);
    unit[p] = 1.0;
    contact.part_forces(face, unit, part_forces_.data());
    contact.nodal_forces(face, pad_->surface(), {part_forces_.data()}, workspace_, forces_.data());
    std::fill(response.begin(), response.end(), Value(0));
    map.add_response(forces_.data(), own.workspace, response.data());
    std::copy(response.begin(), response.end(), twofold.begin());
    responses.set(p, twofold.data());
  }
  return responses;
}

// Set the response to that of weights_ of the parts of a basis, unless it is that already.
template <typename Value>
void PadSensor::combine(const std::shared_ptr<const Basis>& basis, Response<Value>& own) {
  std::vector<Value>& next = own.next;
  next.assign(weights_.begin(), weights_.end());
  // Equal bits, because -0 and 0 are equal and give other bits.
  begun_ = kept_.basis.lock() == basis && own.weights.size() == next.size() &&
           std::memcmp(own.weights.data(), next.data(), sizeof(Value) * next.size()) == 0;
  if (begun_) return;
  set_response(0.0);
  for (std::size_t i = every_.size(); i < next.size(); ++i) every_.push_back(static_cast<std::uint32_t>(i));
  std::get<Columns<Value>>(basis->responses).add(every_.data(), next.data(), next.size(), own.deviatoric.data());
  kept_.basis = basis;
  own.weights.swap(next);
  kept_.readings.clear();
}

void PadSensor::note(Event event, const Touch& touch, double pressure, double indentation) {
  pressed_.notes.push_back({event, touch.body, pressure, indentation});
}

void PadSensor::note_contact(const Touch& touch, const double* force, double area, double indentation) {
  pressed_.area += area;
  pressed_.indentation = std::max(pressed_.indentation, indentation);
  note_range(touch, force, area, indentation);
}

// Note whether strains are small under a force [N] on an area [m^2].
void PadSensor::note_range(const Touch& touch, const double* force, double area, double indentation) {
  // Shear counts as in the von Mises stress.
  const double pressure = std::sqrt(force[2] * force[2] + 3.0 * (force[0] * force[0] + force[1] * force[1])) / area;
  const double share = std::max(pressure / pad_->range().pressure, indentation / pad_->range().indentation);
  pressed_.range = std::max(pressed_.range, share);
  if (share > 1.0) note(Event::beyond_range, touch, pressure, indentation);
}

// Add the carried part of a wrench, and note the residual if it is more than rounding.
void PadSensor::note_carried(const Touch& touch, const double* carried) {
  const double length = std::sqrt(sheet().area());
  double left = 0.0, whole = 0.0;
  for (std::size_t k = 0; k < 6; ++k) {
    pressed_.carried[k] += carried[k];
    const double unit = k < 3 ? 1.0 : 1.0 / length;
    left += std::abs(touch.wrench[k] - carried[k]) * unit;
    whole += std::abs(touch.wrench[k]) * unit;
  }
  if (left > kLeftOver * whole) note(Event::not_carried, touch, 0.0, 0.0);
}

void PadSensor::add_forces() {
  if (keeps_forces_) {
    for (std::size_t i = 0; i < total_.size(); ++i) total_[i] += forces_[i];
  }
  if (only_forces_) return;
  if (!begun_) set_response(0.0);
  if (power_ != 0) {
    for (double& force : forces_) force = std::ldexp(force, -power_);
  }
  std::visit([&](auto& own) {
    own.maps->deviatoric.add_response(forces_.data(), own.workspace, own.deviatoric.data());
    if (pad_->has_mean()) own.maps->mean.add_response(forces_.data(), own.workspace, own.mean.data());
  }, response_);
}

void PadSensor::readings(double* readings) {
  if (!touched_) {
    std::fill(readings, readings + pad_->taxels(), 0.0);
    return;
  }
  const bool keeps = !kept_.basis.expired();
  if (!keeps || kept_.readings.empty()) {
    make_readings(readings);
    if (keeps) kept_.readings.assign(readings, readings + pad_->taxels());
  } else {
    std::copy(kept_.readings.begin(), kept_.readings.end(), readings);
  }
}

void PadSensor::make_readings(double* readings) {
  std::visit([&](auto& own) { own.maps->deviatoric.readings(own.deviatoric.data(), own.workspace, readings); },
             response_);
  for (std::size_t i = 0; power_ != 0 && i < pad_->taxels(); ++i) readings[i] = std::ldexp(readings[i], power_);
  if (!(options_.strength > 0.0)) return;
  // Cells are bounded per body. Several bodies at one place and corners of the sheet can exceed that, so taxels
  // saturate.
  const std::size_t each = pad_->taxels() / pad_->layers();
  for (const double most : pad_->saturation()) {
    for (std::size_t i = 0; i < each; ++i, ++readings) *readings = *readings > most ? most : *readings;
  }
}

void PadSensor::stress(double* stress) {
  const std::size_t taxels = pad_->taxels();
  if (!touched_) {
    std::fill(stress, stress + kTensor * taxels, 0.0);
    return;
  }
  means_.resize((kDeviatoric + 1) * taxels);
  double* mean = means_.data() + kDeviatoric * taxels;
  std::visit([&](auto& own) {
    own.maps->deviatoric.means(own.deviatoric.data(), kOdd, means_.data());
    own.maps->mean.means(own.mean.data(), kEven, mean);
  }, response_);
  for (double& one : means_) one = std::ldexp(one, power_);
  const double third = std::sqrt(3.0);
  for (std::size_t t = 0; t < taxels; ++t) {
    // The coordinates are 1.5 s_zz, sqrt(3)/2 (s_xx - s_yy), sqrt(3) s_xy, sqrt(3) s_yz, sqrt(3) s_zx.
    const double zz = means_[t] / 1.5, half = means_[taxels + t] / third;
    stress[t] = half - zz / 2 + mean[t];
    stress[taxels + t] = -half - zz / 2 + mean[t];
    stress[2 * taxels + t] = zz + mean[t];
    for (std::size_t k = 2; k < kDeviatoric; ++k) stress[(k + 1) * taxels + t] = means_[k * taxels + t] / third;
  }
}

SolvedCells PadSensor::solved_cells(std::size_t touch) const {
  if (touch >= solved_.size() || !solved_[touch]) return {};
  const BodyPress& press = *presses_[touch];
  const bool whole = press.flat && &press.cells() == press.keeps.get();
  const bool coupled = std::count(solved_.begin(), solved_.end(), 1) > 1 && options_.law->couples();
  const bool sheared = options_.tangential->couples() && press.contact().exact();
  SolvedCells solved;
  solved.contact = &press.contact();
  solved.face = &press.cells();
  solved.placement = press.placement();
  if (curved()) solved.bent = &press.laid();
  solved.carried = press.carried;
  if (!whole) solved.view = press.flat ? &press.face.view() : &press.patch.view();
  solved.heights = press.heights();
  if (whole && coupled) solved.sunk = press.sunk.data();
  solved.forces = press.on_cells();
  if (sheared) solved.full = &press.full;
  solved.workspace = &press.workspace;
  return solved;
}

// The flat face with which a body faces the pad, cut at the sheet's edge, and its placement. Null if there is none.
std::shared_ptr<const Face> PadSensor::face_towards(const Touch& touch, Placement& placement) {
  if (touch.face != nullptr) placement = touch.placement;
  if (touch.face != nullptr || touch.geometry == nullptr) return touch.face;
  BodyGeometry& body = *touch.geometry;
  const double* up = touch.pose.rotation + 6;
  // A pressing face is near the surface where the force passes. A face far below it is beside or under the pad.
  const double near = kNear * pad_->depth();
  const Point at = centre_of_pressure(touch.wrench);
  for (std::size_t i = 0; i < body.sides(); ++i) {
    const FlatSide& seen = body.outlined(i);
    if (dot(up, seen.up()) < kFacing) continue;
    Face plane;
    std::copy(seen.rotation, seen.rotation + 9, plane.rotation);
    plane.height = seen.height;
    plane.most_slope = 1.0;
    if (!place(plane, touch.pose, placement) || std::abs(plane_height(plane, touch.pose, at.x, at.y)) > near ||
        !may_cover(seen, placement)) {
      continue;
    }
    const FlatSide* side = body.side(i);
    if (side == nullptr) continue;
    plane.most_slope = side->most_slope;
    if (!place(plane, touch.pose, placement)) continue;
    // Another part of the body may press as well, unless it is beside the sheet or deeper than the pad.
    if (std::any_of(side->others.begin(), side->others.end(), [&](std::size_t k) {
          return may_reach(body.shapes()[k], touch.pose, sheet(), -pad_->depth());
        })) {
      continue;
    }
    if (side->whole != nullptr && over_sheet(*side->whole, placement)) return side->whole;
    const std::shared_ptr<const Face> cut = cut_face(touch, i, placement);
    placement = kUnmoved;
    return cut;
  }
  return nullptr;
}

// Whether the bounding box of a side's outline is over some of the sheet.
bool PadSensor::may_cover(const FlatSide& side, const Placement& placement) const {
  if (side.endless) return true;
  const auto& [west, south, east, north] = side.bounds;
  Rectangle placed = kNoRectangle;
  for (const Point& corner : {Point{west, south}, {east, south}, {east, north}, {west, north}}) {
    placed = around(placed, placement(corner));
  }
  return placed.meets(sheet());
}

std::shared_ptr<const Face> PadSensor::cut_face(const Touch& touch, std::size_t side,
                                                       const Placement& placement) {
  const FlatSide& whole = *touch.geometry->side(side);
  std::array<std::int64_t, 3> place = {std::llround(placement.shift[0] / kCutStep),
                                       std::llround(placement.shift[1] / kCutStep),
                                       std::llround(placement.angle() / kCutTurn)};
  if (whole.endless) place = {};
  for (auto known = cut_faces_.begin(); known != cut_faces_.end(); ++known) {
    if (known->body == touch.body && known->side == side && known->place == place &&
        known->geometry.lock() == touch.geometry) {
      cut_faces_.splice(cut_faces_.begin(), cut_faces_, known);
      return known->face;
    }
  }
  const Rectangle over = sheet();
  Outline cut;
  bool any = true;
  double angle = 0.0;
  if (whole.endless) {
    cut.rings.push_back(
        {{over.west, over.south}, {over.east, over.south}, {over.east, over.north}, {over.west, over.north}});
  } else {
    angle = static_cast<double>(place[2]) * kCutTurn;
    const Placement there = {std::cos(angle), std::sin(angle),
                             {static_cast<double>(place[0]) * kCutStep, static_cast<double>(place[1]) * kCutStep}};
    any = clip_outline(whole.outline, there, over, cut);
    // By whole right angles, so that cells turn with a scene that is turned by them.
    if (share_on_rim(cut, over) > kMostlyRim) angle = kRightAngle * std::floor(angle / kRightAngle + 0.5);
  }
  std::shared_ptr<Face> face;
  if (any) {
    face = std::make_shared<Face>();
    // The squares lie along the side's own axes, or along the sheet's if most of the outline is the sheet's rim.
    if (cutter_.make(cut, options_.cells, *face, angle)) {
      std::copy(whole.rotation, whole.rotation + 9, face->rotation);
      face->height = whole.height;
      face->most_slope = whole.most_slope;
      face->tips_at = whole.tips_at;
      face->cut = true;
    } else {
      face = nullptr;
    }
  }
  cut_faces_.push_front({touch.body, side, place, touch.geometry, face});
  if (cut_faces_.size() > kMostCutFaces) cut_faces_.pop_back();
  return face;
}

bool PadSensor::over_sheet(const Face& face, const Placement& placement) const {
  const Rectangle over = sheet();
  return std::all_of(face.corners.begin(), face.corners.end(), [&](const Point& corner) {
    const Point there = placement(corner);
    return over.holds(there.x, there.y);
  });
}

}  // namespace mjtactile
