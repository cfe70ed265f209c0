// Geometry of a rigid body: its shapes, and the flat sides on which it can lie on a pad.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "contact/cells/face.hpp"
#include "contact/cells/face_cells.hpp"
#include "geometry/outline.hpp"
#include "geometry/shape.hpp"

namespace mjtactile {

// A flat side of a body.
struct FlatSide : FacePlane {
  bool endless;          // the side of a half space, which is larger than any sheet
  Outline outline;       // in the side's frame [m]
  Rectangle bounds;      // of the outline [m]; of no use for an endless side
  std::vector<std::uint8_t> shapes;    // for each of the body's shapes: whether a part of the side belongs to it
  std::vector<std::size_t> others;     // shapes, not of the side, that extend to its plane or beyond; when looked at
  std::vector<double> rises;           // see Face; when looked at
  bool looked_at = false, usable = false;
  std::shared_ptr<const Face> whole;   // the cells of the whole side; null if it is endless

  const double* up() const { return rotation + 6; }
};

// Criteria by which flat sides are chosen.
struct SideLimits {
  double facing_gap;     // parts of the body up to this height above the first touch face the pad [m]
  bool level;            // whether the body keeps its orientation, so that a side must lie parallel to the pad
  bool leaning;          // whether the body may tilt onto sides that lean far
  CellCount cells;       // contact cells on a side
};

// Whether any of a body's shapes stands out from the pad, by its height above a face, less far than an inclined plane.
// Only what is within a rectangle and not below a floor [m] counts.
bool any_below(const std::vector<double>& rises, const std::vector<Shape>& shapes, const Pose& body,
               const Rectangle& over, double floor, const InclinedPlane& plane);

// Geometry of all geoms of one body. Sides are computed when they are first used.
class BodyGeometry {
 public:
  BodyGeometry(std::vector<Shape> shapes, const SideLimits& limits);

  const std::vector<Shape>& shapes() const { return shapes_; }  // in the body's frame
  std::size_t sides() const { return sides_.size(); }
  // A side; null if the body cannot lie on the whole side, or not on this side alone where no part of `others` is near.
  const FlatSide* side(std::size_t number);
  // A side of which only the place and the outline may be known yet.
  const FlatSide& outlined(std::size_t number) const { return sides_[number]; }

 private:
  bool look_at(FlatSide& side) const;
  void find_onsets(FlatSide& side) const;

  std::vector<Shape> shapes_;
  std::vector<FlatSide> sides_;
  SideLimits limits_;
};

}  // namespace mjtactile
