// Pressed cells that carry shear: how it spreads over them in sliding, and which wrench friction bears at most.
//
// Friction bounds each cell, |t| <= mu F. The forces and torsions that obey this form a convex set whose extent in any
// direction is known in closed form, so the nearest wrench within it is a convex problem of three unknowns (Goyal,
// Ruina, Papadopoulos, Wear 143, 1991: the limit surface). Newton's method solves it; a cell that the body turns about
// makes the extent a cone, which is rounded off.
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {

// Shear forces are in two blocks of cells, x and y [N]; resultants are force x, force y and torsion about the centre of
// pressure over the length [N].
class ShearGrip {
 public:
  // Hold on to `count` cells with their places among `points` [m] and `normal` forces [N], all positive.
  void hold(const Point* points, const double* normal, const std::size_t* places, std::size_t count, double length);

  std::size_t count() const { return x_.size(); }
  double pressing() const { return pressing_; }                // sum of the normal forces [N]
  double normal(std::size_t i) const { return normal_[i]; }    // [N]
  // Place of a cell about the centre of pressure, over the length.
  double x(std::size_t i) const { return x_[i]; }
  double y(std::size_t i) const { return y_[i]; }

  // Resultants of a force [N] and a torsion about the pad's origin [N m].
  void about_centre(const double* force, double torsion, double* resultants) const;
  void resultants(const double* shear, double* resultants) const;

  // Everywhere in proportion to the pressure, plus a turn about its centre.
  void proportional(const double* wanted, double* shear) const;
  // Shear of all cells sliding at the nearest wrench that friction can carry; false, and no shear, where that is the
  // wanted one itself.
  bool nearest(const double* wanted, double friction, double* shear) const;
  // Shear with these resultants, everywhere in the same proportion to what friction bears, which is returned; `wanted`
  // is within the limit. `direction`: of the motion it belongs to, (x, y, turn times the length).
  double sliding_with(const double* wanted, double friction, double* shear, double* direction) const;

 private:
  // Work of friction per unit of the limit when the body moves along a direction, the sliding resultants, which are its
  // slope, and its curvature where asked for.
  double work(const double* direction, double rounding, double* slope, double* curvature) const;
  bool descend(double* place, const double (*axes)[3], std::size_t unknowns, const double* origin, double rounding,
               const double* pull) const;
  // Of the motions that do unit work on the wanted wrench, the one that friction resists least.
  void least_resisted(const double* unit, double* direction) const;
  void slide(const double* direction, double rounding, double friction, double* shear) const;

  std::vector<double> x_, y_, normal_;
  double pressing_ = 0.0, length_ = 1.0;
  Point centre_ = {0.0, 0.0};
};

}  // namespace mjtactile
