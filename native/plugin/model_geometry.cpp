#include "plugin/model_geometry.hpp"

#include <algorithm>
#include <iterator>
#include <mutex>
#include <string_view>
#include <unordered_map>

#include "geometry/flat_facets.hpp"
#include "geometry/hash.hpp"

namespace mjtactile::mujoco {
namespace {

// Geoms whose names have this ending press instead of those that collide.
constexpr std::string_view kShown = "_tactile";

// Number of vertices and of faces of a mesh that are compared at every step.
constexpr std::size_t kSampled = 16;

// A mesh with its flat facets. Pads of this process share it, as long as some body uses it.
template <typename Make>
std::shared_ptr<const TriangleMesh> shared_mesh(std::uint64_t key, double facing_gap, Make&& make) {
  static std::mutex mutex;
  static auto* const known = new std::unordered_map<std::uint64_t, std::weak_ptr<const TriangleMesh>>;
  const std::lock_guard<std::mutex> lock(mutex);
  // Which facets are flat depends on the gap, too.
  auto& place = (*known)[mixed(key, &facing_gap, sizeof facing_gap)];
  std::shared_ptr<const TriangleMesh> found = place.lock();
  if (found == nullptr) {
    auto made = std::make_shared<TriangleMesh>(make());
    made->facets = flat_facets(*made, facing_gap);
    place = found = std::move(made);
    // Meshes that no body uses any more: a height field that changes at every step leaves one each time.
    for (auto at = known->begin(); at != known->end();) at = at->second.expired() ? known->erase(at) : std::next(at);
  }
  return found;
}

// A height field of a model.
struct HeightField {
  std::size_t rows, columns;
  const double* size;   // (4), see make_height_field
  const float* data;

  HeightField(const Model* model, int number)
      : rows(static_cast<std::size_t>(ints(model, layout.model_hfield_nrow)[number])),
        columns(static_cast<std::size_t>(ints(model, layout.model_hfield_ncol)[number])),
        size(doubles(model, layout.model_hfield_size) + 4 * number),
        data(field<const float*>(model, layout.model_hfield_data) + ints(model, layout.model_hfield_adr)[number]) {}
};

// A mesh of the model, see make_mesh.
struct Mesh {
  std::size_t vertices, count;
  const float* vertex;
  const int* face;

  Mesh(const Model* model, int number)
      : vertices(static_cast<std::size_t>(ints(model, layout.model_mesh_vertnum)[number])),
        count(static_cast<std::size_t>(ints(model, layout.model_mesh_facenum)[number])),
        vertex(field<const float*>(model, layout.model_mesh_vert) +
               std::ptrdiff_t{3} * ints(model, layout.model_mesh_vertadr)[number]),
        face(ints(model, layout.model_mesh_face) +
             std::ptrdiff_t{3} * ints(model, layout.model_mesh_faceadr)[number]) {}

  // Fingerprint of where the mesh is in memory, its size, and some of its vertices and faces.
  std::uint64_t sample() const {
    std::uint64_t made = mixed(mixed(3, &vertex, sizeof vertex), &face, sizeof face);
    made = mixed(mixed(made, vertices), count);
    for (std::size_t i = 0; i < kSampled; ++i) {
      if (vertices > 0) made = mixed(made, vertex + 3 * (i * (vertices - 1) / (kSampled - 1)), 3 * sizeof(float));
      if (count > 0) made = mixed(made, face + 3 * (i * (count - 1) / (kSampled - 1)), 3 * sizeof(int));
    }
    return made;
  }
};

// Position [m] and unit quaternion of something.
struct Placed {
  double position[3] = {0.0, 0.0, 0.0}, orientation[4] = {1.0, 0.0, 0.0, 0.0};

