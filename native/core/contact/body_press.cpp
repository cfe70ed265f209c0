#include "contact/body_press.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

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

double borne_by(const CellContact& contact) {
  return std::accumulate(contact.normal().begin(), contact.normal().end(), 0.0);
}

}  // namespace

Point on_pad(const SolvedCells& solved, const Point& at) {
  return solved.bent == nullptr ? solved.contact->placement()(at) : solved.bent->plane().on_pad(at);
}

void BodyPress::turn(const Touch& touch) {
  if (!is_curved()) return;
  Point foot = {0.0, 0.0};
  if (!centre_of_pressure(pad_->outer(), touch.wrench, foot)) {
    double all = 0.0;
    for (const ContactPoint& point : touch.points) {
      all += point.force;
      foot.x += point.force * point.x, foot.y += point.force * point.y;
    }
    if (all > 0.0) foot.x /= all, foot.y /= all;
  }
  plane_.touch(pad_->outer(), foot);
  here_ = touch;
  here_.pose = plane_.into(touch.pose);
  plane_.wrench_into(touch.wrench, here_.wrench);
  for (ContactPoint& point : here_.points) {
    const double on_pad[3] = {point.x, point.y, pad_->outer().at(point.x, point.y).z};
    double seen[3];
    plane_.into(on_pad, seen);
    point.x = seen[0], point.y = seen[1];
    double wrench[6];
    plane_.wrench_into(point.wrench, wrench);
    std::copy(wrench, wrench + 6, point.wrench);
  }
}

bool BodyPress::solve(const Touch& touch, const std::shared_ptr<const Face>& face, const Placement& placement) {
  face_ = face;
  is_flat_ = face != nullptr;
  const bool whole = touch.map == nullptr && touch.geometry != nullptr && !touch.geometry->shapes().empty();
  if (is_flat_ && flat_.solve(*face, placement, surface(), touch.wrench, workspace_)) {
    // If the face cannot carry all of the force, other parts of the body touch as well.
    const bool bears = borne_by(flat_.contact()) > kBears * touch.pressing();
    if (!whole || (bears && !others_touch(touch))) return true;
  }
  is_flat_ = false;
  if (touch.map != nullptr) return press_map(touch);
  return whole && press_shapes(touch);
}

// Whether the body, pressed on a flat face, comes down so far that other parts of it may touch as well.
bool BodyPress::others_touch(const Touch& touch) const {
  if (!flat_.reaches(face_->any_part)) return false;
  if (flat_.reaches(face_->own_shapes)) return true;
  const InclinedPlane lowered = flat_.lowered(centre_of_pressure(touch.wrench));
  return any_below(face_->rises, touch.geometry->shapes(), touch.pose, sheet(), -pad_->depth(), lowered);
}

// Solve the contact of a body's own shapes. False if none of them faces the pad.
bool BodyPress::press_shapes(const Touch& touch) {
  const auto bears = [&](double force) { return force > kBears * touch.pressing(); };
  const double whole = press_above(touch, -pad_->depth());
  const double turned = patch_.tilt();
  const double sunk = std::min(kDeeper * touch.sunk + kDeeperBy, pad_->depth());
  const bool deeper = patch_.least() < -sunk && sunk < pad_->depth();
  if (!deeper || (bears(whole) && turned < kTurned)) return whole > 0.0;
  // Parts deeper in the pad than MuJoCo's contacts may be beside it. The body then tilts less without them.
  std::swap(patch_, other_patch_);
  std::swap(gap_, other_gap_);
  const double above = press_above(touch, -sunk);
  if (bears(above) ? !bears(whole) || patch_.tilt() < kTurnsLess * turned : above > whole) return true;
  std::swap(patch_, other_patch_);
  std::swap(gap_, other_gap_);
  if (whole > 0.0) patch_.place(surface(), workspace_);
  return whole > 0.0;
}

// Solve the contact of the parts of a body's shapes above a floor [m]. Returns the force that it carries [N], 0 if
// there is no contact.
double BodyPress::press_above(const Touch& touch, double floor) {
  const double reach = kReach * pad_->depth(), borne = press_within(touch, floor, reach);
  const bool beyond = borne > 0.0 && touches_beyond(touch, reach);
  return beyond ? press_within(touch, floor, pad_->depth()) : borne;
}

