// A curved pad's surface seen along its normal at one of its points: the plane in which a contact there is solved.
//
// Coordinates (u, v) run along the plane and w out of the pad, from the point. U is the tangent above the pad's x axis.
#pragma once

#include <vector>

#include "geometry/outer_surface.hpp"
#include "geometry/pose.hpp"

namespace mjtactile {

// The surface over a point of the plane.
struct SeenSurface {
  double height;      // w [m]
  double slopes[2];   // of w along u and v [-]
  double x, y;        // where that is on the pad [m]
};

// What a piece of the surface covers as the plane sees it.
struct SeenPiece {
  Rectangle bounds;         // of (u, v) [m]
  double lowest, highest;   // w [m]
};

class TangentPlane {
 public:
  // Touch a surface above a point of the pad's plane.
  void touch(const OuterSurface& surface, const Point& foot);

  // The surface over (u, v); false where it is not seen from the plane, or is not the pad's.
  bool look(double u, double v, SeenSurface& seen) const;
  // The surface's height over many points [m], infinite where look() says no.
  void heights(const std::vector<Point>& points, std::vector<double>& to) const;
  // The same beyond the pad's edge as well; where nothing is seen the plane itself stands in.
  SeenSurface beyond(double u, double v) const;
  // The surface above a rectangle of the pad's plane, with a small margin, and all of the pad's.
  SeenPiece piece(const Rectangle& above) const;
  const SeenPiece& whole() const { return whole_; }
  const OuterSurface& surface() const { return *surface_; }

  // Between the pad frame and this one: points, vectors, poses and wrenches, those about the origin of each frame.
  void into(const double* point, double* here) const;
  void out_of(const double* here, double* point) const;
  void turn_into(const double* vector, double* here) const;
  void turn_out_of(const double* here, double* vector) const;
  Pose into(const Pose& pose) const;
  void wrench_into(const double* wrench, double* here) const;
  void wrench_out_of(const double* here, double* wrench) const;
  // Where the plane lies: rows are the axes U, V and N.
  const double* axes() const { return axes_; }
  const double* origin() const { return origin_; }

 private:
  // A quadric by its form with pairs of the axes (U U, V V, N N, U V, U N, V N), and of N with the way from its middle.
  struct Quadric {
    struct Meeting {
      double w, root;   // height of the upper of the line's two meetings with it [m]; half the root of what they solve
      bool seen;
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
  double bends_[3] = {};                  // of a patch: w is about bends u u, u v and v v there
  double size_ = 0.0;                     // of the sheet [m]
  SeenPiece whole_ = {};
};

// Where a wrench (6), about the pad's origin, presses on a surface: the point about which it turns along the surface's
// normal alone, seen on the pad's plane, or the nearest that the pad has. False where the force does not go in.
bool centre_of_pressure(const OuterSurface& surface, const double* wrench, Point& centre);

}  // namespace mjtactile
