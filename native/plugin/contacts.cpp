#include "plugin/contacts.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

#include "linalg/vectors.hpp"
#include "plugin/model_geometry.hpp"

namespace mjtactile::mujoco {
namespace {

// Names of a pad's further geoms are the name of its first geom, this text and a number.
constexpr char kPieceSuffix[] = "_piece_";
// Cosine of the largest angle between the normals of a contact and of the surface. Other contacts press on the pad's
// side.
constexpr double kLeastUpright = 0.70710678118654752440;
// A pad's side is within this share of its size from its rim. Contacts further inside are with walls between its
// pieces: MuJoCo pushes a body that is in two pieces out of one of them sideways, against the other.
constexpr double kSideShare = 0.05;
// Positions [m] and rotations [-] are rounded to multiples of these. Otherwise rounding errors, which depend on the
// place of the world's origin, would decide on which cells a body's sides lie.
constexpr double kPlaceStep = 0x1p-44, kTurnStep = 0x1p-38;
// Changes of place [m] and of orientation [-] up to which a body asleep has not been moved.
constexpr double kCreep = 1e-4, kCreepTurn = 1e-2;

// Unit normal of the outer surface, out of the pad, at the x and y of a point.
void normal_at(const OuterSurface& outer, const double* point, double* normal) {
  const SurfacePoint at = outer.at(point[0], point[1]);
  const double size = std::sqrt(1.0 + at.slopes[0] * at.slopes[0] + at.slopes[1] * at.slopes[1]);
  normal[0] = -at.slopes[0] / size, normal[1] = -at.slopes[1] / size, normal[2] = 1.0 / size;
}

double rounded_to(double number, double step) { return std::nearbyint(number / step) * step; }

// Position of a point of the world in a frame [m].
void to_frame(const Pose& frame, const double* world, double* here) {
  const double* origin = frame.position;
  const double offset[3] = {world[0] - origin[0], world[1] - origin[1], world[2] - origin[2]};
  rotate_back(frame.rotation, offset, here);
}

// One of MuJoCo's contacts in a pad's frame.
struct PadContact {
  double point[3];         // [m]
  double out_of_pad[3];    // its normal, from the pad to the other geom
  double wrench[6];        // on the pad, about the frame's origin [N, N m]

