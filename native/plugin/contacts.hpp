// What touches a pad in one state of a simulation.
#pragma once

#include <vector>

#include "contact/pad_sensor.hpp"
#include "plugin/mujoco_view.hpp"

namespace mjtactile::mujoco {

// The pad frame in the world; columns of `rotation` are its axes. Of a box it is the middle of its +z face; of a mesh
// the frame that its vertices are written in, from which MuJoCo moved them to their centre of mass and axes of inertia.
struct Frame {
  double origin[3], rotation[9];
};

Frame pad_frame(const Layout& layout, const Model* model, const Data* data, int geom);

// Geoms that are one pad: its own, and behind it those of a pad with hollows, "<name>_piece_1" and so on
// (mjtactile/sim/pad_geom.py). Never empty.
std::vector<int> pad_pieces(const Layout& layout, const Model* model, int geom);

// All contacts of a pad's geoms.
struct Contacts {
  // Bodies that press on the sensing surface, by ascending number, with the sum of their contact wrenches; -1 stands
  // for flexes, which are no geoms. Memory is kept: the first `count` are of this state.
  std::vector<Touch> touches;
  std::size_t count = 0;
  double wrench[6];    // of all contacts [N, N m], pad frame, about its origin

  // Read off a state. Contacts that press on the pad's sides or on its rim from beside, or that do not press, are in
  // the wrench alone: those whose normals lean far from that of the outer surface where they are. Contacts of other
  // geoms of the pad's body are none of the pad's. How deep a body is sunk and how hard it presses at a point is along
  // the outer surface's normal there.
  void gather(const Layout& layout, const Functions& functions, const Model* model, const Data* data,
              const std::vector<int>& pieces, const OuterSurface& surface);

 private:
  Touch& touch_of(int body);
};

}  // namespace mjtactile::mujoco
