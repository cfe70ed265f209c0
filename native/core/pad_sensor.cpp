#include "pad_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mjtactile {
namespace {

// Steps at one pose after which a basis is worth its making.
constexpr double kSteady = 8.0;
// A face that overhangs the sheet is cut at its edge for places rounded to this [m, rad]: what the edge is off by is a
// hundredth of the depth of the first taxels.
constexpr double kCutStep = 5e-6, kCutTurn = 5e-4;
constexpr std::size_t kMostCutFaces = 64;
// Faces that lean more than this never face the pad alone (their cosine).
constexpr double kFacing = 0.9;
// Height of what presses over the surface or, where contacts are soft, below it, over the pad's depth.
constexpr double kNear = 0.8;
// A hash kept as a double must be a whole number that a double holds.
constexpr std::uint64_t kHashMask = (std::uint64_t{1} << 52) - 1;
// Deviatoric coordinates and the mean stress under x -> -x and y -> -y (mjtactile/influence.py).
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

}  // namespace

template <typename Value>
PadSensor<Value>::PadSensor(std::shared_ptr<const Pad> pad, LawOptions options, bool native, double tolerance)
    : pad_(std::move(pad)), options_(options), native_(native), tolerance_(tolerance) {
  response_.resize(pad_->template deviatoric<Value>().response_size);
  if (pad_->has_mean()) mean_response_.resize(pad_->template mean<Value>().response_size);
  forces_.resize(3 * pad_->surface().nodes_x() * pad_->surface().nodes_y());
}

template <typename Value>
void PadSensor<Value>::press(const Touch* touches, std::size_t count, const Steadiness& before, Host& host) {
  touched_ = count > 0;
  key_ = 0.0;
  if (!touched_) return;
  std::uint64_t hash = count;
  for (std::size_t i = 0; i < count; ++i) {
    hash = mixed(hash, static_cast<std::uint64_t>(touches[i].body));
    for (const std::int64_t one : rounded(touches[i].pose, tolerance_)) {
      hash = mixed(hash, static_cast<std::uint64_t>(one));
    }
  }
  key_ = static_cast<double>(hash & kHashMask);
  const bool steady = before.pose == key_ && before.steps >= kSteady && !pad_->has_mean();
  std::fill(response_.begin(), response_.end(), Value(0));
  std::fill(mean_response_.begin(), mean_response_.end(), Value(0));
  for (std::size_t i = 0; i < count; ++i) press_one(touches[i], steady, host);
}

template <typename Value>
Steadiness PadSensor<Value>::after(const Steadiness& before) const {
  if (!touched_) return {};
  return {key_, before.pose == key_ ? std::min(before.steps + 1.0, kSteady) : 1.0};
}

template <typename Value>
void PadSensor<Value>::press_one(const Touch& touch, bool steady, Host& host) {
  if (native_) {
    KnownBody& body = known_body(touch.body, host);
    if (body.geometry != nullptr) {
      bool faced = false;
      if (press_face(touch, body, steady, host, faced)) return;
      if (!faced && press_curved(touch, *body.geometry, host)) return;
    }
  }
  if (host.nodal_forces(touch, forces_.data())) add(forces_.data());
}

// With `faced`, whether the body turns a flat face to the pad at all.
template <typename Value>
bool PadSensor<Value>::press_face(const Touch& touch, KnownBody& body, bool steady, Host& host, bool& faced) {
  Placement placement;
  const int number = face_towards(touch, body, host, placement);
  faced = number >= 0;
  if (!faced) return false;
  std::shared_ptr<const Face> face = body.faces[static_cast<std::size_t>(number)].second;
  if (!over_sheet(*face, placement)) {
    face = cut_face_of(touch, number, placement, host);
    if (face == nullptr) return false;
    placement = kHere;
  }
  if (options_.law == Law::uniform) return press_uniform(touch, *face, placement, host);
  if (steady && press_steady(touch, face, host)) return true;
  if (!flat_.solve(*face, placement, pad_->compliance(), options_, touch.wrench, workspace_)) return false;
  const CellContact& contact = flat_.contact();
  if (!contact.weights(flat_.face(), options_, flat_.carried(), weights_, workspace_)) return false;
  if (!flat_.carries(touch.wrench)) warn_not_carried(touch, host);
  warn_beyond_range(touch, -touch.wrench[2] / contact.pressed_area(), contact.motion(flat_.face(), weights_).approach,
                    host);
  contact.nodal_forces(flat_.face(), pad_->surface(), weights_, workspace_, forces_.data());
  add(forces_.data());
  return true;
}