  Placed() = default;
  Placed(const double* at, const double* turn) {
    std::copy(at, at + 3, position);
    std::copy(turn, turn + 4, orientation);
  }
};

// Where something in the frame of `outer` is in the frame that `outer` is in.
Placed seen_from(const Placed& outer, const Placed& inner) {
  const double *a = outer.orientation, *b = inner.orientation;
  const Pose turn = pose_of(outer.position, a);
  Placed seen;
  for (int i = 0; i < 3; ++i) {
    seen.position[i] = outer.position[i];
    for (int k = 0; k < 3; ++k) seen.position[i] += turn.rotation[3 * i + k] * inner.position[k];
  }
  seen.orientation[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
  seen.orientation[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
  seen.orientation[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
  seen.orientation[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
  return seen;
}

// Where a body is in the frame of the one to which both are welded.
Placed on_root(const Model* model, int body) {
  const int root = rigid_root(model, body);
  Placed placed;
  for (; body != root; body = ints(model, layout.model_body_parentid)[body]) {
    placed = seen_from({doubles(model, layout.model_body_pos) + 3 * body,
                        doubles(model, layout.model_body_quat) + 4 * body}, placed);
  }
  return placed;
}

// Where a body is in the frame of another that is welded to it.
Placed between(const Model* model, int first, int body) {
  const Placed base = on_root(model, first);
  Placed back;
  for (int i = 1; i < 4; ++i) back.orientation[i] = -base.orientation[i];
  back.orientation[0] = base.orientation[0];
  const Pose turn = pose_of(base.position, back.orientation);
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) back.position[i] -= turn.rotation[3 * i + k] * base.position[k];
  }
  return seen_from(back, on_root(model, body));
}

// Whether MuJoCo's filters keep all geoms of two bodies from colliding, explicit pairs aside: the bodies are welded,
// one is welded to the other's parent, or the model excludes the pair (computation, "Collision detection", in MuJoCo's
// documentation).
bool are_kept_apart(const Model* model, int one, int other) {
  const int *weld = ints(model, layout.model_body_weldid), first = weld[one], second = weld[other];
  if (first == second) return true;
  const int* parent = ints(model, layout.model_body_parentid);
  const void* option = &field<char>(model, layout.model_opt);
  const bool filters = (field<int>(option, layout.option_disableflags) & layout.disable_filterparent) == 0;
  if (filters && first != 0 && second != 0 && (first == weld[parent[second]] || second == weld[parent[first]])) {
    return true;
  }
  const int signature = (std::min(one, other) << 16) + std::max(one, other);
  const int* excluded = ints(model, layout.model_exclude_signature);
  const int* const end = excluded + field<int>(model, layout.model_nexclude);
  return std::find(excluded, end, signature) != end;
}

// Whether a name ends in "_tactile". Digits and separators that follow do not count, as <replicate> numbers its copies.
bool is_shown(std::string_view name) {
  const std::size_t last = name.find_last_not_of("0123456789_.-");
  const std::string_view stem = name.substr(0, last == std::string_view::npos ? 0 : last + 1);
  return stem.size() >= kShown.size() && stem.substr(stem.size() - kShown.size()) == kShown;
}

}  // namespace

int rigid_root(const Model* model, int body) {
  const int root = ints(model, layout.model_body_weldid)[body];
  const int* mocap = ints(model, layout.model_body_mocapid);
  while (body != root && mocap[body] < 0) body = ints(model, layout.model_body_parentid)[body];
  return body;
}

Pose pose_of(const double* position, const double* quaternion) {
  const double w = quaternion[0], x = quaternion[1], y = quaternion[2], z = quaternion[3];
  Pose pose;
  std::copy(position, position + 3, pose.position);
  const double rotation[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                              2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                              2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
  std::copy(rotation, rotation + 9, pose.rotation);
  return pose;
}

bool ModelGeometry::Geom::operator==(const Geom& other) const {
  return number == other.number && kind == other.kind && data == other.data && contents == other.contents &&
         std::equal(size, size + 3, other.size) && std::equal(position, position + 3, other.position) &&
         std::equal(orientation, orientation + 4, other.orientation);
}

bool may_collide(const Model* model, int one, int other) {
  const int* contype = ints(model, layout.model_geom_contype);
  const int* conaffinity = ints(model, layout.model_geom_conaffinity);
  const int* body = ints(model, layout.model_geom_bodyid);
  if (((contype[one] & conaffinity[other]) != 0 || (contype[other] & conaffinity[one]) != 0) &&
      !are_kept_apart(model, body[one], body[other])) {
    return true;
  }
  const int* first = ints(model, layout.model_pair_geom1);
  const int* second = ints(model, layout.model_pair_geom2);
  for (int i = 0; i < field<int>(model, layout.model_npair); ++i) {
    if ((first[i] == one && second[i] == other) || (first[i] == other && second[i] == one)) return true;
  }
  return false;
}

bool can_be_seen(const Model* model, int geom) {
  const int kind = ints(model, layout.model_geom_type)[geom];
  const int data = ints(model, layout.model_geom_dataid)[geom];
  if (kind == kMesh || kind == kSdf) return data >= 0 && ints(model, layout.model_mesh_facenum)[data] > 0;
  return kind >= kPlane && kind <= kSdf;
}

std::shared_ptr<BodyGeometry> ModelGeometry::body(const Model* model, const std::vector<int>& links, int pad_geom) {
  geoms_.clear();
  for (const int link : links) choose(model, link, links.front(), pad_geom);
  Known& known = known_[links];
  if (known.geometry == nullptr || !(known.geoms == geoms_)) {
    known.geoms = geoms_;
    known.geometry = geoms_.empty() ? nullptr : make(model);
  }
  return known.geometry;
}

void ModelGeometry::prepare(const Model* model, int pad_geom) {
  const int own = ints(model, layout.model_geom_bodyid)[pad_geom];
  for (int k = 0; k < field<int>(model, layout.model_nbody); ++k) {
    if (k != own) body(model, {k}, pad_geom);
  }
}

void ModelGeometry::choose(const Model* model, int link, int first, int pad_geom) {
  const int from = ints(model, layout.model_body_geomadr)[link];
  const int count = ints(model, layout.model_body_geomnum)[link];
  const char* names = field<const char*>(model, layout.model_names);
  const int* name = ints(model, layout.model_name_geomadr);
  const std::size_t before = geoms_.size();
  const auto seen = [&](int geom) { return geom != pad_geom && can_be_seen(model, geom); };
  const auto shown = [&](int geom) { return seen(geom) && is_shown(names + name[geom]); };
  bool any_shown = false;
  for (int geom = from; geom < from + count; ++geom) any_shown = any_shown || shown(geom);
  for (int geom = from; geom < from + count; ++geom) {
    const bool presses = any_shown ? shown(geom) : seen(geom) && may_collide(model, geom, pad_geom);
    if (presses) geoms_.push_back(describe(model, geom));
  }
  if (link == first) return;
  const Placed there = between(model, first, link);
  for (std::size_t i = before; i < geoms_.size(); ++i) {
    const Placed here = seen_from(there, {geoms_[i].position, geoms_[i].orientation});
    std::copy(here.position, here.position + 3, geoms_[i].position);
    std::copy(here.orientation, here.orientation + 4, geoms_[i].orientation);
  }
}

ModelGeometry::Geom ModelGeometry::describe(const Model* model, int geom) {
  Geom made = {};
  made.number = geom;
  made.kind = ints(model, layout.model_geom_type)[geom];
  made.data = ints(model, layout.model_geom_dataid)[geom];
  const bool sized = made.kind != kMesh && made.kind != kSdf && made.kind != kHeightField && made.kind != kPlane;
  const double* size = doubles(model, layout.model_geom_size) + 3 * geom;
  if (sized) std::copy(size, size + 3, made.size);
  const double* position = doubles(model, layout.model_geom_pos) + 3 * geom;
  const double* orientation = doubles(model, layout.model_geom_quat) + 4 * geom;
  std::copy(position, position + 3, made.position);
  std::copy(orientation, orientation + 4, made.orientation);
  if (made.kind == kHeightField) {
    const HeightField of(model, made.data);
    made.contents = mixed(mixed(1, of.data, sizeof(float) * of.rows * of.columns), of.size, 4 * sizeof(double));
  } else if (made.kind == kMesh || made.kind == kSdf) {
    const Mesh of(model, made.data);
    Fingerprint& known = meshes_[made.data];
    const std::uint64_t sample = of.sample();
    if (known.model != model || known.sample != sample) {
      known = {model, sample,
               mixed(mixed(2, of.vertex, 3 * sizeof(float) * of.vertices), of.face, 3 * sizeof(int) * of.count)};
    }
    made.contents = known.contents;
  }
  return made;
}

std::shared_ptr<BodyGeometry> ModelGeometry::make(const Model* model) const {
  std::vector<Shape> shapes;
  for (const Geom& geom : geoms_) {
    Shape shape = {ShapeKind::half_space, {geom.size[0], geom.size[1], geom.size[2]},
                   pose_of(geom.position, geom.orientation), nullptr};
    switch (geom.kind) {
      case kSphere:
        shape.kind = ShapeKind::ellipsoid;
        shape.size[1] = shape.size[2] = shape.size[0];
        break;
      case kEllipsoid: shape.kind = ShapeKind::ellipsoid; break;
      case kCapsule: shape.kind = ShapeKind::capsule; break;
      case kCylinder: shape.kind = ShapeKind::cylinder; break;
      case kBox: shape.kind = ShapeKind::box; break;
      case kHeightField: {
        const HeightField of(model, geom.data);
        shape.mesh = shared_mesh(mixed(mixed(geom.contents, of.rows), of.columns), limits_.facing_gap,
                                 [&] { return make_height_field(of.rows, of.columns, of.size, of.data); });
        break;
      }
      case kMesh:
      case kSdf: {
        const Mesh of(model, geom.data);
        shape.mesh = shared_mesh(geom.contents, limits_.facing_gap,
                                 [&] { return make_mesh(of.vertex, of.vertices, of.face, of.count); });
        break;
      }
      default: break;
    }
    if (shape.mesh != nullptr) shape.kind = ShapeKind::triangles;
    shapes.push_back(std::move(shape));
  }
  return std::make_shared<BodyGeometry>(std::move(shapes), limits_);
}

}  // namespace mjtactile::mujoco
