// The contacts of a pad in one state of a simulation.
#pragma once

#include <vector>

#include "contact/pad_sensor.hpp"
#include "plugin/mujoco_view.hpp"

namespace mjtactile::mujoco {

// The pad frame in the world. For a box, the origin is the middle of the +z face. For a mesh, it is the frame of the
// mesh file, from which MuJoCo moved the vertices to their centre of mass and axes of inertia.
Pose pad_frame(const Model* model, const Data* data, int geom);

// Numbers of the geoms that make up one pad. The first is the pad's own geom. A pad with hollows has further ones,
// named "<name>_piece_1" and so on (mjtactile/sim/pad_geom.py).
std::vector<int> pad_pieces(const Model* model, int geom);

// Whether the model has a flex that may touch a pad but whose contacts MuJoCo does not list: a surface, under flag ipc.
bool has_unlisted_flex(const Model* model, const std::vector<int>& pieces);

// All contacts of a pad's geoms.
class Contacts {
 public:
  // Bodies that press on the sensing surface, by ascending number, with the sums of their contact wrenches. Bodies with
  // no joint between them are links of one rigid body. Number -1 stands for all flexes. Only the first `count` entries
  // belong to this state; memory is kept.
  std::vector<Touch> touches;
  std::size_t count = 0;
  double wrench[6];    // of all contacts [N, N m], pad frame, about its origin
  std::vector<int> behind;   // bodies that press on the pad's back, one for each contact
  bool passive = false;      // whether a flex touches with passive contacts, of which MuJoCo tells no force

  // Gather the contacts of a state. A contact whose normal leans far from that of the outer surface presses on a side
  // of the pad or on its rim from beside. Such contacts, and those that do not press, count in the wrench only. But
  // contacts with walls between the pad's pieces are a part of what the body presses with.
  // Contacts of other geoms of the pad's body are ignored. Overlap and pressing force are measured along the outer
  // surface's normal. `last_hold`: whether the contacts gathered last still hold where neither the pad's body nor the
  // other is awake, and both are where they were. MuJoCo has no contacts between such bodies.
  void gather(const Model* model, const Data* data, const std::vector<int>& pieces, const OuterSurface& surface,
              bool last_hold);
  bool any() const { return count > 0 || !beside_.empty(); }

 private:
  struct Beside {        // a contact that counts in the wrench only
    int body;
    Pose pose;           // of the body in the pad frame
    double wrench[6];
  };
  void set_aside(const Data* data, const Pose& frame);
  void add_aside();
  void add(const double* more);
  Touch& touch_of(const Model* model, int body);

  std::vector<Beside> beside_;
  // Contacts that were set aside while others are gathered. Touches are swapped, so that no step allocates them anew.
  std::vector<Touch> aside_;
  std::size_t aside_count_ = 0;
  std::vector<Beside> beside_aside_;
};

}  // namespace mjtactile::mujoco