template <typename Value>
bool PadSensor<Value>::press_uniform(const Touch& touch, const Face& face, const Placement& placement, Host& host) {
  if (options_.friction >= 0.0) return false;
  double coefficients[9];
  traction_.cover(face, placement);
  if (!traction_.carry(touch.wrench, coefficients)) return false;
  warn_beyond_range(touch, -touch.wrench[2] / traction_.integrals().area, 0.0, host);
  traction_.nodal_forces(pad_->surface(), coefficients, forces_.data());
  add(forces_.data());
  return true;
}

template <typename Value>
bool PadSensor<Value>::press_curved(const Touch& touch, const BodyGeometry& geometry, Host& host) {
  if (geometry.curved.shapes.empty() || options_.law == Law::uniform) return false;
  const SurfaceGrid& surface = pad_->surface();
  const Rectangle sheet = {surface.low_x(), surface.low_y(), surface.high_x(), surface.high_y()};
  if (!gap_.place(geometry.curved, touch.pose, sheet, geometry.limits)) return false;
  if (!curved_.solve(gap_, gap_.covered(), pad_->compliance(), options_, touch.wrench, workspace_)) {
    return false;
  }
  const CellContact& contact = curved_.contact();
  if (!contact.weights(curved_.face(), options_, touch.wrench, weights_, workspace_)) return false;
  if (!contact.carries(curved_.face(), touch.wrench)) warn_not_carried(touch, host);
  warn_beyond_range(touch, -touch.wrench[2] / contact.pressed_area(), curved_.approach(weights_), host);
  contact.nodal_forces(curved_.face(), surface, weights_, workspace_, forces_.data());
  add(forces_.data());
  return true;
}

// Warn once of forces that pass beside what they press through, and once of strains that are not small.
template <typename Value>
void PadSensor<Value>::warn_not_carried(const Touch& touch, Host& host) {
  if (warned_carried_) return;
  warned_carried_ = true;
  host.not_carried(touch);
}

template <typename Value>
void PadSensor<Value>::warn_beyond_range(const Touch& touch, double pressure, double approach, Host& host) {
  if (warned_range_ || (pressure <= pad_->range().pressure && approach <= pad_->range().approach)) return;
  warned_range_ = true;
  host.beyond_range(touch, pressure, approach);
}

template <typename Value>
bool PadSensor<Value>::press_steady(const Touch& touch, const std::shared_ptr<const Face>& face, Host& host) {
  const BasisKey key = {pad_.get(), face.get(), rounded(touch.pose, tolerance_), options_};
  auto& cache = BasisCache<Value>::shared();
  std::shared_ptr<const Basis<Value>> basis = cache.find(key, *face, touch.wrench, weights_, workspace_);
  if (basis == nullptr) {
    Placement placement = kHere;
    if (!face->cut && !place(*face, at(key.pose, tolerance_), placement)) return false;
    CellContact contact;
    if (!contact.solve(*face, placement, pad_->compliance(), options_, touch.wrench, workspace_)) return false;
    if (is_small(contact)) return false;  // its cells belong to this very load
    const auto& map = pad_->template deviatoric<Value>();
    // One scale for all layers: bytes would leave the deep ones too few digits.
    const Precision stored = pad_->precision() == Precision::byte ? Precision::half : pad_->precision();
    Columns<Value> responses(contact.parts(), map.response_size, stored);
    std::vector<Value> response(map.response_size);
    std::vector<double> unit(contact.parts()), twofold(map.response_size);
    for (std::size_t p = 0; p < contact.parts(); ++p) {
      std::fill(unit.begin(), unit.end(), 0.0);
      unit[p] = 1.0;
      contact.nodal_forces(*face, pad_->surface(), unit, workspace_, forces_.data());
      std::fill(response.begin(), response.end(), Value(0));
      map.add_response(forces_.data(), map_workspace_, response.data());
      std::copy(response.begin(), response.end(), twofold.begin());
      responses.set(p, twofold.data());
    }
    if (!contact.weights(*face, options_, touch.wrench, weights_, workspace_)) return false;
    const std::size_t bytes = responses.bytes();
    basis = std::make_shared<const Basis<Value>>(Basis<Value>{face, pad_, std::move(contact), std::move(responses)});
    cache.keep(key, basis, bytes);
  }
  if (!basis->contact.carries(*face, touch.wrench)) warn_not_carried(touch, host);
  warn_beyond_range(touch, -touch.wrench[2] / basis->contact.pressed_area(),
                    basis->contact.motion(*face, weights_).approach, host);
  part_weights_.assign(weights_.begin(), weights_.end());
  for (std::size_t i = every_.size(); i < part_weights_.size(); ++i) every_.push_back(static_cast<std::uint32_t>(i));
  basis->responses.add(every_.data(), part_weights_.data(), part_weights_.size(), response_.data());
  return true;
}