// Whether the contact is so deep, or tilts the body so far, that parts of its meshes out of reach touch. If the tilt is
// not settled, whether they may.
bool BodyPress::touches_beyond(const Touch& touch, double reach) {
  const Rectangle over = gap_.bounds();
  const Point at = centre_of_pressure(touch.wrench);
  const double farthest =
      std::hypot(std::max(at.x - over.west, over.east - at.x), std::max(at.y - over.south, over.north - at.y));
  const double lowered = patch_.contact().indentation() + patch_.tilt() * farthest;
  if (!(lowered > reach)) return false;
  InclinedPlane plane = {{0.0, 0.0}, kNowhere};
  if (patch_.settled()) plane = patch_.reached();
  if (is_curved()) plane.height += plane_.whole().highest;
  return gap_.left_out_below(plane);
}

// As press_above(), with meshes up to a height above their lowest point [m].
double BodyPress::press_within(const Touch& touch, double floor, double reach) {
  // Over a curved pad, the body may be anywhere between the surface's lowest and highest point.
  const double lowest = is_curved() ? plane_.whole().lowest : 0.0;
  const double highest = is_curved() ? plane_.whole().highest : 0.0;
  const HeightRange range = {lowest + floor, highest + pad_->depth(), highest, reach};
  // If none of the shapes is there, the map is empty and no contact is found.
  gap_.place(touch.geometry->shapes(), touch.pose, sheet(), range);
  return solve_over(gap_, touch, floor, pad_->depth()) ? borne_by(patch_.contact()) : 0.0;
}

// Solve the contact of a body that is given by its heights over the pad.
bool BodyPress::press_map(const Touch& touch) {
  if (is_curved()) turned_.place(*touch.map, plane_);
  const HeightMap& map = is_curved() ? turned_ : *touch.map;
  return solve_over(map, touch, -kNowhere, kNowhere);
}

// Solve the contact of a body by its heights over the flat pad, or over the plane of a curved one: distances from that
// surface below `floor` or above `ceiling` [m] do not count then.
bool BodyPress::solve_over(const HeightMap& map, const Touch& touch, double floor, double ceiling) {
  if (is_curved()) {
    // A flat bottom touches a curved pad with its middle, and its rim bears little more.
    over_.place(map, plane_, floor, ceiling);
    return patch_.solve(over_, surface(), touch.wrench, workspace_);
  }
  if (!patch_.solve(map, surface(), touch.wrench, workspace_)) return false;
  patch_.refine_flat_rim(map, surface(), touch.wrench, workspace_);
  return true;
}

void BodyPress::sink(const BodyPress& other, SurfaceCompliance::Workspace& workspace) {
  const auto on_surface = [](const BodyPress& one) {
    const BentCells* bent = one.bent();
    const double* points = bent == nullptr ? one.workspace_.placed.data() : bent->on_pad().data();
    return SurfaceCells{one.cells().cells(), points, 1, one.cells().areas.data(), nullptr, bend_of(bent)};
  };
  pad_->compliance().add_sinking(on_surface(*this), on_surface(other), other.contact().normal().data(), workspace,
                                 sunk_.data());
}

double BodyPress::press_again(const Touch& touch) {
  forces_.assign(contact().normal().begin(), contact().normal().end());
  if (is_flat_) {
    flat_.press_again(surface(), touch.wrench, sunk_, workspace_);
  } else {
    patch_.press_again(surface(), touch.wrench, sunk_, workspace_);
  }
  double change = 0.0;
  for (std::size_t i = 0; i < forces_.size(); ++i) {
    change = std::max(change, std::abs(contact().normal()[i] - forces_[i]));
  }
  return change;
}

bool BodyPress::find_forces(const Touch& touch, SurfaceShear& shear, double* nodal) {
  forces_.resize(3 * cells().cells());
  leans_.clear();
  const bool exact = is_curved() ? find_on_curved(shear, nodal) : find_on_flat(touch, shear, nodal);
  return exact && contact().exact();
}

bool BodyPress::find_on_flat(const Touch& touch, SurfaceShear& shear, double* nodal) {
  const bool exact = set_forces(touch, shear);
  CellContact::sum(workspace_, cells().cells(), forces_.data(), carried_);
  balance_leans();
  nodal_forces(cells(), contact().placement(), pad_->surface(), on_cells(), workspace_.tractions, nodal);
  return exact;
}

