// The loops that take most of the time, compiled once per instruction set. The best set that the processor has is
// chosen at run time. Results of different sets differ by rounding only. Results of one set are the same bits in every
// run.
#pragma once

#include <cstddef>
#include <cstdint>

#include "linalg/half.hpp"

namespace mjtactile {

constexpr std::size_t kFactorRows = 16;  // rows of a matrix that are factored at once

// Grid points at or below a level: their number, and the numbers of edges between such a point and another one or the
// grid's end, along x (within a row) and along y (within a column).
struct PointsBelow {
  std::size_t points, edges_x, edges_y;
};

// Points in rows. Rows begin `row` numbers apart.
struct PointRows {
  const double *x, *y;
  std::size_t rows, count, row;
};

constexpr std::size_t kTriangles = 8;  // triangles in a block

// Up to kTriangles triangles, with an array for each quantity. Those that do not count have a height that is not a
// number.
struct alignas(64) TriangleBlock {
  // Barycentric coordinates of the second and third corner at (x, y): rates along x and y [1/m], and value at 0.
  double second[3][kTriangles], third[3][kTriangles];
  // Height of the first corner, and of the others above it [m].
  double height[kTriangles], second_rise[kTriangles], third_rise[kTriangles];

  TriangleBlock() {}  // not set to 0: place_triangles() sets everything

  // Make one triangle that of another block.
  void copy(std::size_t k, const TriangleBlock& from, std::size_t other) {
    for (std::size_t i = 0; i < 3; ++i) second[i][k] = from.second[i][other], third[i][k] = from.third[i][other];
    height[k] = from.height[other];
    second_rise[k] = from.second_rise[other], third_rise[k] = from.third_rise[other];
  }
};

// Bounds of the triangles of a block along x and y, and their least heights [m]. Of those that do not count, the lower
// bounds are infinite and the upper ones negatively so.
struct TriangleBounds {
  double west[kTriangles], east[kTriangles], south[kTriangles], north[kTriangles], low[kTriangles];

  TriangleBounds() {}  // likewise
};

// Which triangles count: those over a rectangle, not wholly below a floor nor above a ceiling, and neither vertical nor
// facing up.
struct TriangleWindow {
  double west, east, south, north, floor, ceiling;   // [m]
  double steepest;   // largest cosine between the normals of vertical triangles and the vertical
  double upward;     // largest upward component of normals [m^2]: 0, or infinite if triangles may face up
};

// A rectangle in a plane: its middle, its second moments over its area, and its area. The series about the middles is
// accurate for two rectangles if their distance is above the sum of their `near_radius`.
struct RectangleNumbers {
  double x, y, xx, xy, yy, area, near_radius;
};

// The same for several rectangles, with an array for each quantity.
struct RectangleRows {
  const double *x, *y, *xx, *xy, *yy, *area, *near_radius;
};

// Independent springs, with an array for each quantity: stiffness [N/m], force at which a spring yields [N],
// displacement of the body above it per unit of each of three motions [-], and height of the body above it [m].
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

  // sums[r] += sum_ij weights[columns i + j] * from[i row + j column + r], r < count, i < rows, j < columns. With
  // `anew`, the sums start from zero.
  void (*add_window)(const double* from, std::size_t rows, std::size_t row, std::size_t columns, std::size_t column,
                     const double* weights, std::size_t count, bool anew, double* sums);

  // c += a b, with a(i, k) = a[i * a_row + k * a_column] (rows, depth). The matrices b (depth, columns) and c (rows,
  // columns) are row-major.
  void (*multiply_add)(const double* a, std::size_t a_row, std::size_t a_column, const double* b, std::size_t b_row,
                       double* c, std::size_t c_row, std::size_t rows, std::size_t columns, std::size_t depth);

