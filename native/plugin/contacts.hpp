// What touches a pad in one state of a simulation.
#pragma once

#include <vector>

#include "contact/pad_sensor.hpp"
#include "plugin/mujoco_view.hpp"

namespace mjtactile::mujoco {

// The pad frame in the world: the middle of the +z face of its box geom; columns of `rotation` are its axes.
struct Frame {
  double origin[3], rotation[9];
};

Frame pad_frame(const Layout& layout, const Model* model, const Data* data, int geom);

// All contacts of a pad's geom.
struct Contacts {
  // Bodies that press on the sensing surface, by ascending number, with the sum of their contact wrenches; -1 stands for
  // flexes, which are no geoms. Memory is kept: the first `count` are of this state.
  std::vector<Touch> touches;
  std::size_t count = 0;
  double wrench[6];    // of all contacts [N, N m], pad frame, about its origin

  // Read off a state. Contacts that press on the pad's sides or on its rim from beside, or that do not press, are in
  // the wrench alone. Contacts of other geoms of the pad's body are none of the pad's.
  void gather(const Layout& layout, const Functions& functions, const Model* model, const Data* data, int geom,
              const OuterSurface& outer);

 private:
  Touch& touch_of(int body);
};

}  // namespace mjtactile::mujoco
