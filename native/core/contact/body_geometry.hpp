// Geometry of a rigid body: its shapes, and the flat sides on which it can lie.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "contact/cells/face.hpp"
#include "contact/cells/face_cells.hpp"
#include "geometry/flat_facets.hpp"
#include "geometry/shape.hpp"

namespace mjtactile {

// A flat side, in a frame of its own whose z axis is the pad's when the body lies on it.
struct FlatSide {
  double rotation[9];    // from the body's frame to the side's, row-major
  double height;         // of the side in that frame [m]
  bool endless;          // a half space: larger than any sheet
  Outline outline;       // in that frame [m]
  std::vector<std::uint8_t> shapes;    // whether each of the body's shapes has a part in it
  bool looked_at = false, usable = false;
  double most_slope = 0.0;             // beyond this the body no longer faces the pad with this side alone [-]
  double tips_at = std::numeric_limits<double>::infinity();  // slope from which on other sides may touch as well [-]
  std::shared_ptr<const Face> whole;   // its cells; null where it is endless

  const double* up() const { return rotation + 6; }
};

// Criteria for flat sides.
struct SideLimits {
  double facing_gap;     // what is no further than this above the first touch faces the pad [m]
  bool level;            // whether the body keeps its orientation: a side must lie parallel to the pad
  bool leaning;          // whether the body tilts onto sides that lean far
  std::size_t cells;     // of a side
};

// Geometry of all geoms of one body; sides are computed at their first use.
class BodyGeometry {
 public:
  // `facets`: of each shape's mesh, null for other shapes.
  BodyGeometry(std::vector<Shape> shapes, const std::vector<const std::vector<Facet>*>& facets,
               const SideLimits& limits);

  const std::vector<Shape>& shapes() const { return shapes_; }  // in the body's frame
  std::size_t sides() const { return sides_.size(); }
  // A side; null where the body cannot lie on all of it, or not on it alone.
  const FlatSide* side(std::size_t number);
  const double* up(std::size_t number) const { return sides_[number].up(); }

 private:
  bool look_at(FlatSide& side) const;

  std::vector<Shape> shapes_;
  std::vector<FlatSide> sides_;
  SideLimits limits_;
};

}  // namespace mjtactile
