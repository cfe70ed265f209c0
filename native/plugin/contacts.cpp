#include "plugin/contacts.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "plugin/model_geometry.hpp"

namespace mjtactile::mujoco {
namespace {

// What names of a pad's further geoms begin with, after the name of its first.
constexpr char kPiece[] = "_piece_";
// Contacts whose normal leans further from the surface's than this (its cosine) press on the pad from beside.
constexpr double kPresses = 0.70710678118654752440;

// The surface's normal, out of the pad, above a point of its plane.
void normal_at(const OuterSurface& outer, const double* point, double* normal) {
  const SurfacePoint at = outer.at(point[0], point[1]);
  const double size = std::sqrt(1.0 + at.slopes[0] * at.slopes[0] + at.slopes[1] * at.slopes[1]);
  normal[0] = -at.slopes[0] / size, normal[1] = -at.slopes[1] / size, normal[2] = 1.0 / size;
}

// rotation^T * vector
void turned_back(const double* rotation, const double* vector, double* out) {
  for (int i = 0; i < 3; ++i) {
    out[i] = rotation[i] * vector[0] + rotation[3 + i] * vector[1] + rotation[6 + i] * vector[2];
  }
}

}  // namespace

Frame pad_frame(const Layout& layout, const Model* model, const Data* data, int geom) {
  Frame frame = {};
  const double* position = field<const double*>(data, layout.data_geom_xpos) + 3 * geom;
  const double* rotation = field<const double*>(data, layout.data_geom_xmat) + 9 * geom;
  if (field<const int*>(model, layout.model_geom_type)[geom] == kMesh) {
    const int mesh = field<const int*>(model, layout.model_geom_dataid)[geom];
    const double* moved = field<const double*>(model, layout.model_mesh_pos) + 3 * mesh;
    const Pose turn = pose_of(moved, field<const double*>(model, layout.model_mesh_quat) + 4 * mesh);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        frame.rotation[3 * i + j] = 0.0;
        for (int k = 0; k < 3; ++k) frame.rotation[3 * i + j] += rotation[3 * i + k] * turn.rotation[3 * j + k];
      }
    }
    for (int i = 0; i < 3; ++i) {
      frame.origin[i] = position[i];
      for (int k = 0; k < 3; ++k) frame.origin[i] -= frame.rotation[3 * i + k] * moved[k];
    }
    return frame;
  }
  const double half = field<const double*>(model, layout.model_geom_size)[3 * geom + 2];
  std::copy(rotation, rotation + 9, frame.rotation);
  for (int i = 0; i < 3; ++i) frame.origin[i] = position[i] + rotation[3 * i + 2] * half;
  return frame;
}

std::vector<int> pad_pieces(const Layout& layout, const Model* model, int geom) {
  std::vector<int> pieces = {geom};
  if (field<const int*>(model, layout.model_geom_type)[geom] != kMesh) return pieces;
  const char* names = field<const char*>(model, layout.model_names);
  const int* name = field<const int*>(model, layout.model_name_geomadr);
  const int* body = field<const int*>(model, layout.model_geom_bodyid);
  const int end = field<const int*>(model, layout.model_body_geomadr)[body[geom]] +
                  field<const int*>(model, layout.model_body_geomnum)[body[geom]];
  const std::string beginning = std::string(names + name[geom]) + kPiece;
  for (int other = geom + 1; other < end; ++other) {
    if (std::strncmp(names + name[other], beginning.c_str(), beginning.size()) != 0) break;
    pieces.push_back(other);
  }
  return pieces;
}

Touch& Contacts::touch_of(int body) {
  for (std::size_t i = 0; i < count; ++i) {
    if (touches[i].body == body) return touches[i];
  }
  if (touches.size() == count) touches.emplace_back();
  Touch& made = touches[count++];
  made.body = body;
  made.geometry = nullptr;
  made.pose = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}};
  made.sunk = made.friction = 0.0;
  made.points.clear();
  std::fill(made.wrench, made.wrench + 6, 0.0);
  return made;
}

