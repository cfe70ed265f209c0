// Integrals over pairs of rectangular contact cells in one plane.
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/polygon.hpp"
#include "linalg/kernels.hpp"

namespace mjtactile {

// A rectangle turned by an angle, with its moments for integrals with distant rectangles.
struct CellRectangle : RectangleNumbers {
  // `cosine`, `sine`: of the angle; `sides` (2): lengths along and across it [m].
  CellRectangle(const Point& middle, double cosine, double sine, const double* sides);

  double cosine, sine, sides[2];
};

// Integral of 1/r over a pair of rectangles that are not far apart [m^3]. It is in closed form if their sides are
// parallel or nearly so. Otherwise it is a sum over points of both.
double near_inverse_distance(const CellRectangle& a, const CellRectangle& b);

// Integrals of 1/r over one rectangle and each of many others that are far from it.
class FarIntegrals {
 public:
  // Copy the other rectangles.
  void fit(const std::vector<CellRectangle>& kept);
  // Integrals over `own` and each of the others from number `first` on [m^3]; 0 if the two are near.
  void of(const CellRectangle& own, std::size_t first, double* values) const;

 private:
  std::size_t count_ = 0;
  std::vector<double> rows_;   // (7, rectangles): middle, second moments, area and near radius
};

// Integrals of the kernels of shear over a pair: y^2/r^3, -x y/r^3, x^2/r^3, x/r^2 and y/r^2 [m^3]. (x, y) points from
// the second rectangle to the first. The last two vanish for a rectangle with itself.
struct PairShear {
  double xx, xy, yy, along, across;
};
// The same method as near_inverse_distance().
PairShear near_shear_integrals(const CellRectangle& a, const CellRectangle& b);

// Whether two rectangles are so far apart that a series about their middles is accurate.
bool are_far(const CellRectangle& a, const CellRectangle& b);

// Integrals of 1/r over two rectangles of one lattice (rows, columns) [m^3], by the number of rows and columns between
// them. `width`, `height`: of a rectangle [m].
void inverse_distance_by_offset(std::size_t columns, std::size_t rows, double width, double height,
                                std::vector<double>& table);

}  // namespace mjtactile
