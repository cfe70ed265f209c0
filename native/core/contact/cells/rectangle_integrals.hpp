// Integrals over pairs of rectangular contact cells in one plane.
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {

// A rectangle turned by an angle, and what integrals far from it need.
struct CellRectangle {
  CellRectangle(const Point& middle, double cosine, double sine, const double* sides);

  Point middle;
  double cosine, sine, sides[2];
  double area, reach;    // its area, and the distance within which it cannot be represented by its centre
  double xx, xy, yy;     // its second moments over its area [m^2]
};

// Integral of 1/r over a pair that is not far apart [m^3]: in closed form where their sides are parallel or nearly so, else
// point by point of parts of both.
double near_inverse_distance(const CellRectangle& a, const CellRectangle& b);

// Integrals of 1/r over pairs of rectangles with some that are kept.
class FarIntegrals {
 public:
  void fit(const std::vector<CellRectangle>& kept);
  // Of a rectangle with those kept from the first on [m^3]; 0 where the two are near.
  void of(const CellRectangle& own, std::size_t first, double* values) const;

 private:
  std::size_t count_ = 0;
  std::vector<double> rows_;   // seven quantities of all rectangles
};

// Integrals over a pair of y^2/r^3, -x y/r^3, x^2/r^3 [m^3], x/r^2 and y/r^2 [m^2 m], (x, y) from the second to the first,
// as near_inverse_distance() has 1/r. Of one with itself the last two vanish.
struct PairShear {
  double xx, xy, yy, along, across;
};
PairShear near_shear_integrals(const CellRectangle& a, const CellRectangle& b);

// Whether two rectangles are far enough apart to be represented by their centres.
bool are_far(const CellRectangle& a, const CellRectangle& b);

// The integrals of 1/r over equal rectangles by how many columns and rows they lie apart: (rows, columns).
void inverse_distance_by_offset(std::size_t columns, std::size_t rows, double width, double height,
                                std::vector<double>& table);

}  // namespace mjtactile