template <typename Value>
void PadSensor<Value>::add(const double* forces) {
  pad_->template deviatoric<Value>().add_response(forces, map_workspace_, response_.data());
  if (pad_->has_mean()) pad_->template mean<Value>().add_response(forces, map_workspace_, mean_response_.data());
}

template <typename Value>
void PadSensor<Value>::readings(double* readings) {
  if (touched_) {
    pad_->template deviatoric<Value>().readings(response_.data(), map_workspace_, readings);
  } else {
    std::fill(readings, readings + pad_->taxels(), 0.0);
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
typename PadSensor<Value>::KnownBody& PadSensor<Value>::known_body(int number, Host& host) {
  for (KnownBody& known : bodies_) {
    if (known.number == number) return known;
  }
  bodies_.push_back({number, host.body(number), {}});
  KnownBody& made = bodies_.back();
  if (made.geometry != nullptr) made.faces.resize(made.geometry->facing.size() / 3);
  return made;
}

// Number of the face that a body turns to the pad, and where it stands; -1 for none.
template <typename Value>
int PadSensor<Value>::face_towards(const Touch& touch, KnownBody& body, Host& host, Placement& placement) const {
  const double* up = touch.pose.rotation + 6;
  // Where the force passes, what presses is near the surface; a face far below it is beside the pad, or under it.
  const double near = kNear * body.geometry->limits.depth;
  const double x = -touch.wrench[4] / touch.wrench[2], y = touch.wrench[3] / touch.wrench[2];
  for (std::size_t i = 0; i < body.faces.size(); ++i) {
    const double* facing = body.geometry->facing.data() + 3 * i;
    if (up[0] * facing[0] + up[1] * facing[1] + up[2] * facing[2] < kFacing) continue;
    auto& known = body.faces[i];
    if (!known.first) known = {true, host.face(body.number, static_cast<int>(i))};
    if (known.second == nullptr || !place(*known.second, touch.pose, placement)) continue;
    if (std::abs(plane_height(*known.second, touch.pose, x, y)) <= near) return static_cast<int>(i);
  }
  return -1;
}

template <typename Value>
std::shared_ptr<const Face> PadSensor<Value>::cut_face_of(const Touch& touch, int face, const Placement& placement,
                                                          Host& host) {
  const std::array<std::int64_t, 3> place = {std::llround(placement.shift[0] / kCutStep),
                                             std::llround(placement.shift[1] / kCutStep),
                                             std::llround(placement.angle() / kCutTurn)};
  for (auto known = cut_faces_.begin(); known != cut_faces_.end(); ++known) {
    if (known->body == touch.body && known->number == face && known->place == place) {
      cut_faces_.splice(cut_faces_.begin(), cut_faces_, known);
      return known->face;
    }
  }
  const double there[3] = {static_cast<double>(place[0]) * kCutStep, static_cast<double>(place[1]) * kCutStep,
                           static_cast<double>(place[2]) * kCutTurn};
  cut_faces_.push_front({touch.body, face, place, host.cut_face(touch.body, face, there)});
  if (cut_faces_.size() > kMostCutFaces) cut_faces_.pop_back();
  return cut_faces_.front().face;
}

template <typename Value>
bool PadSensor<Value>::over_sheet(const Face& face, const Placement& placement) const {
  const SurfaceGrid& sheet = pad_->surface();
  return std::all_of(face.corners.begin(), face.corners.end(), [&](const Point& corner) {
    const Point there = placement(corner);
    return there.x >= sheet.low_x() && there.x <= sheet.high_x() && there.y >= sheet.low_y() &&
           there.y <= sheet.high_y();
  });
}

template class PadSensor<float>;
template class PadSensor<double>;

}  // namespace mjtactile
