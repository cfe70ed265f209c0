// MuJoCo's structures by field offset.
//
// The sizes of mjModel, mjData and mjContact change from version to version, so nothing here includes MuJoCo's headers
// or links its library: Python computes the offsets of the running MuJoCo from its own description of itself
// (mujoco.introspect), checks them, and hands them over together with the functions. One binary serves all versions.
#pragma once

#include <cstdint>

namespace mjtactile::mujoco {

// Kinds of geoms, the same in all versions (mjtGeom).
enum GeomKind {
  kPlane = 0, kHeightField = 1, kSphere = 2, kCapsule = 3, kEllipsoid = 4, kCylinder = 5, kBox = 6, kMesh = 7, kSdf = 8
};
// Why a contact has no force among those of the constraints: its flex computes it itself (mjContact.exclude).
constexpr int kPassive = 4;
// State of a body that moves (mjtSleepState). Others are asleep or belong to the world.
constexpr int kAwake = 1;

struct Model;   // mjModel
struct Data;    // mjData
struct Option;  // mjvOption
struct Scene;   // mjvScene

// Offsets of fields [bytes], filled by Python in this order (mjtactile/plugin/mujoco_layout.py). Sizes are read as int.
// If a version has wider ones, their first bytes are the same on a little-endian machine.
struct Layout {
  std::int64_t model_opt, model_nsensor, model_nbody, model_npair, model_nexclude, model_body_parentid,
      model_body_weldid, model_body_mocapid, model_body_pos, model_body_quat, model_geom_type, model_geom_bodyid,
      model_geom_contype, model_geom_conaffinity, model_geom_dataid, model_geom_size, model_geom_pos, model_geom_quat,
      model_body_geomnum, model_body_geomadr, model_mesh_vertadr, model_mesh_vertnum, model_mesh_faceadr,
      model_mesh_facenum, model_mesh_vert, model_mesh_face, model_mesh_pos, model_mesh_quat, model_hfield_nrow,
      model_hfield_ncol, model_hfield_adr, model_hfield_size, model_hfield_data, model_pair_geom1, model_pair_geom2,
      model_exclude_signature, model_names, model_name_geomadr, model_sensor_plugin, model_sensor_objtype,
      model_sensor_objid, model_sensor_adr, model_sensor_dim, model_nplugin, model_plugin_stateadr, model_nflex,
      model_flex_dim, model_flex_contype, model_flex_conaffinity;
  std::int64_t option_disableflags, option_enableflags;
  std::int64_t data_ncon, data_contact, data_xpos, data_xmat, data_geom_xpos, data_geom_xmat, data_sensordata,
      data_plugin_state;
  std::int64_t contact_size, contact_dist, contact_pos, contact_frame, contact_friction, contact_geom, contact_exclude;
  std::int64_t scene_ngeom, scene_maxgeom, scene_geoms;
  std::int64_t drawn_size, drawn_objid, drawn_category, drawn_segid;  // of mjvGeom
  std::int64_t data_body_awake;       // -1 if this MuJoCo has no sleeping bodies
  std::int64_t model_sensor_history;  // -1 if its sensors keep no history of readings
  std::int64_t object_geom, geom_box, stage_acc, capability_sensor, disable_filterparent, category_decor,
      enable_ipc;  // constants; the last is 0 if this MuJoCo has no such flag
};

// A task on a thread of a simulation's pool: about(...), number of the thread, number of the task.
using Task = void (*)(const Model*, Data*, void*, int, int);

// Functions of the running MuJoCo. The last two are null where it has no such function.
struct Functions {
  void (*contact_force)(const Model*, const Data*, int, double*);
  const char* (*plugin_config)(const Model*, int, const char*);
  void (*warning)(const char*, ...);
  int (*register_plugin)(const void*);
  void (*init_geom)(void*, int, const double*, const double*, const double*, const float*);
  void (*dispatch)(const Model*, Data*, Task, void*, int);   // run tasks on the threads of a simulation's pool
  int (*thread_count)(const Data*);                          // of the pool and the caller; 1 without a pool
};

// The MuJoCo that runs, as Python described it when it registered the plugin.
inline Layout layout = {};
inline Functions functions = {};

template <typename Field>
const Field& field(const void* structure, std::int64_t offset) {
  return *reinterpret_cast<const Field*>(static_cast<const char*>(structure) + offset);
}
template <typename Field>
Field& field(void* structure, std::int64_t offset) {
  return *reinterpret_cast<Field*>(static_cast<char*>(structure) + offset);
}

// Arrays to which fields point.
inline const int* ints(const void* structure, std::int64_t offset) { return field<const int*>(structure, offset); }
inline const double* doubles(const void* structure, std::int64_t offset) {
  return field<const double*>(structure, offset);
}

// mjpPlugin, the same in all versions from 3.0 on: checked by size and order in tests/plugin/test_plugin_layout.py.
struct Plugin {
  const char* name;
  int nattribute;
  const char* const* attributes;
  int capabilityflags;
  int needstage;
  int (*nstate)(const Model*, int);
  int (*nsensordata)(const Model*, int, int);
  int (*init)(const Model*, Data*, int);
  void (*destroy)(Data*, int);
  void (*copy)(Data*, const Model*, const Data*, int);
  void (*reset)(const Model*, double*, void*, int);
  void (*compute)(const Model*, Data*, int, int);
  void (*advance)(const Model*, Data*, int);
  void (*visualize)(const Model*, Data*, const Option*, Scene*, int);
  void (*actuator_act_dot)(const Model*, Data*, int);
  double (*sdf_distance)(const double*, const Data*, int);
  void (*sdf_gradient)(double*, const double*, const Data*, int);
  double (*sdf_staticdistance)(const double*, const double*);
  void (*sdf_attribute)(double*, const char**, const char**);
  void (*sdf_aabb)(double*, const double*);
};

}  // namespace mjtactile::mujoco