  // `local`: force and torque of the first geom on the second, as MuJoCo gives them. Their axes are the rows of the
  // contact's frame. `sign`: 1 if the pad is the second geom, -1 if it is the first.
  PadContact(const char* contact, const double* local, double sign, const Pose& frame) {
    const double* axes = &field<double>(contact, layout.contact_frame);
    to_frame(frame, &field<double>(contact, layout.contact_pos), point);
    for (int part = 0; part < 6; part += 3) {
      double world[3];
      rotate_back(axes, local + part, world);
      for (double& one : world) one *= sign;
      rotate_back(frame.rotation, world, wrench + part);
    }
    double moment[3];
    cross(point, wrench, moment);
    for (int k = 0; k < 3; ++k) wrench[3 + k] += moment[k];
    rotate_back(frame.rotation, axes, out_of_pad);
    for (double& one : out_of_pad) one *= -sign;
  }
};

// Pose of a body in a pad's frame, rounded.
Pose body_pose(const Data* data, int body, const Pose& frame) {
  const double* rotation = doubles(data, layout.data_xmat) + 9 * body;
  Pose pose;
  to_frame(frame, doubles(data, layout.data_xpos) + 3 * body, pose.position);
  for (double& one : pose.position) one = rounded_to(one, kPlaceStep);
  for (int j = 0; j < 3; ++j) {
    const double column[3] = {rotation[j], rotation[3 + j], rotation[6 + j]};
    double there[3];
    rotate_back(frame.rotation, column, there);
    for (int i = 0; i < 3; ++i) pose.rotation[3 * i + j] = rounded_to(there[i], kTurnStep);
  }
  return pose;
}

// Whether a body is where it was, as bodies asleep are. They may creep until they fall asleep.
bool is_near(const Pose& was, const Pose& is) {
  const auto within = [](double most) { return [most](double a, double b) { return std::abs(a - b) <= most; }; };
  return std::equal(was.position, was.position + 3, is.position, within(kCreep)) &&
         std::equal(was.rotation, was.rotation + 9, is.rotation, within(kCreepTurn));
}

}  // namespace

Pose pad_frame(const Model* model, const Data* data, int geom) {
  Pose frame;
  const double* position = doubles(data, layout.data_geom_xpos) + 3 * geom;
  const double* rotation = doubles(data, layout.data_geom_xmat) + 9 * geom;
  if (ints(model, layout.model_geom_type)[geom] == kMesh) {
    const int mesh = ints(model, layout.model_geom_dataid)[geom];
    const double* moved = doubles(model, layout.model_mesh_pos) + 3 * mesh;
    const Pose turn = pose_of(moved, doubles(model, layout.model_mesh_quat) + 4 * mesh);
    rotate_from(rotation, turn.rotation, frame.rotation);
    for (int i = 0; i < 3; ++i) {
      frame.position[i] = position[i];
      for (int k = 0; k < 3; ++k) frame.position[i] -= frame.rotation[3 * i + k] * moved[k];
    }
    return frame;
  }
  const double half = doubles(model, layout.model_geom_size)[3 * geom + 2];
  std::copy(rotation, rotation + 9, frame.rotation);
  for (int i = 0; i < 3; ++i) frame.position[i] = position[i] + rotation[3 * i + 2] * half;
  return frame;
}

std::vector<int> pad_pieces(const Model* model, int geom) {
  std::vector<int> pieces = {geom};
  if (ints(model, layout.model_geom_type)[geom] != kMesh) return pieces;
  const char* names = field<const char*>(model, layout.model_names);
  const int* name = ints(model, layout.model_name_geomadr);
  const int own = ints(model, layout.model_geom_bodyid)[geom];
  const int end = ints(model, layout.model_body_geomadr)[own] + ints(model, layout.model_body_geomnum)[own];
  const std::string beginning = std::string(names + name[geom]) + kPieceSuffix;
  for (int other = geom + 1; other < end; ++other) {
    if (std::strncmp(names + name[other], beginning.c_str(), beginning.size()) != 0) break;
    pieces.push_back(other);
  }
  return pieces;
}

bool has_unlisted_flex(const Model* model, const std::vector<int>& pieces) {
  const void* option = &field<char>(model, layout.model_opt);
  if ((field<int>(option, layout.option_enableflags) & layout.enable_ipc) == 0) return false;
  const int *type = ints(model, layout.model_flex_contype), *affinity = ints(model, layout.model_flex_conaffinity);
  for (int flex = 0; flex < field<int>(model, layout.model_nflex); ++flex) {
    if (ints(model, layout.model_flex_dim)[flex] != 2) continue;
    const bool touches = std::any_of(pieces.begin(), pieces.end(), [&](int geom) {
      return (type[flex] & ints(model, layout.model_geom_conaffinity)[geom]) != 0 ||
             (ints(model, layout.model_geom_contype)[geom] & affinity[flex]) != 0;
    });
    if (touches) return true;
  }
  return false;
}

// The touch of the rigid body to which a body belongs.
Touch& Contacts::touch_of(const Model* model, int body) {
  const int root = body < 0 ? body : rigid_root(model, body);
  for (std::size_t i = 0; i < count; ++i) {
    Touch& one = touches[i];
    if (one.body != body && (body < 0 || one.body < 0 || rigid_root(model, one.body) != root)) continue;
    const auto place = std::lower_bound(one.links.begin(), one.links.end(), body);
    if (place == one.links.end() || *place != body) one.links.insert(place, body);
    one.body = one.links.front();
    return one;
  }
  if (touches.size() == count) touches.emplace_back();
  Touch& made = touches[count++];
  made.body = body;
  made.links.assign(1, body);
  made.geometry = nullptr;
  made.pose = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}};
  made.sunk = made.friction = 0.0;
  made.points.clear();
  std::fill(made.wrench, made.wrench + 6, 0.0);
  return made;
}

// Set contacts aside with bodies that are not awake and have not been put elsewhere.
void Contacts::set_aside(const Data* data, const Pose& frame) {
  const int* awake = ints(data, layout.data_body_awake);
  const auto rests = [&](const auto& one) {
    return one.body >= 0 && awake[one.body] != kAwake && is_near(one.pose, body_pose(data, one.body, frame));
  };
  for (std::size_t i = 0; i < count; ++i) {
    if (!rests(touches[i])) continue;
    if (aside_.size() == aside_count_) aside_.emplace_back();
    std::swap(aside_[aside_count_++], touches[i]);
  }
  std::copy_if(beside_.begin(), beside_.end(), std::back_inserter(beside_aside_), rests);
}

