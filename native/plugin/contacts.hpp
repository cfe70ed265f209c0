// What touches a pad in one state of a simulation.
#pragma once

#include <vector>

#include "mujoco_view.hpp"
#include "pad_sensor.hpp"

namespace mjtactile::mujoco {

// The pad frame in the world: the middle of the +z face of its box geom; columns of `rotation` are its axes.
struct Frame {
  double origin[3], rotation[9];
};

Frame pad_frame(const Layout& layout, const Model* model, const Data* data, int geom);

// Bodies that press on a pad's geom, by ascending number, with the sum of their contact wrenches; -1 stands for flexes,
// which are no geoms. Contacts of other geoms of the pad's body are none of the pad's.
void gather(const Layout& layout, const Functions& functions, const Model* model, const Data* data, int geom,
            std::vector<Touch>& touches);

}  // namespace mjtactile::mujoco
