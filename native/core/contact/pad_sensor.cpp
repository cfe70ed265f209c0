#include "contact/pad_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "geometry/hash.hpp"
#include "linalg/angles.hpp"
#include "linalg/vectors.hpp"

namespace mjtactile {
namespace {

// Number of steps at one pose after which a basis is made.
constexpr double kSteady = 8.0;
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

}  // namespace

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
      faces_(pad_->surface().sheet(), pad_->depth(), {options.cells, options.widest}),
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
  while (presses_.size() < count) presses_.push_back(std::make_unique<BodyPress>(pad_, options_));
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
  if (loaded) press.turn(seen);
  const Touch& touch = press.turned(seen);
  if (!loaded || !(touch.pressing() > 0.0)) {
    note_carried(seen, std::array<double, 6>{}.data());
    return;
  }
  Placement placement = kUnmoved;
  // A whole flat side cannot touch a curved pad.
  const std::shared_ptr<const Face> face = press.plane() == nullptr ? faces_.towards(touch, placement) : nullptr;
  if (face != nullptr && steady && press_steady(touch, face)) return;
  if (face != nullptr && !options_.law->shapes() && press_linear(touch, *face, placement, place)) return;
  solved_[place] = press.solve(touch, face, placement) ? 1 : 0;
  if (solved_[place] || press_points(seen, press, place)) return;
  note(Event::refused, touch, 0.0, 0.0);
  note_carried(seen, std::array<double, 6>{}.data());
}

Steadiness PadSensor::after(const Steadiness& before) const {
  if (!touched_) return {};
  return {key_, before.pose == key_ ? std::min(before.steps + 1.0, kSteady) : 1.0};
}

// Press with MuJoCo's contact points, each with its own force, if the geometry does not face the pad.
bool PadSensor::press_points(const Touch& seen, const BodyPress& press, std::size_t place) {
  const TangentPlane* plane = press.plane();
  const Touch& touch = press.turned(seen);
  if (!points_.lay(touch.points, {kLeastSpot * facing_gap_, options_.strength, press.sheet()})) return false;
  double carried[6];
  std::copy(seen.wrench, seen.wrench + 6, carried);
  points_.nodal_forces(pad_->surface(), plane, carried, forces_.data());
  // The squares' area is not that of the body. So strains are judged over squares as wide as the largest small
  // indentation.
  const double wide = pad_->range().indentation;
  pressed_.area += points_.area();
  note_range(touch, carried, std::max(points_.area(), static_cast<double>(points_.face().cells()) * wide * wide), 0.0);
  pressed_.peak = std::max(pressed_.peak, points_.peak());
  note_carried(seen, carried);
  const auto here = [plane](const Point& at) { return plane == nullptr ? at : plane->on_pad(at); };
  for (const CellEdge& edge : points_.face().edges) {
    if (keeps_forces_) rims_[place].push_back({here(edge.start), here(edge.end)});
  }
  add_forces();
  return true;
}

// Solve each body in turn on the surface as deformed by the others, until no force changes (Gauss-Seidel).
void PadSensor::couple(const Touch* touches, std::size_t count) {
  for (int round = 0; round < kRounds; ++round) {
    double change = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!solved_[i]) continue;
      BodyPress& own = *presses_[i];
      own.clear_sunk();
      for (std::size_t j = 0; j < count; ++j) {
        if (j != i && solved_[j]) own.sink(*presses_[j], others_);
      }
      const Touch& touch = own.turned(touches[i]);
      change = std::max(change, own.press_again(touch) / touch.pressing());
    }
    if (change <= kSettled) return;
  }
}

// Add the forces of a contact that was solved on cells.
void PadSensor::finish(const Touch& touch, BodyPress& press) {
  const CellContact& contact = press.contact();
  const Face& cells = press.cells();
  if (!press.find_forces(touch, shear_, forces_.data())) note(Event::approximated, touch, 0.0, 0.0);
  double borne[3] = {};
  for (std::size_t i = 0; i < 3 * cells.cells(); ++i) borne[i % 3] += press.forces()[i];
  note_contact(touch, borne, contact.pressed_area(), contact.indentation());
  for (std::size_t i = 0; i < cells.cells(); ++i) {
    pressed_.peak = std::max(pressed_.peak, contact.normal()[i] / cells.areas[i]);
  }
  note_carried(touch, press.carried());
  add_forces();
}

// Solve law "uniform" on a flat face exactly, without cells.
bool PadSensor::press_linear(const Touch& touch, const Face& face, const Placement& placement, std::size_t place) {
  if (!uniform_.solve(face, placement, pad_->surface(), touch.wrench, options_.friction, forces_.data())) return false;
  const double area = uniform_.traction().integrals().area;
  if (options_.strength > 0.0 && touch.pressing() > options_.strength / 2 * area) return false;
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
               basis->contact.indentation() * touch.pressing() / basis->contact.pressed_with());
  note_carried(touch, carried);
  std::visit([&](auto& own) { combine(basis, own); }, response_);
  return true;
}

// A basis of a face at a pose, for loads like this one, and the weights of its parts; null if it has none.
std::shared_ptr<const Basis> PadSensor::make_basis(const BasisKey& key, const std::shared_ptr<const Face>& face,
                                                   const double* wrench) {
  Placement placement = kUnmoved;
  if (!face->cut && !place(*face, at(key.pose, tolerance_), placement)) return nullptr;
  const ContactSurface surface = {sheet(), pad_->compliance(), options_};
  CellContact contact;
  contact.place(*face, placement, surface, workspace_);
  contact.press(*face, surface, {wrench}, workspace_);
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
  std::vector<double> widened(map.response_size);
  part_forces_.resize(3 * face.cells());
  for (std::size_t p = 0; p < contact.parts(); ++p) {
    contact.part_forces(face, p, part_forces_.data());
    mjtactile::nodal_forces(face, contact.placement(), pad_->surface(), {part_forces_.data()}, workspace_.tractions,
                            forces_.data());
    std::fill(response.begin(), response.end(), Value(0));
    map.add_response(forces_.data(), own.workspace, response.data());
    std::copy(response.begin(), response.end(), widened.begin());
    responses.set(p, widened.data());
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
  const bool several = std::count(solved_.begin(), solved_.end(), 1) > 1;
  return presses_[touch]->solved(several && options_.law->couples());
}

}  // namespace mjtactile
