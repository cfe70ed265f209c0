// Rigid shapes and the heights of their lower surfaces over the points of a pad, in closed form.
//
// Over each (x, y), the lowest point of a body is the one that can touch the pad.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "geometry/height_map.hpp"
#include "geometry/pose.hpp"
#include "geometry/triangles.hpp"

namespace mjtactile {

enum class ShapeKind { ellipsoid, capsule, cylinder, box, half_space, triangles };

// A shape of a body. A half space is everything below z = 0 of its own frame.
struct Shape {
  ShapeKind kind;
  double size[3];   // semi-axes, (radius, half length) or half sizes [m], in MuJoCo's order
  Pose local;       // of the shape in its body's frame
  std::shared_ptr<const TriangleMesh> mesh;  // of kind `triangles`; null for others
};

// Heights between which bodies count [m]: lower parts stand beside the pad, and higher parts are out of reach.
struct HeightRange {
  double floor, ceiling;
  double surface;   // highest point of the pad's surface
  double reach;     // of meshes: parts farther than this above the lowest one, or above the surface if that is higher,
                    // may be left out
};

// A shape at a pose over a pad, in the pad frame.
class PlacedShape {
 public:
  // Place a shape whose body has a pose in the pad frame. The functions below are then used over the rectangle `part`,
  // for heights within the range.
  void place(const Shape& shape, const Pose& body, const Rectangle& part, const HeightRange& range);

  // Height of the lower surface over (x, y) [m]; infinite if there is no surface, or if it is below the floor.
  double height(double x, double y, double floor) const;
  // Lower each of the given heights (points) [m] to that of this shape over the same point, if that is less.
  void lower(const std::vector<Point>& points, double floor, double* heights) const;
  // Whether the shape is a box, no part of which is below the floor.
  bool is_box_above(double floor) const { return kind_ == ShapeKind::box && low_[2] >= floor; }
  // Restrict a part of a segment to where a box is no higher than a plane, given its heights at the segment's ends [m].
  void keep_below(const Segment& line, const double (&plane)[2], SegmentPart& part) const;
  // Whether the bounding box is over a part of a rectangle, not just over its rim.
  bool is_over(const Rectangle& part) const {
    return low_[0] < part.east && high_[0] > part.west && low_[1] < part.north && high_[1] > part.south;
  }
  // Lower and upper corner (3) of the bounding box in the pad frame [m]; infinite for a half space.
  const double* low() const { return low_; }
  const double* high() const { return high_; }
  // Whether a mesh has parts below a plane that were left out because they are beyond the range's reach.
  bool left_out_below(const InclinedPlane& plane) {
    return kind_ == ShapeKind::triangles && shadow_.left_out_below(plane);
  }
  // Add points of the lower side that stand lowest, or along which it may touch, whether over the part or not.
  void add_bottoms(std::vector<Point>& points);

 private:
  // A vertical line over (x, y), measured from the centre, meets a convex part in a segment. The segment's middle is
  // slope . (x, y) above the centre. `upright`: the part is vertical, so a line lies wholly inside it or never meets
  // it.
  struct Round {         // half length squared: square - (xx x x + 2 xy x y + yy y y); upright: inside where positive
    double centre[3];    // [m]
    double slope[2], square, xx, xy, yy;
    bool upright;
  };
  struct Slab {          // the half length is `half`, and a line meets the slab where |slope . (x, y)| <= reach
    double slope[2], half, reach;   // half is infinite if upright, reach is if not
    bool is_upright() const { return reach < kNowhere; }
  };
  Round round(const double* scales, int axes, const double* centre) const;
  Slab slab(int axis, double half) const;
  double entry(double x, double y) const;
  static double entry_of_box(const Slab (&slabs)[3], double x, double y, double z);
  void lower_to_box(const std::vector<Point>& points, double floor, double* heights) const;
  void add_lowest_edges(int axis, std::vector<Point>& points) const;
  void add_in_pad(const double* local, std::vector<Point>& points) const;
  void find_box();

  ShapeKind kind_ = ShapeKind::half_space;
  double size_[3] = {};
  Pose pose_ = {};
  Round rounds_[3] = {};   // an ellipsoid; a capsule's ends and the barrel between them; or a cylinder's barrel
  Slab slabs_[3] = {};     // the three of a box; or the one between the ends of a capsule or cylinder
  double low_[3] = {}, high_[3] = {};
  const TriangleMesh* mesh_ = nullptr;
  TriangleShadow shadow_;
  std::vector<std::array<double, 3>> lowest_;
};

// How far a shape other than a mesh reaches from its centre along a unit direction of its own frame [m]; infinite for a
// half space.
double reach_along(ShapeKind kind, const double* size, const double* direction);

// The pose of a shape in the pad frame, from its body's pose there and its own pose in the body's frame.
Pose composed(const Pose& body, const Pose& local);

// The part of a rectangle under a shape's bounding box, or under a half space. It is empty if all of that is below a
// floor [m].
Rectangle part_under(const Shape& shape, const Pose& body, const Rectangle& over, double floor);

}  // namespace mjtactile
