#include "contact/pad_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace mjtactile {
namespace {

// Steps at one pose after which a basis is worth its making.
constexpr double kSteady = 8.0;
// A face that overhangs the sheet is cut at its edge for places rounded to this [m, rad]: what the edge is off by is a
// hundredth of the depth of the first taxels. Steps of angle go into a right angle: turned scenes are cut alike.
constexpr double kCutStep = 5e-6, kCutTurn = 1.57079632679489661923 / 3142;
constexpr std::size_t kMostCutFaces = 64;
// Faces that lean more than this never face the pad alone (their cosine).
constexpr double kFacing = 0.9;
// Height of what presses over the surface or, where contacts are soft, below it, over the pad's depth.
constexpr double kNear = 0.8;
// What of a body is deeper in the pad than where MuJoCo's contacts press, by this factor and length [m], may stand
// beside the pad: it does where the body turns by more than this slope to rest on it, and by less than this share
// without it.
constexpr double kDeeper = 1.5, kDeeperBy = 1e-4;
constexpr double kTurned = 0.05, kTurnsLess = 0.5;
// Share of the force that a contact bears at least where it bears all of it.
constexpr double kBears = 0.99;
// Where nothing of a body's geometry faces the pad, squares about its contact points bear it: their least side over the
// facing gap.
constexpr double kLeastSpot = 4.0;
// Rounds in which bodies on one pad settle beside each other, and the change of forces that ends them, over the force.
constexpr int kRounds = 12;
constexpr double kSettled = 1e-8;
// What is not carried, over the wrench, that is more than rounding and the margin at a face's rim.
constexpr double kLeftOver = 5e-3;
// Forces within two to this power, up or down, of 1 N are read as they are: single precision squares stresses.
constexpr int kCommonPowers = 20;
// Width of the narrowest cells over the pad's depth.
constexpr double kNarrowest = 0.01;
// Contact cells up to which shear is solved for in the time of a step. Who asks for more waits for them: the time grows
// with their cube.
constexpr double kQuick = 100.0;
// A hash kept as a double must be a whole number that a double holds.
constexpr std::uint64_t kHashMask = (std::uint64_t{1} << 52) - 1;
// Deviatoric coordinates and the mean stress under x -> -x and y -> -y (mjtactile/influence/matrices.py).
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

// The largest number in the wrenches; not finite where one of them is not.
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

template <typename Value>
PadSensor<Value>::PadSensor(std::shared_ptr<const Pad> pad, LawOptions options, double facing_gap, double tolerance)
    : pad_(std::move(pad)), options_(options), facing_gap_(facing_gap), tolerance_(tolerance) {
  if (!(options_.narrowest > 0.0)) options_.narrowest = kNarrowest * pad_->depth();
  options_.facing_gap = facing_gap_;
  shear_.set_patience(std::max(std::pow(static_cast<double>(options_.cells) / kQuick, 3.0), 1.0));
  response_.resize(pad_->template deviatoric<Value>().response_size);
  if (pad_->has_mean()) mean_response_.resize(pad_->template mean<Value>().response_size);
  forces_.resize(3 * pad_->surface().nodes_x() * pad_->surface().nodes_y());
}

template <typename Value>
void PadSensor<Value>::press(const Touch* touches, std::size_t count, const Steadiness& before) {
  begin(count);
  if (!touched_) return;
  key_ = key_of(touches, count);
  const double largest = largest_of(touches, count);
  if (!std::isfinite(largest)) {
    // The simulation has come apart: no number would be right.
    std::fill(response_.begin(), response_.end(), std::numeric_limits<Value>::quiet_NaN());
    std::fill(mean_response_.begin(), mean_response_.end(), std::numeric_limits<Value>::quiet_NaN());
    note(Event::refused, touches[0], largest, largest);
    return;
  }
  const int power = std::ilogb(std::max(largest, std::numeric_limits<double>::min()));
  if (std::abs(power) > kCommonPowers) power_ = power;
  const bool steady = count == 1 && before.pose == key_ && before.steps >= kSteady && !pad_->has_mean() &&
                      !keeps_forces_ && options_.law->couples();
  for (std::size_t i = 0; i < count; ++i) press_alone(touches[i], i, steady);
  const auto solved = std::count(solved_.begin(), solved_.end(), 1);
  if (solved > 1 && options_.law->couples()) couple(touches, count);
  for (std::size_t i = 0; i < count; ++i) {
    if (solved_[i]) finish(touches[i], *presses_[i]);
  }
}

// As if nothing touched.
template <typename Value>
void PadSensor<Value>::begin(std::size_t count) {
  touched_ = count > 0;
  key_ = 0.0;
  power_ = 0;
  std::fill(pressed_.carried, pressed_.carried + 6, 0.0);
  pressed_.range = pressed_.indentation = pressed_.area = pressed_.peak = 0.0;
  pressed_.notes.clear();
  if (keeps_forces_) total_.assign(forces_.size(), 0.0);
  if (!touched_) return;
  std::fill(response_.begin(), response_.end(), Value(0));
  std::fill(mean_response_.begin(), mean_response_.end(), Value(0));
  while (presses_.size() < count) presses_.push_back(std::make_unique<BodyPress>());
  solved_.assign(count, 0);
}

// A hash of which bodies touch, and of their rounded poses.
template <typename Value>
double PadSensor<Value>::key_of(const Touch* touches, std::size_t count) const {
  std::uint64_t hash = count;
  for (std::size_t i = 0; i < count; ++i) {
    hash = mixed(hash, static_cast<std::uint64_t>(touches[i].body));
    for (const std::int64_t one : rounded(touches[i].pose, tolerance_)) {
      hash = mixed(hash, static_cast<std::uint64_t>(one));
    }
  }
  return static_cast<double>(hash & kHashMask);
}

// One body as if it were alone; `place`: of its press.
template <typename Value>
void PadSensor<Value>::press_alone(const Touch& seen, std::size_t place, bool steady) {
  BodyPress& press = *presses_[place];
  const Touch& touch = curved() ? turned(seen, press) : seen;
  if (!(pressing(touch) > 0.0)) {
    note_carried(seen, std::array<double, 6>{}.data());
    return;
  }
  Placement placement = kUnmoved;
  // On a curved pad no flat side lies whole.
  const std::shared_ptr<const Face> face = curved() ? nullptr : face_towards(touch, placement);
  if (face != nullptr && steady && press_steady(touch, face)) return;
  if (face != nullptr && options_.law->presses_faces() && press_linear(touch, *face, placement)) return;
  solved_[place] = solve(touch, press, face, placement) ? 1 : 0;
  if (solved_[place] || press_points(seen, press)) return;
  note(Event::refused, touch, 0.0, 0.0);
  note_carried(seen, std::array<double, 6>{}.data());
}

template <typename Value>
Steadiness PadSensor<Value>::after(const Steadiness& before) const {
  if (!touched_) return {};
  return {key_, before.pose == key_ ? std::min(before.steps + 1.0, kSteady) : 1.0};
}

// The contact of one body as if it were alone, on a flat face or by its shape; false where its geometry says nothing.
template <typename Value>
bool PadSensor<Value>::solve(const Touch& touch, BodyPress& press, const std::shared_ptr<const Face>& face,
                             const Placement& placement) {
  press.keeps = face;
  press.flat = face != nullptr;
  const bool whole = touch.map == nullptr && touch.geometry != nullptr && !touch.geometry->shapes().empty();
  if (press.flat && press.face.solve(*face, placement, surface(sheet()), touch.wrench, press.workspace)) {
    // Where it tips over, or sinks in so far that its face bears no more, other parts of the body touch as well.
    const bool bears = borne_by(press.face.contact()) > kBears * pressing(touch);
    if (!whole || (bears && !press.face.tips_over())) return true;
  }
  press.flat = false;
  if (touch.map != nullptr) return press_map(touch, press);
  return whole && press_shapes(touch, press);
}

// The contact of a body's own shapes; false where none of them faces the pad.
template <typename Value>
bool PadSensor<Value>::press_shapes(const Touch& touch, BodyPress& press) {
  const auto bears = [&](double force) { return force > kBears * pressing(touch); };
  const double whole = press_above(touch, press, -pad_->depth());
  const double turned = press.patch.tilt();
  const double sunk = std::min(kDeeper * touch.sunk + kDeeperBy, pad_->depth());
  const bool deeper = (curved() || press.gap.bottom() < -sunk) && sunk < pad_->depth();
  if (!deeper || (bears(whole) && turned < kTurned)) return whole > 0.0;
  // What is deeper in the pad than MuJoCo's contacts say may be beside it. Then the body turns less without that.
  std::swap(press.patch, press.other_patch);
  std::swap(press.gap, press.other_gap);
  const double above = press_above(touch, press, -sunk);
  if (bears(above) ? !bears(whole) || press.patch.tilt() < kTurnsLess * turned : above > whole) return true;
  std::swap(press.patch, press.other_patch);
  std::swap(press.gap, press.other_gap);
  const TangentPlane* plane = plane_of(press);
  if (whole > 0.0) press.patch.place(surface(plane == nullptr ? sheet() : plane->whole().bounds, plane), press.workspace);
  return whole > 0.0;
}

// The contact of a body's own shapes as far as they stand above a floor; the force it bears, 0 where there is none.
template <typename Value>
double PadSensor<Value>::press_above(const Touch& touch, BodyPress& press, double floor) {
  const TangentPlane* plane = plane_of(press);
  const Rectangle part = plane == nullptr ? sheet() : plane->whole().bounds;
  // Over a curved pad the body may stand between its highest and its lowest point.
  const double lowest = plane == nullptr ? 0.0 : plane->whole().lowest;
  const double highest = plane == nullptr ? 0.0 : plane->whole().highest;
  const HeightRange range = {lowest + floor, highest + pad_->depth(), highest};
  if (!press.gap.place(touch.geometry->shapes(), touch.pose, part, range)) return 0.0;
  const HeightMap* map = &press.gap;
  if (plane != nullptr) {
    press.over.place(press.gap, *plane, floor, pad_->depth());
    map = &press.over;
  }
  if (!press.patch.solve(*map, surface(part, plane), touch.wrench, press.workspace)) return 0.0;
  return borne_by(press.patch.contact());
}

// Where geometry says nothing, each of MuJoCo's contact points bears its own force.
template <typename Value>
bool PadSensor<Value>::press_points(const Touch& seen, const BodyPress& press) {
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
  note_range(touch, carried, points_.area(), 0.0);
  pressed_.peak = std::max(pressed_.peak, points_.peak());
  note_carried(seen, carried);
  add(forces_.data());
  return true;
}

// A body that is known by its heights over the pad.
template <typename Value>
bool PadSensor<Value>::press_map(const Touch& touch, BodyPress& press) {
  const TangentPlane* plane = plane_of(press);
  if (plane == nullptr) {
    return press.patch.solve(*touch.map, surface(sheet()), touch.wrench, press.workspace);
  }
  press.turned.place(*touch.map, *plane);
  press.over.place(press.turned, *plane, -kNowhere, kNowhere);
  return press.patch.solve(press.over, surface(plane->whole().bounds, plane), touch.wrench, press.workspace);
}

// What touches a curved pad, as it is seen from the tangent plane where its force goes in.
template <typename Value>
const Touch& PadSensor<Value>::turned(const Touch& touch, BodyPress& press) const {
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

// Each body in turn on the surface as the others leave it, until no force changes.
template <typename Value>
void PadSensor<Value>::couple(const Touch* touches, std::size_t count) {
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

// How far one body bends the surface under another's cells.
template <typename Value>
void PadSensor<Value>::sink(const BodyPress& other, BodyPress& press) {
  const auto on_surface = [this](const BodyPress& one, const Bend& bend) {
    const double* points = curved() ? one.laid().on_pad().data() : one.workspace.placed.data();
    return SurfaceCells{one.cells().cells(), points, 1, one.cells().areas.data(), nullptr, curved() ? &bend : nullptr};
  };
  const Bend bent = curved() ? press.laid().bend() : Bend{}, pressed = curved() ? other.laid().bend() : Bend{};
  pad_->compliance().add_sinking(on_surface(press, bent), on_surface(other, pressed), other.contact().normal().data(),
                                 others_, press.sunk.data());
}

template <typename Value>
void PadSensor<Value>::finish(const Touch& touch, BodyPress& press) {
  const CellContact& contact = press.contact();
  const Face& cells = press.cells();
  press.forces.resize(3 * cells.cells());
  if (curved()) {
    put_on_curved_nodes(press);
  } else {
    if (!shear(touch, press)) contact.forces(cells, touch.wrench, press.forces.data());
    bound_stress(cells, press.forces.data());
    CellContact::sum(press.workspace, cells.cells(), press.forces.data(), press.carried);
    contact.nodal_forces(cells, pad_->surface(), press.forces.data(), press.workspace, forces_.data());
  }
  if (!contact.exact()) note(Event::approximated, touch, 0.0, 0.0);
  double borne[3] = {};
  for (std::size_t i = 0; i < 3 * cells.cells(); ++i) borne[i % 3] += press.forces[i];
  note_range(touch, borne, contact.pressed_area(), contact.indentation());
  for (std::size_t i = 0; i < cells.cells(); ++i) {
    pressed_.peak = std::max(pressed_.peak, contact.normal()[i] / cells.areas[i]);
  }
  note_carried(touch, press.carried);
  add(forces_.data());
}

// Cells that press along their own normals carry forces along the tangent plane by that; shear carries the rest.
template <typename Value>
void PadSensor<Value>::put_on_curved_nodes(BodyPress& press) {
  const CellContact& contact = press.contact();
  const Face& cells = press.cells();
  double along[3], carried[6];
  press.laid().along_plane(contact.normal().data(), along);
  double* wrench = press.here.wrench;
  wrench[0] -= along[0], wrench[1] -= along[1], wrench[5] -= along[2];
  if (!shear(press.here, press)) contact.forces(cells, wrench, press.forces.data());
  bound_stress(cells, press.forces.data());
  CellContact::sum(press.workspace, cells.cells(), press.forces.data(), carried);
  carried[0] += along[0], carried[1] += along[1], carried[5] += along[2];
  press.plane.wrench_out_of(carried, press.carried);
  press.laid().nodal_forces(cells, pad_->surface(), press.forces.data(), press.carried, press.bent, forces_.data());
}

// Under the surface no cell brings about more von Mises stress than the strength: what shear is over that is left out.
template <typename Value>
void PadSensor<Value>::bound_stress(const Face& cells, double* forces) const {
  for (std::size_t i = 0; options_.strength > 0.0 && i < cells.cells(); ++i) {
    double* force = forces + 3 * i;
    const double most = options_.strength * cells.areas[i];
    const double shear = std::hypot(force[0], force[1]);
    force[2] = std::min(std::max(force[2], -most), most);
    const double bound = std::sqrt(std::max(most * most - force[2] * force[2], 0.0) / 3.0);
    if (shear > bound) force[0] *= bound / shear, force[1] *= bound / shear;
  }
}

// Forces on the cells where shear is bounded by friction or does not spread in proportion to the pressure; false where
// it does, or no better is known.
template <typename Value>
bool PadSensor<Value>::shear(const Touch& touch, BodyPress& press) {
  const TangentialChoice& choice = *options_.tangential;
  const bool plain = !choice.couples() && options_.friction < 0.0 && !(any_torsion_ && touch.wrench[5] != 0.0);
  if (plain || !press.contact().exact()) return false;
  const Face& cells = press.cells();
  const Placement placement = press.placement();
  const SurfaceCompliance& compliance = pad_->compliance();
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
    const Bend bend = curved() ? press.laid().bend() : Bend{};
    const double* places = curved() ? press.laid().on_pad().data() : press.workspace.placed.data();
    const SurfaceCells placed = {cells.cells(), places, 1, cells.areas.data(), cells.inverse_distance.data(),
                                 curved() ? &bend : nullptr};
    compliance.full(placed, press.integrals, placement, press.workspace.compliance, press.full);
  }
  const PressedCells pressed = press.contact().pressed_cells(cells, press.heights(), press.workspace);
  const double friction = options_.friction < 0.0 && choice.slips() ? touch.friction : options_.friction;
  const ShearProblem problem = {pressed, choice.couples() ? &press.full : nullptr, touch.wrench, friction};
  const ShearOutcome outcome = shear_.solve(choice, problem, press.forces.data());
  if (outcome.simplified) note(Event::approximated, touch, 0.0, 0.0);
  return !outcome.refused;
}

// Law "uniform" on a flat face: exact, without cells.
template <typename Value>
bool PadSensor<Value>::press_linear(const Touch& touch, const Face& face, const Placement& placement) {
  if (!uniform_.solve(face, placement, pad_->surface(), touch.wrench, options_.friction, forces_.data())) return false;
  const double area = uniform_.traction().integrals().area;
  if (options_.strength > 0.0 && pressing(touch) > options_.strength / 2 * area) return false;
  note_range(touch, uniform_.carried(), area, 0.0);
  pressed_.peak = std::max(pressed_.peak, uniform_.peak());
  note_carried(touch, uniform_.carried());
  add(forces_.data());
  return true;
}

template <typename Value>
bool PadSensor<Value>::press_steady(const Touch& touch, const std::shared_ptr<const Face>& face) {
  if (options_.tangential->couples() || options_.friction >= 0.0 || power_ != 0) return false;
  const BasisKey key = {pad_.get(), face.get(), rounded(touch.pose, tolerance_), options_};
  auto& cache = BasisCache<Value>::shared();
  std::shared_ptr<const Basis<Value>> basis = cache.find(key, *face, touch.wrench, weights_, workspace_);
  if (basis == nullptr) {
    Placement placement = kUnmoved;
    if (!face->cut && !place(*face, at(key.pose, tolerance_), placement)) return false;
    CellContact contact;
    contact.place(*face, placement, surface(sheet()), workspace_);
    contact.press(*face, surface(sheet()), {touch.wrench}, workspace_);
    if (!contact.linear() || is_small(contact)) return false;  // its cells belong to this very load
    if (!contact.make_parts(*face, *options_.law, workspace_)) return false;
    if (!contact.weights(*face, options_, touch.wrench, weights_, workspace_)) return false;
    const auto& map = pad_->template deviatoric<Value>();
    // One scale for all layers: bytes would leave the deep ones too few digits.
    const Precision stored = pad_->precision() == Precision::byte ? Precision::half : pad_->precision();
    Columns<Value> responses(contact.parts(), map.response_size, stored);
    std::vector<Value> response(map.response_size);
    std::vector<double> unit(contact.parts()), twofold(map.response_size);
    part_forces_.resize(3 * face->cells());
    for (std::size_t p = 0; p < contact.parts(); ++p) {
      std::fill(unit.begin(), unit.end(), 0.0);
      unit[p] = 1.0;
      contact.part_forces(*face, unit, part_forces_.data());
      contact.nodal_forces(*face, pad_->surface(), part_forces_.data(), workspace_, forces_.data());
      std::fill(response.begin(), response.end(), Value(0));
      map.add_response(forces_.data(), map_workspace_, response.data());
      std::copy(response.begin(), response.end(), twofold.begin());
      responses.set(p, twofold.data());
    }
    const std::size_t bytes = responses.bytes();
    basis = std::make_shared<const Basis<Value>>(Basis<Value>{face, pad_, std::move(contact), std::move(responses)});
    cache.keep(key, basis, bytes);
  }
  double carried[6];
  basis->contact.carried(*face, touch.wrench, carried);
  note_range(touch, carried, basis->contact.pressed_area(),
             basis->contact.indentation() * pressing(touch) / basis->contact.pressed_with());
  note_carried(touch, carried);
  part_weights_.assign(weights_.begin(), weights_.end());
  for (std::size_t i = every_.size(); i < part_weights_.size(); ++i) every_.push_back(static_cast<std::uint32_t>(i));
  basis->responses.add(every_.data(), part_weights_.data(), part_weights_.size(), response_.data());
  return true;
}

template <typename Value>
void PadSensor<Value>::note(Event event, const Touch& touch, double pressure, double indentation) {
  pressed_.notes.push_back({event, touch.body, pressure, indentation});
}

template <typename Value>
void PadSensor<Value>::note_range(const Touch& touch, const double* force, double area, double indentation) {
  // As von Mises's stress counts shear.
  const double pressure = std::sqrt(force[2] * force[2] + 3.0 * (force[0] * force[0] + force[1] * force[1])) / area;
  pressed_.area += area;
  pressed_.indentation = std::max(pressed_.indentation, indentation);
  const double share = std::max(pressure / pad_->range().pressure, indentation / pad_->range().indentation);
  pressed_.range = std::max(pressed_.range, share);
  if (share > 1.0) note(Event::beyond_range, touch, pressure, indentation);
}

// Add what is carried of a wrench; what is left over counts where it is more than rounding.
template <typename Value>
void PadSensor<Value>::note_carried(const Touch& touch, const double* carried) {
  const double length = std::sqrt((sheet().east - sheet().west) * (sheet().north - sheet().south));
  double left = 0.0, whole = 0.0;
  for (std::size_t k = 0; k < 6; ++k) {
    pressed_.carried[k] += carried[k];
    const double unit = k < 3 ? 1.0 : 1.0 / length;
    left += std::abs(touch.wrench[k] - carried[k]) * unit;
    whole += std::abs(touch.wrench[k]) * unit;
  }
  if (left > kLeftOver * whole) note(Event::not_carried, touch, 0.0, 0.0);
}

template <typename Value>
void PadSensor<Value>::add(const double* forces) {
  if (keeps_forces_) {
    for (std::size_t i = 0; i < total_.size(); ++i) total_[i] += forces[i];
  }
  if (only_forces_) return;
  if (power_ != 0) {
    for (double& force : forces_) force = std::ldexp(force, -power_);
  }
  pad_->template deviatoric<Value>().add_response(forces_.data(), map_workspace_, response_.data());
  if (pad_->has_mean()) pad_->template mean<Value>().add_response(forces_.data(), map_workspace_, mean_response_.data());
}

template <typename Value>
void PadSensor<Value>::readings(double* readings) {
  if (!touched_) {
    std::fill(readings, readings + pad_->taxels(), 0.0);
    return;
  }
  pad_->template deviatoric<Value>().readings(response_.data(), map_workspace_, readings);
  for (std::size_t i = 0; power_ != 0 && i < pad_->taxels(); ++i) readings[i] = std::ldexp(readings[i], power_);
  if (!(options_.strength > 0.0)) return;
  // Several bodies on one place, and corners of the sheet, add up to more than the cells of each were allowed.
  const std::size_t each = pad_->taxels() / pad_->layers();
  for (const double most : pad_->saturation()) {
    for (std::size_t i = 0; i < each; ++i, ++readings) *readings = *readings > most ? most : *readings;
  }
}

template <typename Value>
void PadSensor<Value>::stress(double* stress) {
  const std::size_t taxels = pad_->taxels();
  if (!touched_) {
    std::fill(stress, stress + kTensor * taxels, 0.0);
    return;
  }
  means_.resize((kDeviatoric + 1) * taxels);
  pad_->template deviatoric<Value>().means(response_.data(), kOdd, means_.data());
  double* mean = means_.data() + kDeviatoric * taxels;
  pad_->template mean<Value>().means(mean_response_.data(), kEven, mean);
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

template <typename Value>
SolvedCells PadSensor<Value>::solved_cells(std::size_t touch) const {
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
  solved.forces = press.forces.data();
  if (sheared) solved.full = &press.full;
  solved.workspace = &press.workspace;
  return solved;
}

template <typename Value>
Rectangle PadSensor<Value>::sheet() const {
  const SurfaceGrid& surface = pad_->surface();
  return {surface.low_x(), surface.low_y(), surface.high_x(), surface.high_y()};
}

// The flat face that a body turns to the pad, as far as it lies on the sheet, and where it stands; null for none.
template <typename Value>
std::shared_ptr<const Face> PadSensor<Value>::face_towards(const Touch& touch, Placement& placement) {
  if (touch.face != nullptr) placement = touch.placement;
  if (touch.face != nullptr || touch.geometry == nullptr) return touch.face;
  BodyGeometry& body = *touch.geometry;
  const double* up = touch.pose.rotation + 6;
  // Where the force passes, what presses is near the surface; a face far below it is beside the pad, or under it.
  const double near = kNear * pad_->depth();
  const double x = -touch.wrench[4] / touch.wrench[2], y = touch.wrench[3] / touch.wrench[2];
  for (std::size_t i = 0; i < body.sides(); ++i) {
    const double* facing = body.up(i);
    if (up[0] * facing[0] + up[1] * facing[1] + up[2] * facing[2] < kFacing) continue;
    const FlatSide* side = body.side(i);
    if (side == nullptr) continue;
    Face plane;
    std::copy(side->rotation, side->rotation + 9, plane.rotation);
    plane.height = side->height;
    plane.most_slope = side->most_slope;
    plane.tips_at = side->tips_at;
    if (!place(plane, touch.pose, placement) || std::abs(plane_height(plane, touch.pose, x, y)) > near) continue;
    if (side->whole != nullptr && over_sheet(*side->whole, placement)) return side->whole;
    const std::shared_ptr<const Face> cut = cut_face(touch, i, placement);
    placement = kUnmoved;
    return cut;
  }
  return nullptr;
}

template <typename Value>
std::shared_ptr<const Face> PadSensor<Value>::cut_face(const Touch& touch, std::size_t side,
                                                       const Placement& placement) {
  const FlatSide& whole = *touch.geometry->side(side);
  std::array<std::int64_t, 3> place = {std::llround(placement.shift[0] / kCutStep),
                                       std::llround(placement.shift[1] / kCutStep),
                                       std::llround(placement.angle() / kCutTurn)};
  if (whole.endless) place = {};
  for (auto known = cut_faces_.begin(); known != cut_faces_.end(); ++known) {
    if (known->body == touch.body && known->side == side && known->place == place &&
        known->geometry == touch.geometry.get()) {
      cut_faces_.splice(cut_faces_.begin(), cut_faces_, known);
      return known->face;
    }
  }
  const Rectangle over = sheet();
  Outline cut;
  bool any = true;
  if (whole.endless) {
    cut.rings.push_back({{over.west, over.south}, {over.east, over.south}, {over.east, over.north}, {over.west, over.north}});
  } else {
    const double angle = static_cast<double>(place[2]) * kCutTurn;
    const Placement there = {std::cos(angle), std::sin(angle),
                             {static_cast<double>(place[0]) * kCutStep, static_cast<double>(place[1]) * kCutStep}};
    any = clip_outline(whole.outline, there, over, cut);
  }
  std::shared_ptr<Face> face;
  if (any) {
    face = std::make_shared<Face>();
    // Squares along the outline's own axes, and along the sheet's where it is that.
    if (cutter_.make(cut, options_.cells, *face, whole.endless ? 0.0 : static_cast<double>(place[2]) * kCutTurn)) {
      std::copy(whole.rotation, whole.rotation + 9, face->rotation);
      face->height = whole.height;
      face->most_slope = whole.most_slope;
      face->tips_at = whole.tips_at;
      face->cut = true;
      face->quadrature = cutter_.quadrature();
    } else {
      face = nullptr;
    }
  }
  cut_faces_.push_front({touch.body, side, place, touch.geometry.get(), face});
  if (cut_faces_.size() > kMostCutFaces) cut_faces_.pop_back();
  return face;
}

template <typename Value>
bool PadSensor<Value>::over_sheet(const Face& face, const Placement& placement) const {
  const Rectangle over = sheet();
  return std::all_of(face.corners.begin(), face.corners.end(), [&](const Point& corner) {
    const Point there = placement(corner);
    return over.holds(there.x, there.y);
  });
}

template class PadSensor<float>;
template class PadSensor<double>;

}  // namespace mjtactile
