// A rigid body over a pad's sheet: how high its lower surface stands over each point.
#pragma once

#include <cstddef>
#include <vector>

#include "lattice.hpp"
#include "shape.hpp"

namespace mjtactile {

// What presses of a body: its geoms' shapes, in the body's frame. Immutable, shared.
struct RigidBody {
  std::vector<Shape> shapes;
};

// How far bodies are looked at.
struct GapLimits {
  double depth;       // of the pad: what is lower than its underside does not face it, nor what is as high above [m]
  double reach;       // what is further above the first touch cannot come into contact [m]
  double facing_gap;  // what is lower than the rest by more, in a sliver of half of it at the rim, is beside the pad [m]
};

// One body at one pose; its memory is kept from pose to pose.
class GapMap {
 public:
  // False where nothing of the body is over the sheet within reach.
  bool place(const RigidBody& body, const Pose& pose, const Rectangle& sheet, const GapLimits& limits);

  // Height over the plane of first touch at (x, y) [m]; infinite out of reach and off the sheet.
  double height(double x, double y) const;
  // What the body covers within reach, roughly.
  const Region& covered() const { return covered_; }
  // The shapes' lowest points over the sheet.
  const std::vector<Point>& bottoms() const { return bottoms_; }
  const Rectangle& sheet() const { return sheet_; }

 private:
  double lowest_of_shapes(double x, double y) const;
  void look();
  Point grid_point(int column, int row) const;
  double lowest_over(const Rectangle& part) const;
  void find_covered();
  bool bound(int axis, bool greatest, double& bound) const;

  std::size_t count_ = 0;
  std::vector<PlacedShape> shapes_;
  Rectangle sheet_ = {};
  GapLimits limits_ = {};
  double floor_ = 0.0, touch_ = 0.0;
  Region covered_ = {};
  std::vector<double> grid_;   // heights on a grid over the sheet, by row [m]
  std::vector<Point> bottoms_;
};

}  // namespace mjtactile