void Contacts::gather(const Layout& layout, const Functions& functions, const Model* model, const Data* data,
                      const std::vector<int>& pieces, const OuterSurface& surface) {
  count = 0;
  std::fill(wrench, wrench + 6, 0.0);
  const int contacts = field<int>(data, layout.data_ncon);
  if (contacts == 0) return;
  const char* contact = field<const char*>(data, layout.data_contact);
  Frame frame = {};
  bool placed = false;
  for (int i = 0; i < contacts; ++i, contact += layout.contact_size) {
    const int* pair = &field<int>(contact, layout.contact_geom);
    const auto is_pad = [&](int one) { return std::find(pieces.begin(), pieces.end(), one) != pieces.end(); };
    const bool second = is_pad(pair[1]);
    if (!second && !is_pad(pair[0])) continue;
    if (!placed) frame = pad_frame(layout, model, data, pieces.front());
    placed = true;
    const int other = second ? pair[0] : pair[1];
    const int body = other < 0 ? -1 : field<const int*>(model, layout.model_geom_bodyid)[other];
    double local[6];
    functions.contact_force(model, data, i, local);
    // MuJoCo gives the first geom's action on the second, in axes that are the rows of the contact's frame.
    const double* axes = &field<double>(contact, layout.contact_frame);
    const double* position = &field<double>(contact, layout.contact_pos);
    double world[3], force[3], moment[3], arm[3], normal[3];
    const double sign = second ? 1.0 : -1.0;
    for (int part = 0; part < 2; ++part) {
      turned_back(axes, local + 3 * part, world);
      for (double& one : world) one *= sign;
      turned_back(frame.rotation, world, part == 0 ? force : moment);
    }
    turned_back(frame.rotation, axes, normal);
    const double offset[3] = {position[0] - frame.origin[0], position[1] - frame.origin[1],
                              position[2] - frame.origin[2]};
    turned_back(frame.rotation, offset, arm);
    moment[0] += arm[1] * force[2] - arm[2] * force[1];
    moment[1] += arm[2] * force[0] - arm[0] * force[2];
    moment[2] += arm[0] * force[1] - arm[1] * force[0];
    if (std::all_of(force, force + 3, [](double one) { return one == 0.0; }) &&
        std::all_of(moment, moment + 3, [](double one) { return one == 0.0; })) {
      continue;  // a contact without force presses nothing
    }
    for (int k = 0; k < 3; ++k) wrench[k] += force[k], wrench[3 + k] += moment[k];
    double out[3];
    normal_at(surface, arm, out);
    const auto along = [&](const double* one) { return out[0] * one[0] + out[1] * one[1] + out[2] * one[2]; };
    const double upright = -sign * along(normal), pressing = -along(force);
    if (upright < kPresses) continue;
    Touch& touch = touch_of(body);
    for (int k = 0; k < 3; ++k) touch.wrench[k] += force[k], touch.wrench[3 + k] += moment[k];
    touch.sunk = std::max(touch.sunk, -field<double>(contact, layout.contact_dist) / upright);
    const double* friction = &field<double>(contact, layout.contact_friction);
    touch.friction = std::max({touch.friction, friction[0], friction[1]});
    if (pressing > 0.0) touch.points.push_back({arm[0], arm[1], pressing});
  }
  std::sort(touches.begin(), touches.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Touch& a, const Touch& b) { return a.body < b.body; });
  for (std::size_t i = 0; i < count; ++i) {
    Touch& touch = touches[i];
    if (touch.body < 0) continue;
    const double* position = field<const double*>(data, layout.data_xpos) + 3 * touch.body;
    const double* rotation = field<const double*>(data, layout.data_xmat) + 9 * touch.body;
    const double offset[3] = {position[0] - frame.origin[0], position[1] - frame.origin[1],
                              position[2] - frame.origin[2]};
    turned_back(frame.rotation, offset, touch.pose.position);
    for (int j = 0; j < 3; ++j) {
      const double column[3] = {rotation[j], rotation[3 + j], rotation[6 + j]};
      double there[3];
      turned_back(frame.rotation, column, there);
      for (int i2 = 0; i2 < 3; ++i2) touch.pose.rotation[3 * i2 + j] = there[i2];
    }
  }
}

}  // namespace mjtactile::mujoco
