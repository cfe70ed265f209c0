// Geometry of the bodies of a MuJoCo model. It follows changes of the model between steps.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "contact/body_geometry.hpp"
#include "plugin/mujoco_view.hpp"

namespace mjtactile::mujoco {

// The pose with a position [m] and a unit quaternion (w, x, y, z).
Pose pose_of(const double* position, const double* quaternion);

// The first body of the rigid body to which a body belongs: there is no joint between them. Before version 4 MuJoCo
// welds mocap bodies to the world, though they move on their own.
int rigid_root(const Model* model, int body);

// Geometry of the geoms of a rigid body that press on the pad. It consists of one body or of several that are welded to
// one another, its links. If the names of some geoms of a link end in "_tactile", or in that and a number, these press.
// Otherwise its geoms that collide with the pad press.
class ModelGeometry {
 public:
  explicit ModelGeometry(const SideLimits& limits) : limits_(limits) {}

  // Geometry of links that touch a pad's geom, in the frame of the first. It is made at the first call, and again if
  // their geoms have changed. Null if no geom can press.
  std::shared_ptr<BodyGeometry> body(const Model* model, const std::vector<int>& links, int pad_geom);
  // Make the geometry of all bodies of a model in advance, because meshes take more time than a step has.
  void prepare(const Model* model, int pad_geom);

 private:
  struct Geom {
    int number, kind, data;
    double size[3], position[3], orientation[4];
    std::uint64_t contents;   // fingerprint of a mesh or of a height field's data

    bool operator==(const Geom& other) const;
  };
  struct Known {                  // geometry of some links, and the geoms it was made from
    std::vector<Geom> geoms;
    std::shared_ptr<BodyGeometry> geometry;
  };
  // Add a link's pressing geoms to geoms_. `first`: the link in whose frame they are described.
  void choose(const Model* model, int link, int first, int pad_geom);
  Geom describe(const Model* model, int geom);
  std::shared_ptr<BodyGeometry> make(const Model* model) const;

  SideLimits limits_;
  std::map<std::vector<int>, Known> known_;
  std::vector<Geom> geoms_;   // the pressing geoms of the last body
  // Fingerprint of a mesh of the model that was read last: a simulation may be stepped with several. A model that is
  // made after another was freed may have the same address, and its arrays, too, so a sample of the mesh tells it.
  struct Fingerprint {
    const Model* model = nullptr;
    std::uint64_t sample = 0, contents = 0;
  };
  std::map<int, Fingerprint> meshes_;   // by number
};

// Whether two geoms may collide: by their bits, unless their bodies are kept apart, or as an explicit pair.
bool may_collide(const Model* model, int one, int other);

// Whether a geom has a shape that the pad can use. It has none if it collides without a mesh, such as a signed distance
// function without one.
bool can_be_seen(const Model* model, int geom);

}  // namespace mjtactile::mujoco
