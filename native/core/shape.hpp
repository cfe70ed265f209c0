// Rigid shapes and their lower surfaces: how high each stands over the points of a pad, in closed form.
//
// Seen along the pad's normal, the part of a body that can touch is its lowest point over each (x, y).
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "face.hpp"
#include "triangles.hpp"

namespace mjtactile {

constexpr double kNowhere = std::numeric_limits<double>::infinity();

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
  // Place a shape whose body stands at a pose in the pad frame, to be looked at over a part of its surface.
  void place(const Shape& shape, const Pose& body, const Rectangle& part);

  // Height of the lower surface over (x, y) [m]; infinite where there is none, or it is below the floor.
  double height(double x, double y, double floor) const;
  // Its lowest points wherever they are, at most two [m]; of a level shape not all of them.
  std::size_t bottoms(double points[2][3]) const;

 private:
  double entry(double x, double y) const;
  void in_pad(const double* local, double* point) const;

  ShapeKind kind_ = ShapeKind::half_space;
  double size_[3] = {};
  Pose pose_ = {};
  double from_[3] = {};  // the pad's origin in the shape's frame [m]
  TriangleShadow shadow_;
};

// The pose of a shape in the pad frame, from its body's and its own in the body's frame.
Pose composed(const Pose& body, const Pose& local);

}  // namespace mjtactile
