// A tangent plane of a curved pad's surface, in which a contact around its point is solved.
//
// The plane's frame has its origin at the point where it touches. Coordinates u and v run along the plane, w out of the
// pad. The axes are those of the pad frame, turned the shortest way from z to w.
#pragma once

#include <vector>

#include "geometry/outer_surface.hpp"
#include "geometry/pose.hpp"

namespace mjtactile {

// The surface over a point (u, v) of the plane.
struct SeenSurface {
  double height;      // w [m]
  double slopes[2];   // of w along u and v [-]
  double x, y;        // the same point in the pad frame [m]
};

// Bounds of a piece of the surface in the plane's frame.
struct SeenPiece {
  Rectangle bounds;         // of (u, v) [m]
  double lowest, highest;   // w [m]
};

class TangentPlane {
 public:
  // Make the plane touch a surface above a point (x, y) of the pad's plane [m].
  void touch(const OuterSurface& surface, const Point& foot);

  // The surface over (u, v). False if the normal there does not meet it, or meets it beyond the pad's edge.
  bool look(double u, double v, SeenSurface& seen) const;
  // The surface's height over many points [m]; infinite where look() is false.
  void heights(const std::vector<Point>& points, std::vector<double>& to) const;
  // The same as look(), beyond the pad's edge as well. The plane itself replaces the surface where the normal does not
  // meet it.
  SeenSurface beyond(double u, double v) const;
  // The point of the surface there, along x and y in the pad frame [m].
  Point on_pad(const Point& at) const {
    const SeenSurface seen = beyond(at.x, at.y);
    return {seen.x, seen.y};
  }
  // Bounds of the surface above a rectangle of the pad's plane, with a small margin.
  SeenPiece piece(const Rectangle& above) const;
  // Bounds of the pad's whole surface.
  const SeenPiece& whole() const { return whole_; }
  const OuterSurface& surface() const { return *surface_; }

  // Transform points, vectors, poses and wrenches between the pad frame and the plane's frame. Wrenches are about the
  // origin of the frame that they are in.
  void into(const double* point, double* here) const;
  void out_of(const double* here, double* point) const;
  void turn_into(const double* vector, double* here) const;
  void turn_out_of(const double* here, double* vector) const;
  Pose into(const Pose& pose) const;
  void wrench_into(const double* wrench, double* here) const;
  void wrench_out_of(const double* here, double* wrench) const;
  // Axes u, v and w as the rows of a matrix (3, 3), and origin (3) [m], in the pad frame.
  const double* axes() const { return axes_; }
  const double* origin() const { return origin_; }

 private:
  // A quadric in the plane's frame: its quadratic form on pairs of axes (uu, vv, ww, uv, uw, vw), and on the w axis
  // with the vector from the quadric's middle to the plane's origin.
  struct Quadric {
    struct Meeting {
      double w, root;   // height of the upper intersection [m]; square root of the quadratic equation's discriminant
      bool seen;        // whether there is one, and the surface is not too steep there
    };
    double forms[6] = {}, middle = 0.0;

    Meeting meet(double u, double v) const;
  };
  bool meets(double u, double v, SeenSurface& seen) const;
  bool look_at_quadric(double u, double v, SeenSurface& seen) const;
  bool look_at_patch(double u, double v, SeenSurface& seen) const;
  void find_bends();

  const OuterSurface* surface_ = nullptr;
  double origin_[3] = {}, axes_[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  Quadric quadric_;
  double bends_[3] = {};                  // of a patch: w is close to these times (u u, u v, v v) [1/m]
  double size_ = 0.0;                     // size of the sheet [m]
  SeenPiece whole_ = {};
};

// The centre of pressure of a wrench (6), about the pad's origin [N, N m], on a surface, projected to the pad's plane
// [m]. It is the point of the surface about which the wrench's moment is along the surface's normal. If that is beyond
// the pad's edge, it is the nearest point of the pad. False if the force does not press.
bool centre_of_pressure(const OuterSurface& surface, const double* wrench, Point& centre);
// The same on the flat pad's plane, whether over the pad or beside it.
inline Point centre_of_pressure(const double* wrench) { return {-wrench[4] / wrench[2], wrench[3] / wrench[2]}; }

}  // namespace mjtactile