  // Kernels of shear between one point and others (count): weight * weights[j] times y^2/r^3, -x y/r^3, x^2/r^3, x/r^2
  // and y/r^2, one row for each. (x, y) points from the other point to the one point.
  void (*shear_of_point)(double from_x, double from_y, double weight, const double* x, const double* y,
                         const double* weights, std::size_t count, double* const* rows);
  // Sums of these kernels, unweighted, over all pairs of two lists of points. Squared distances below `least` are
  // replaced by it.
  void (*sum_shear)(const double* x, const double* y, std::size_t count, const double* to_x, const double* to_y,
                    std::size_t to_count, double least, double* sums);

  double (*dot)(const double* a, const double* b, std::size_t count);

  // One row of a half space's compliance along the surface from integrals over pairs of cells: of 1/r, xx, xy and yy
  // (see ShearIntegrals). `turn`: cosine and sine of the cells' rotation. `rows`: components xx, xy and yy, times
  // `per_area`. `share`: weight of the integrals other than that of 1/r.
  void (*tangential_row)(const double* const* integrals, const double* per_area, const double* turn, double share,
                         std::size_t count, double* const* rows);

  // Cholesky factor: replace the upper triangle of a symmetric matrix of at most kFactorRows rows by U of U^T U. False
  // if the matrix is not positive definite.
  bool (*factor_small)(double* upper, std::size_t upper_row, std::size_t size);
  // Replace c (kFactorRows, columns) by U^-T c, for an upper triangular U of kFactorRows rows.
  void (*eliminate)(const double* upper, std::size_t upper_row, double* c, std::size_t c_row, std::size_t columns);
  // Replace x (size) by U^-1 x.
  void (*solve_upper)(const double* upper, std::size_t upper_row, std::size_t size, double* x);
  // to(j, i) = from(i, j), i < rows, j < columns. Both matrices are row-major.
  void (*transpose)(const double* from, std::size_t from_row, std::size_t rows, std::size_t columns, double* to,
                    std::size_t to_row);

  // Lower the heights of points to those of a block's triangle number k. There are `count` points per row, a multiple
  // of eight, and rows begin `row` apart. The triangle is over a point if its three barycentric coordinates there are
  // not below `least`. Its height counts if it is not below the floor.
  void (*lower_by_triangle)(const TriangleBlock& block, std::size_t k, double least, double floor,
                            const PointRows& points, double* heights);
  // Set a block to triangles whose corners are given in a frame of their own: the coordinate along axis i of corner c
  // of triangle k is corners[(3 c + i) kTriangles + k]. All kTriangles corners must be numbers; triangles from number
  // `count` on do not count. `rotation` (9) and `position` (3): of the frame.
  void (*place_triangles)(const double* corners, std::size_t count, const double* rotation, const double* position,
                          const TriangleWindow& window, TriangleBlock& block, TriangleBounds& bounds);
  // The least of a height and those of a block's triangles over (x, y), in the sense of lower_by_triangle.
  double (*lowest_of_triangles)(const TriangleBlock& block, double x, double y, double least, double floor,
                                double height);

  // Count the heights (rows, columns), at most 31 columns, that are at or below a level.
  PointsBelow (*count_below)(const double* heights, std::size_t rows, std::size_t columns, double level);

