// What a pad is told of a body that presses on it.
#pragma once

#include <memory>
#include <vector>

#include "contact/body_geometry.hpp"
#include "contact/cells/face.hpp"
#include "contact/point_press.hpp"
#include "geometry/height_map.hpp"
#include "geometry/pose.hpp"

namespace mjtactile {

// A body that presses on the pad.
struct Touch {
  int body;
  std::vector<int> links;  // bodies that are welded to one another and touch, ascending; the first is `body`
  std::shared_ptr<BodyGeometry> geometry;  // null where the geometry is not known
  Pose pose;            // of the body in the pad frame
  double wrench[6];     // on the pad, about the pad's origin, pad frame [N, N m]
  double friction;      // largest sliding friction coefficient of its contacts [-]
  double sunk;          // deepest overlap of body and pad where the body presses [m]; infinite if that is not known
  std::vector<ContactPoint> points;
  // The side that faces the pad, if the caller gives it in place of the geometry: a flat face with its placement, or
  // the heights of the body.
  std::shared_ptr<const Face> face;
  Placement placement = kUnmoved;
  const HeightMap* map = nullptr;

  double pressing() const { return -wrench[2]; }   // force that presses [N]
};

}  // namespace mjtactile
