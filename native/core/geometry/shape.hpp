// Rigid shapes and their lower surfaces: how high each stands over the points of a pad, in closed form.
//
// Seen along the pad's normal, the part of a body that can touch is its lowest point over each (x, y).
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "geometry/height_map.hpp"
#include "geometry/pose.hpp"
#include "geometry/triangles.hpp"

namespace mjtactile {

enum class ShapeKind { ellipsoid, capsule, cylinder, box, half_space, triangles };

// A shape in its body's frame. `size`: semi-axes, (radius, half length) or half sizes [m], as MuJoCo has them; a half
// space is all that lies below z = 0 of its frame.
struct Shape {
  ShapeKind kind;
  double size[3];
  Pose local;
  std::shared_ptr<const TriangleMesh> mesh;  // of triangles
};

// A shape over a pad.
class PlacedShape {
 public:
  // Place a shape whose body stands at a pose in the pad frame, to be looked at over a part of its surface, from a floor
  // up to a ceiling [m].
  void place(const Shape& shape, const Pose& body, const Rectangle& part, double floor, double ceiling);

  // Height of the lower surface over (x, y) [m]; infinite where there is none, or it is below the floor.
  double height(double x, double y, double floor) const;
  // The same over many points: `heights` become no higher than that.
  void lower(const std::vector<Point>& points, double floor, double* heights) const;
  // The box about it, in the pad frame [m]; infinite where the shape is.
  const double* low() const { return low_; }
  const double* high() const { return high_; }
  // Height of its lowest point, over the part or not [m]; infinitely low for a half space.
  double bottom() const { return kind_ == ShapeKind::triangles ? shadow_.bottom()[2] : low_[2]; }
  // Points of its lower side that stand lowest, or along which it may touch, whether over the part or not.
  void add_bottoms(std::vector<Point>& points);

 private:
  // Along upright lines over (x, y) from the centre, a convex part lies between a middle that is linear in them, less and
  // plus half a length; `upright`: the line never leaves it, or never meets it.
  struct Round {         // half the length squared is `square` - (xx, xy, yy) (x, y) (x, y); where upright over 0
    double centre[3];    // [m]
    double slope[2], square, xx, xy, yy;
    bool upright;
  };
  struct Slab {          // half the length is `reach`; where upright, slope (x, y) lies within it
    double slope[2], reach;
    bool upright;
  };
  Round round(const double* scales, int axes, const double* centre) const;
  Slab slab(int axis, double half) const;
  double entry(double x, double y) const;
  void add_in_pad(const double* local, std::vector<Point>& points) const;
  void find_box();

  ShapeKind kind_ = ShapeKind::half_space;
  double size_[3] = {};
  Pose pose_ = {};
  Round rounds_[3] = {};   // an ellipsoid; or a capsule's ends and the barrel between them, or a cylinder's barrel
  Slab slabs_[3] = {};     // of a box; or that between a capsule's or a cylinder's ends
  double low_[3] = {}, high_[3] = {};
  const TriangleMesh* mesh_ = nullptr;
  TriangleShadow shadow_;
  std::vector<std::array<double, 3>> lowest_;
};

// The pose of a shape in the pad frame, from its body's and its own in the body's frame.
Pose composed(const Pose& body, const Pose& local);

}  // namespace mjtactile
