// Shear on the pressed cells of a sliding contact, and the largest wrench that friction carries.
//
// Friction bounds the shear force t on each cell, |t| <= mu F. The resultant forces and torsions under these bounds
// form a convex set, whose extent in any direction is known in closed form (Goyal, Ruina, Papadopoulos, Wear 143, 1991:
// the limit surface). So the nearest wrench in the set is a convex problem of three unknowns, which Newton's method
// solves. If the body turns about a cell, the extent has a kink, which is rounded off.
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {

// The pressed cells that carry shear. Shear forces are (2, cells), x and y [N]. Resultants are (3): force x, force y
// and the torsion about the centre of pressure divided by the length [N].
class ShearGrip {
 public:
  // Take `count` cells: the entries `places` of `points` [m] and `normal`, their normal forces [N], all positive.
  void hold(const Point* points, const double* normal, const std::size_t* places, std::size_t count, double length);

  std::size_t count() const { return x_.size(); }
  double pressing() const { return pressing_; }                // sum of the normal forces [N]
  double normal(std::size_t i) const { return normal_[i]; }    // [N]
  // Position of a cell relative to the centre of pressure, divided by the length [-].
  double x(std::size_t i) const { return x_[i]; }
  double y(std::size_t i) const { return y_[i]; }

  // Resultants of a force (x, y) [N] and a torsion about the pad's origin [N m].
  void about_centre(const double* force, double torsion, double* resultants) const;
  // Resultants of shear forces.
  void resultants(const double* shear, double* resultants) const;

  // Shear with the wanted resultants that is proportional to the normal forces, plus a rotation about their centre.
  void proportional(const double* wanted, double* shear) const;
  // Shear of sliding cells under the wrench nearest to the wanted one that friction carries. False if friction carries
  // the wanted wrench itself; `shear` is then undefined.
  bool nearest(const double* wanted, double friction, double* shear) const;
  // Shear with the wanted resultants, which are within the limit. On every cell it is the same fraction of what
  // friction bears; returns this fraction. `direction`: motion (x, y, rotation times the length) that belongs to the
  // shear.
  double sliding_with(const double* wanted, double friction, double* shear, double* direction) const;

 private:
  // Work of friction, for a coefficient of 1, when the body moves along a direction. Its gradient `slope` are the
  // resultants of sliding; `curvature` may be null.
  double work(const double* direction, double rounding, double* slope, double* curvature) const;
  bool descend(double* place, const double (*axes)[3], std::size_t unknowns, const double* origin, double rounding,
               const double* pull) const;
  // The motion that friction resists least, among those on which the wanted wrench does unit work.
  void least_resisted(const double* unit, double* direction) const;
  void slide(const double* direction, double rounding, double friction, double* shear) const;

  std::vector<double> x_, y_, normal_;
  double pressing_ = 0.0, length_ = 1.0;
  Point centre_ = {0.0, 0.0};
};

}  // namespace mjtactile
