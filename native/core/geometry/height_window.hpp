// The heights of a body that count for a contact, as an inclined plane sees them.
#pragma once

#include "geometry/height_map.hpp"

namespace mjtactile {

// The heights of a body up to `highest`, measured from an inclined plane.
struct HeightWindow {
  const HeightMap* map;
  double slopes[2];         // of the plane along x and y [-]
  Point middle;             // where the plane is at height 0
  double lowest, highest;   // origin of the measured heights, and their limit above it [m]

  // A height over a point, as measured from the plane [m].
  double measured(const Point& at, double height) const {
    return height - slopes[0] * (at.x - middle.x) - slopes[1] * (at.y - middle.y) - lowest;
  }
  // The height that was measured as this one [m].
  double unmeasured(const Point& at, double height) const {
    return height + lowest + slopes[0] * (at.x - middle.x) + slopes[1] * (at.y - middle.y);
  }
  // The measured height of the body over a point [m]; infinite where there is none.
  double height(const Point& at) const { return measured(at, map->height(at.x, at.y)); }
};

}  // namespace mjtactile
