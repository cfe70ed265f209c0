// Integrals of 1/r over pairs of rectangles with parallel sides, in closed form.
#pragma once

#include <cstddef>
#include <vector>

namespace mjtactile {

// Integrals of 1/r over two rectangles with parallel sides a and b (along x, along y) [m], their middles (x, y) apart.
double inverse_distance(double x, double y, const double* a, const double* b);
// The same for equal ones that lie whole columns and rows apart, (rows, columns) [m^3].
void inverse_distance_by_offset(std::size_t columns, std::size_t rows, double width, double height,
                                std::vector<double>& table);

}  // namespace mjtactile
