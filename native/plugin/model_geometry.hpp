// Geometry of the bodies of a model as it is now: models may change while they run.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "contact/body_geometry.hpp"
#include "plugin/mujoco_view.hpp"

namespace mjtactile::mujoco {

// From a position [m] and a unit quaternion (w, x, y, z).
Pose pose_of(const double* position, const double* quaternion);

// What presses of a body: its geoms that collide with the pad. Geoms that show its true shape press in their place
// where their names end in "_tactile".
class ModelGeometry {
 public:
  ModelGeometry(const Layout& layout, const SideLimits& limits) : layout_(&layout), limits_(limits) {}

  // Of a body that touches a pad's geom; made when it is first asked for, and anew when the model has changed. Null
  // where none of its geoms has a surface.
  std::shared_ptr<BodyGeometry> body(const Model* model, int body, int pad_geom);
  // Make those of all bodies that may touch it: meshes take their time, and steps have none.
  void prepare(const Model* model, int pad_geom);

 private:
  struct Geom {
    int number, kind, data;
    double size[3], position[3], orientation[4];
    std::uint64_t heights;   // fingerprint of a height field's data

    bool operator==(const Geom& other) const;
  };
  struct Known {
    std::vector<Geom> geoms;
    std::shared_ptr<BodyGeometry> geometry;
  };
  void choose(const Model* model, int body, int pad_geom);
  Geom describe(const Model* model, int geom) const;
  std::shared_ptr<BodyGeometry> make(const Model* model) const;

  const Layout* layout_;
  SideLimits limits_;
  std::map<int, Known> known_;
  std::vector<Geom> geoms_;   // of the body asked for last
  std::vector<int> shown_;
};

// Names of the kinds of geoms of a body that a pad cannot look at, and of none where it can look at all: found out when
// a model is compiled. What collides without a mesh, such as a signed distance function that has none.
bool can_be_seen(const Layout& layout, const Model* model, int geom);

}  // namespace mjtactile::mujoco