// Add what was set aside, but nothing of a body that has contacts in this state.
void Contacts::add_aside() {
  const std::size_t touching = count, beside = beside_.size();
  const auto holds = [&](int body) {
    const auto is_of = [body](const auto& one) { return one.body == body; };
    return std::none_of(touches.begin(), touches.begin() + static_cast<std::ptrdiff_t>(touching), is_of) &&
           std::none_of(beside_.begin(), beside_.begin() + static_cast<std::ptrdiff_t>(beside), is_of);
  };
  for (std::size_t i = 0; i < aside_count_; ++i) {
    if (!holds(aside_[i].body)) continue;
    if (touches.size() == count) touches.emplace_back();
    std::swap(touches[count], aside_[i]);
    add(touches[count++].wrench);
  }
  for (const Beside& one : beside_aside_) {
    if (!holds(one.body)) continue;
    beside_.push_back(one);
    add(one.wrench);
  }
}

void Contacts::add(const double* more) {
  for (int k = 0; k < 6; ++k) wrench[k] += more[k];
}

void Contacts::gather(const Model* model, const Data* data, const std::vector<int>& pieces, const OuterSurface& surface,
                      bool last_hold) {
  const int* bodies = ints(model, layout.model_geom_bodyid);
  Pose frame = {};
  bool placed = false;
  const auto place = [&] {
    if (!placed) frame = pad_frame(model, data, pieces.front());
    placed = true;
  };
  aside_count_ = 0;
  beside_aside_.clear();
  if (last_hold && any() && layout.data_body_awake >= 0 &&
      ints(data, layout.data_body_awake)[bodies[pieces.front()]] != kAwake) {
    place();
    set_aside(data, frame);
  }
  count = 0;
  beside_.clear();
  behind.clear();
  passive = false;
  std::fill(wrench, wrench + 6, 0.0);
  const int contacts = field<int>(data, layout.data_ncon);
  const char* contact = field<const char*>(data, layout.data_contact);
  for (int i = 0; i < contacts; ++i, contact += layout.contact_size) {
    const int* pair = &field<int>(contact, layout.contact_geom);
    const auto is_pad = [&](int one) { return std::find(pieces.begin(), pieces.end(), one) != pieces.end(); };
    const bool second = is_pad(pair[1]);
    if (!second && !is_pad(pair[0])) continue;
    place();
    double local[6];
    functions.contact_force(model, data, i, local);
    const PadContact seen(contact, local, second ? 1.0 : -1.0, frame);
    if (std::all_of(seen.wrench, seen.wrench + 6, [](double one) { return one == 0.0; })) {
      passive = passive || field<int>(contact, layout.contact_exclude) == kPassive;
      continue;  // MuJoCo lists it, but it carries no load, or a load that MuJoCo does not tell
    }
    add(seen.wrench);
    const int other = second ? pair[0] : pair[1];
    const int body = other < 0 ? -1 : bodies[other];
    double out[3];
    normal_at(surface, seen.point, out);
    const double upright = dot(out, seen.out_of_pad), pressing = -dot(out, seen.wrench);
    if (upright < -kLeastUpright) behind.push_back(body);
    const bool between_pieces = pieces.size() > 1 && upright >= -kLeastUpright &&
                                surface.sheet().larger(-kSideShare).holds(seen.point[0], seen.point[1]);
    if (upright < kLeastUpright && !between_pieces) {
      beside_.push_back({body, {}, {}});
      if (body >= 0) beside_.back().pose = body_pose(data, body, frame);
      std::copy(seen.wrench, seen.wrench + 6, beside_.back().wrench);
      continue;
    }
    Touch& touch = touch_of(model, body);
    for (int k = 0; k < 6; ++k) touch.wrench[k] += seen.wrench[k];
    // MuJoCo looks for contacts of signed distance functions at a few points, so they do not tell how deep the body is.
    const bool sampled = other >= 0 && ints(model, layout.model_geom_type)[other] == kSdf;
    const double sunk = -field<double>(contact, layout.contact_dist) / std::max(upright, kLeastUpright);
    touch.sunk = std::max(touch.sunk, sampled ? std::numeric_limits<double>::infinity() : sunk);
    const double* friction = &field<double>(contact, layout.contact_friction);
    touch.friction = std::max({touch.friction, friction[0], friction[1]});
    if (!(pressing > 0.0)) continue;
    touch.points.push_back({seen.point[0], seen.point[1], pressing, {}});
    std::copy(seen.wrench, seen.wrench + 6, touch.points.back().wrench);
  }
  for (std::size_t i = 0; i < count; ++i) {
    if (touches[i].body >= 0) touches[i].pose = body_pose(data, touches[i].body, frame);
  }
  add_aside();
  std::sort(touches.begin(), touches.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Touch& a, const Touch& b) { return a.body < b.body; });
}

}  // namespace mjtactile::mujoco