// On a curved pad, cells press along their own normals, which have components along the tangent plane. These carry a
// part of the tangential force, and shear carries the rest.
bool BodyPress::find_on_curved(SurfaceShear& shear, double* nodal) {
  double along[3], carried[6];
  patch_.bent().along_plane(contact().normal().data(), along);
  double* wrench = here_.wrench;
  wrench[0] -= along[0], wrench[1] -= along[1], wrench[5] -= along[2];
  const bool exact = set_forces(here_, shear);
  CellContact::sum(workspace_, cells().cells(), forces_.data(), carried);
  carried[0] += along[0], carried[1] += along[1], carried[5] += along[2];
  plane_.wrench_out_of(carried, carried_);
  balance_leans();
  patch_.bent().nodal_forces(cells(), pad_->surface(), on_cells(), carried_, bending_, nodal);
  return exact;
}

// Set the forces on the cells. False if shear has no solution, and a simpler distribution carries it.
bool BodyPress::set_forces(const Touch& touch, SurfaceShear& shear) {
  const ShearOutcome outcome = solve_shear(touch, shear);
  if (outcome.refused) contact().forces(cells(), touch.wrench, forces_.data());
  bound_stress(cells(), options_.strength, forces_.data());
  return !outcome.simplified;
}

// Compute the forces on the cells if shear is bounded by friction or is not in proportion to the pressure. Refused if
// it is plainly in proportion, or if no solution was found.
ShearOutcome BodyPress::solve_shear(const Touch& touch, SurfaceShear& shear) {
  const TangentialChoice& choice = *options_.tangential;
  const bool plain = !choice.couples() && options_.friction < 0.0 && !(options_.any_torsion && touch.wrench[5] != 0.0);
  if (plain || !contact().exact()) return {true, false, false};
  if (choice.couples()) integrate_shear();
  PressedCells pressed = contact().pressed_cells(cells(), heights(), workspace_);
  pressed.gradients = gradients();
  const double friction = options_.friction < 0.0 && choice.slips() ? touch.friction : options_.friction;
  return shear.solve(choice, {pressed, choice.couples() ? &full_ : nullptr, touch.wrench, friction}, forces_.data());
}

// Set the compliance of the cells to forces along the surface. The integrals of a whole face are kept.
void BodyPress::integrate_shear() {
  const bool whole = on_whole_face();
  if (!whole || sheared_ != face_) {
    if (is_flat_) {
      flat_.integrate_shear(integrals_);
    } else {
      patch_.integrate_shear(integrals_);
    }
  }
  sheared_ = whole ? face_ : nullptr;
  full_.begin(pad_->compliance(),
              {CellContact::on_surface(cells(), workspace_, bent()), &integrals_, contact().placement()},
              options_.law->couples() ? &workspace_.matrix : nullptr, workspace_.compliance);
}

// Gradients of the body's height above cells that lean; null if none leans. All cells of a flat face lean alike. A law
// without shapes does not follow the body's.
const std::vector<Point>* BodyPress::gradients() const {
  const bool leans = !is_flat_ && options_.law->shapes() && options_.tangential->leans();
  return leans ? &patch_.gradients() : nullptr;
}

// Compute the leans of the cells under the forces on them.
void BodyPress::balance_leans() {
  const std::vector<Point>* gradients = this->gradients();
  if (gradients == nullptr) return;
  pressing_.resize(gradients->size());
  for (std::size_t i = 0; i < pressing_.size(); ++i) pressing_[i] = -forces_[3 * i + 2];
  balance_lean(*gradients, cells().centroids.data(), pressing_.data(), leans_);
}

SolvedCells BodyPress::solved(bool coupled) const {
  const bool whole = on_whole_face();
  SolvedCells solved;
  solved.contact = &contact();
  solved.face = &cells();
  solved.bent = bent();
  solved.carried = carried_;
  if (!whole) solved.view = is_flat_ ? &flat_.view() : &patch_.view();
  solved.heights = heights();
  if (whole && coupled) solved.sunk = sunk_.data();
  solved.forces = on_cells();
  if (options_.tangential->couples() && contact().exact()) solved.full = &full_;
  solved.workspace = &workspace_;
  return solved;
}

}  // namespace mjtactile
