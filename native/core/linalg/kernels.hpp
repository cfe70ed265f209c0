// Loops that take most of the time, once per instruction set; the best one the processor has is taken at
// run time. Results differ between instruction sets by rounding only, and not at all between runs of one.
#pragma once

#include <cstddef>
#include <cstdint>

#include "linalg/half.hpp"

namespace mjtactile {

constexpr std::size_t kFactorRows = 16;  // of a matrix that is factored at once

// What of a grid lies under a level: how many points, and how many edges between a point under it and one that is not,
// or the grid's end, along columns and along rows.
struct UnderLevel {
  std::size_t points, upright, level;
};

// Points in rows that begin `row` apart.
struct PointRows {
  const double *x, *y;
  std::size_t rows, count, row;
};

// A rectangle in a plane: its middle, its second moments over its area, its area, and half of the distance from which
// on a series about the middles stands for a pair of its like.
struct RectangleNumbers {
  double x, y, xx, xy, yy, area, reach;
};

// Those of several, a row for each number.
struct RectangleRows {
  const double *x, *y, *xx, *xy, *yy, *area, *reach;
};

// A row for each quantity of independent springs: stiffness [N/m], the force at which one yields [N], how far each of
// three motions moves the body there [-], and how high the body stands above it [m].
struct SpringRows {
  const double *stiffness, *most, *modes[3], *heights;
};

struct Kernels {
  const char* name;

  // sums[r] += sum_j weights[j] * columns[j][r], r < rows.
  void (*add_byte)(const Byte* const* columns, const float* weights, std::size_t count, std::size_t rows, float* sums);
  void (*add_half)(const Half* const* columns, const float* weights, std::size_t count, std::size_t rows, float* sums);
  void (*add_float)(const float* const* columns, const float* weights, std::size_t count, std::size_t rows,
                    float* sums);
  void (*add_double)(const double* const* columns, const double* weights, std::size_t count, std::size_t rows,
                     double* sums);

  // sums[r] += sum_ij weights[columns i + j] * from[i row + j column + r], r < count, i < rows, j < columns; `anew`: in
  // place of what sums hold.
  void (*add_window)(const double* from, std::size_t rows, std::size_t row, std::size_t columns, std::size_t column,
                     const double* weights, std::size_t count, bool anew, double* sums);

  // c += a b: a(i, k) = a[i * a_row + k * a_column] (rows, depth), b (depth, columns) and c (rows, columns) row by row.
  void (*multiply_add)(const double* a, std::size_t a_row, std::size_t a_column, const double* b, std::size_t b_row,
                       double* c, std::size_t c_row, std::size_t rows, std::size_t columns, std::size_t depth);

  // Of a point and others (count): weight * weights[j] times y^2/r^3, -x y/r^3, x^2/r^3, x/r^2 and y/r^2, (x, y) from
  // the other to it, to the five rows.
  void (*shear_of_point)(double from_x, double from_y, double weight, const double* x, const double* y,
                         const double* weights, std::size_t count, double* const* rows);
  // The sums of these, unweighted, over all pairs of two lists of points, as if none were nearer than the root of
  // `least`.
  void (*sum_shear)(const double* x, const double* y, std::size_t count, const double* to_x, const double* to_y,
                    std::size_t to_count, double least, double* sums);

  double (*dot)(const double* a, const double* b, std::size_t count);

  // One row of a half space's compliance from integrals over pairs of cells: of 1/r, xx, xy, yy, along and across (see
  // ShearIntegrals), turned by an angle, `turn`: its cosine squared, times its sine, sine squared, cosine and sine.
  // `rows`: what comes of xx, xy, xz, yy, yz and zz, times `per_area`; `share` and `slope`: weights of what is not 1/r.
  void (*shear_row)(const double* const* integrals, const double* per_area, const double* turn, double share,
                    double slope, std::size_t count, double* const* rows);

  // A symmetric positive definite matrix of at most kFactorRows rows, of which the upper triangle is read, becomes U of
  // U^T U; false where it is not positive definite.
  bool (*factor_small)(double* upper, std::size_t upper_row, std::size_t size);
  // U^-T c in place of c (kFactorRows, columns), for an upper triangular U of kFactorRows rows.
  void (*eliminate)(const double* upper, std::size_t upper_row, double* c, std::size_t c_row, std::size_t columns);
  // U^-1 x in place of x (size).
  void (*solve_upper)(const double* upper, std::size_t upper_row, std::size_t size, double* x);
  // to(j, i) = from(i, j), both row by row, i < rows and j < columns.
  void (*transpose)(const double* from, std::size_t from_row, std::size_t rows, std::size_t columns, double* to,
                    std::size_t to_row);