  // Add to `moments` the contribution of an edge's traction in a quadratic element. `start`, `end` (2): of the edge;
  // `origin` (2): the element's lower corner; `per` (2): 1 over the element's half lengths. Moments are (3 forces,
  // powers of eta, 4): for powers a of xi the integral along y of eta^b (xi^(a + 1) - from[a]) / (a + 1) times the half
  // length along x, and last the integral of eta^b, for the elements on the left.
  void (*add_edge_moments)(const double* start, const double* end, const double* origin, const double* per,
                           const double* from, const double* traction, double* moments);
  // Add the forces on an element's nodes, three rows of three nodes (3 each) that are `row` apart. They follow from its
  // own moments and from those of the edges on its right, `right` (3 forces, powers of eta), to which the element's own
  // last moments are then added. `part` (3): integrals of the powers of xi from its left end to the reference.
  void (*add_element_forces)(const double* moments, double half, const double* part, double* right, std::size_t row,
                             double* forces);
  // to (corners, 3): for each corner c, the sum of weights[i] times from (nodes, 3) at nodes[i], starts[c] <= i <
  // starts[c + 1].
  void (*sum_weighted_vectors)(const double* from, const std::uint32_t* starts, const std::uint32_t* nodes,
                               const double* weights, std::size_t corners, double* to);
  // Symmetry classes of the forces (nodes, 3) on a row of nodes, u, and on its mirror image, l. For each class c and
  // node x from the middle on, to[c][3 x + k] = allowed[c][3 x + k] * (u(x) + t l(x) + s (u(-x) + t l(-x))). The signs
  // s and t are signs[c][0][k] and signs[c][1][k]. At the middle node, u(-x) and l(-x) are left out. largest[c] is
  // raised to the largest of their sizes. One number beyond the last may be written.
  void (*fold_row)(const double* upper, const double* lower, std::size_t middle, const double (*signs)[2][4],
                   const double* const* allowed, double* const* to, double* largest);
  // Select those forces (count, a multiple of 16) that are neither 0 nor below `least` in size. Writes their columns to
  // `places` and the forces times `factor` to `weights`, and returns their number. Both have room for 16 more.
  std::size_t (*select_float)(const double* forces, const std::uint32_t* columns, std::size_t count, double least,
                              double factor, std::uint32_t* places, float* weights);
  std::size_t (*select_double)(const double* forces, const std::uint32_t* columns, std::size_t count, double least,
                               double factor, std::uint32_t* places, double* weights);

  // norms[q * points + p] = |sum_c signs[4 q + c] * classes[c][k * points + p]|, the norm over k < 5. It is the von
  // Mises stress of each sample point p of the quarter at its mirror image q, from the four symmetry classes.
  void (*norms_float)(const float* const* classes, const float* signs, std::size_t points, float* norms);
  void (*norms_double)(const double* const* classes, const double* signs, std::size_t points, double* norms);

  // 1/r integrated twice along each axis, at points (x, y). Second differences of it are integrals over pairs of
  // rectangles.
  void (*integrate_inverse_distance)(const double* x, const double* y, std::size_t count, double* values);
  // The same for y^2/r^3, -x y/r^3, x^2/r^3, x/r^2 and y/r^2, with a row of values for each.
  void (*integrate_shear_kernels)(const double* x, const double* y, std::size_t count, double* const* values);

  // numbers[j] *= sqrt(d / (d + h)): the distance along the plane over the distance in space between `from` (3) and a
  // point (count). d is the square of the distance along x and y, h that along z. Not a number if d and h are zero.
  void (*scale_to_surface_distances)(const double* from, const double* x, const double* y, const double* z,
                                     std::size_t count, double* numbers);

  // Integrals of 1/r over pairs of one rectangle and others (count), by a Taylor series of second order about their
  // middles. 0 if the two are too near for it.
  void (*integrate_far)(const RectangleNumbers& own, const RectangleRows& others, std::size_t count, double* values);

  // Depths of springs (count) under a motion (3) of the body above, the forces on them, and their present stiffness. It
  // is 0 if the spring is not pressed or yields.
  void (*press_springs)(const SpringRows& springs, const double* motion, std::size_t count, double* depths,
                        double* forces, double* stiffness);

  // Sum of 1 / sqrt(max(square, least)) over all pairs of two lists of points, with the squares of their distances.
  double (*sum_inverse_distances)(const double* x, const double* y, std::size_t count, const double* to_x,
                                  const double* to_y, std::size_t to_count, double least);
};

// The kernels in use: the best set that the processor has, unless use_kernels() chose another.
const Kernels& kernels();

// Use the set of kernels with this name: "plain", "avx2" or "avx512". False if the processor lacks its instructions.
bool use_kernels(const char* name);

}  // namespace mjtactile