  // Heights of points in rows (count, whole eights) that begin `row` apart become that of a triangle over them where it
  // is over them, no less than the floor and less than they are. With s = triangle[0] x + triangle[1] y + triangle[2]
  // and t of the next three likewise, it is over them where s, t and 1 - s - t are no less than `least`, and as high as
  // triangle[6] + triangle[7] s + triangle[8] t.
  void (*lower_by_triangle)(const double* triangle, double least, double floor, const PointRows& points,
                            double* heights);

  // What of heights (rows, columns), 31 columns at most, lies under a level or at it.
  UnderLevel (*count_under)(const double* heights, std::size_t rows, std::size_t columns, double level);

  // What an edge from (start) to (end) [2 each] brings about in a quadratic element from `origin` on with half lengths
  // 1 / per, and to its left: moments (3 forces, powers of eta, powers of xi and one number for what lies left) +=
  // traction times integrals of eta^b (xi^(a + 1) - from[a]) / (a + 1) times the half length along x, and of eta^b,
  // along y.
  void (*add_edge_moments)(const double* start, const double* end, const double* origin, const double* per,
                           const double* from, const double* traction, double* moments);
  // Forces on an element's nodes, three rows of three nodes (3 each) that are `row` apart, += those of moments, of what
  // lies to its right, (3 forces, powers of eta), to which what passes it is added, and of that from its left end to
  // the reference, `part` (3).
  void (*add_element_forces)(const double* moments, double half, const double* part, double* right, std::size_t row,
                             double* forces);
  // to (corners, 3): sums over i from starts[c] to starts[c + 1] of weights[i] times from (nodes, 3) at nodes[i].
  void (*gather_threes)(const double* from, const std::uint32_t* starts, const std::uint32_t* nodes,
                        const double* weights, std::size_t corners, double* to);
  // Forces (nodes, 3) on a row of nodes and on its image, folded about their middle node: for each class c and node x
  // from the middle on, to[c][3 x + k] = allowed[c][3 x + k] * (u(x) + t l(x) + s (u(-x) + t l(-x))), s and t being
  // signs[c][0][k] and signs[c][1][k], without u(-x) and l(-x) for the middle node. largest[c] becomes the largest of
  // those, or stays. One number beyond the last may be written.
  void (*fold_row)(const double* upper, const double* lower, std::size_t middle, const double (*signs)[2][4],
                   const double* const* allowed, double* const* to, double* largest);
  // Of forces (count, whole vectors of 16) those that are neither 0 nor below `least`: their columns, and themselves
  // times `factor`; how many. Places and weights have room for 16 more.
  std::size_t (*keep_float)(const double* forces, const std::uint32_t* columns, std::size_t count, double least,
                            double factor, std::uint32_t* places, float* weights);
  std::size_t (*keep_double)(const double* forces, const std::uint32_t* columns, std::size_t count, double least,
                             double factor, std::uint32_t* places, double* weights);

  // norms[q * points + p] = |sum_c signs[4 q + c] * classes[c][k * points + p]| over k < 5: the von Mises stress of
  // every folded point in every quadrant, from the four symmetry classes.
  void (*norms_float)(const float* const* classes, const float* signs, std::size_t points, float* norms);
  void (*norms_double)(const double* const* classes, const double* signs, std::size_t points, double* norms);

  // 1/r integrated twice along each axis, at (x, y): differences of it are integrals over pairs of rectangles.
  void (*integrate_inverse_distance)(const double* x, const double* y, std::size_t count, double* values);
  // So for y^2/r^3, -x y/r^3, x^2/r^3, x/r^2 and y/r^2, a row of values for each.
  void (*integrate_shear_kernels)(const double* x, const double* y, std::size_t count, double* const* values);

  // numbers[j] *= sqrt(d / (d + h)), with d the square of the distance between `from` (3) and a point (count) along x
  // and y, and h that of their distance along z. Not a number where the two are the same.
  void (*multiply_by_flatness)(const double* from, const double* x, const double* y, const double* z, std::size_t count,
                               double* numbers);

  // Integrals of 1/r over pairs of a rectangle and others (count), by the Taylor series to second order about their
  // middles; 0 where they are too near for it.
  void (*integrate_far)(const RectangleNumbers& own, const RectangleRows& others, std::size_t count, double* values);

  // Depths of springs (count) under a motion (3) of the body above, the forces on them, and how stiff each is then: 0
  // where it does not press and where it yields.
  void (*press_springs)(const SpringRows& springs, const double* motion, std::size_t count, double* depths,
                        double* forces, double* stiffness);

  // Sum of 1 / sqrt(max(square, least)) over squares of distances from each of some points to each of others.
  double (*sum_inverse_distances)(const double* x, const double* y, std::size_t count, const double* to_x,
                                  const double* to_y, std::size_t to_count, double least);
};

// The kernels in use: the best that the processor has, or those asked for with `use_kernels`.
const Kernels& kernels();

// Take the kernels of that name, "plain", "avx2" or "avx512"; false where the processor lacks them.
bool use_kernels(const char* name);

}  // namespace mjtactile
