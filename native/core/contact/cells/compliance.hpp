// Compliance of the surface between contact cells: a half space in closed form plus the sheet's smooth remainder.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "contact/cells/tangential.hpp"
#include "geometry/pose.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

// Quadratic B-splines along one axis. They are continuously differentiable, and three of them are not zero on each
// piece.
class QuadraticSplines {
 public:
  static constexpr std::size_t kOver = 3;

  // `ends`: boundaries of the pieces, ascending [m]. The outermost pieces extend beyond the first and the last
  // boundary.
  explicit QuadraticSplines(std::vector<double> ends);

  std::size_t count() const { return ends_.size() + 1; }
  double shortest() const { return shortest_; }   // length of the shortest piece [m]
  // The number of the first spline that is not zero at a place, and the values of the three.
  std::size_t at(double place, double* values) const;

 private:
  std::vector<double> ends_;
  struct Piece {
    // Its ends, and the factors of the squared distances to the high and to the low end.
    double low, high, falling, rising;
  };
  std::vector<Piece> pieces_;
  double pieces_per_length_ = 0.0;  // mean [1/m]
  double shortest_ = HUGE_VAL;
};

// How cells of a tangent plane lie on a curved surface. Forces and displacements are measured along the plane's normal.
// `positions`: in the pad frame (cells, 3) [m]. `stretches`: distance along the plane's normal over the distance along
// a cell's own normal (cells) [-]. `u`, `v`, `w`: coordinates in the plane, and height above it (cells) [m].
struct Bend {
  const double *positions, *stretches;
  const double *u, *v, *w;

  // Multiply entries [first, last) of a cell's row of integrals of 1/r by the distance of the two cells in the plane
  // over their distance in space.
  void scale_to_surface_distances(std::size_t cell, std::size_t first, std::size_t last, double* row) const;
};

// What the compliance needs of contact cells. `bend`: how they lie on a curved surface; none on a flat one.
struct SurfaceCells {
  std::size_t count;
  const double* points;             // (cells, per_cell, 2) [m]; the remainder is averaged over the points of a cell
  std::size_t per_cell;
  const double* areas;              // [m^2]
  const double* inverse_distance;   // integrals of 1/r over pairs of cells [m^3], (cells, cells); null where unknown
  std::optional<Bend> bend;
};

// Normal compliance of one pad's surface between any contact cells.
class SurfaceCompliance {
 public:
  SurfaceCompliance() = default;
  // `factor`: of the half space [1/Pa]. `remainder`: compliance of the sheet minus that of the half space, as
  // coefficients [m/N] of products of splines, x fastest. Rows are the splines at the displacement, columns those at
  // the force.
  SurfaceCompliance(double factor, QuadraticSplines x, QuadraticSplines y, Matrix remainder);

  // Springs of law "foundation": logarithms of contact areas [m^2], ascending, and of the stiffness per area under each
  // [Pa/m].
  void set_foundation(std::vector<double> areas, std::vector<double> stiffnesses);
  double foundation_stiffness(double area) const;

  // Additional data for shear: Poisson's ratio of the half space, and the remainder of all three components,
  // (component, spline) by (component, spline) [m/N]. Set once, before any thread asks for `full`.
  void set_tangential(double poisson, Matrix remainder);

  double factor() const { return factor_; }
  // Length over which the remainder may change [m].
  double resolution() const { return std::min(x_.shortest(), y_.shortest()); }
  std::size_t splines() const { return x_.count() * y_.count(); }

  // The splines that are not zero at a cell: `columns` along x and `rows` along y, from `column` and `row` on. `first`:
  // index of their values in Workspace::values, which are row-major.
  struct Window {
    std::size_t column, row, columns, rows, first;
  };
  // The splines that are not zero at a point: the first along each axis, and their values.
  struct Place {
    std::size_t first[2];
    double along[QuadraticSplines::kOver], across[QuadraticSplines::kOver];
  };
  struct Workspace {
    std::vector<Window> windows;
    std::vector<Place> places;
    std::vector<double> values, coefficients, smooth, inverse_areas;
    std::vector<std::size_t> nonzero;  // first and last spline of each cell's range
    Matrix through, transposed;        // the remainder times the splines of each cell, and its transpose
  };

  // Mean normal displacement of each cell per normal force on each cell [m/N].
  void normal(const SurfaceCells& cells, Workspace& workspace, Matrix& compliance) const;

  // Add the displacement [m] of cells, one point each, under normal forces [N] on other cells to `sunk`. Forces act at
  // points, except at a cell's own point, where the mean over a square is used.
  void add_sinking(const SurfaceCells& cells, const SurfaceCells& pressed, const double* forces, Workspace& workspace,
                   double* sunk) const;

  // Cells, the integrals over pairs of them in their own frame, and their placement.
  struct ShearedCells {
    SurfaceCells cells;
    const ShearIntegrals* integrals;
    Placement placement;
  };
  // Set the rows of the normal displacement in a matrix of the mean displacement of each cell per force on each cell,
  // (component, cell) by (component, cell) [m/N], pad frame, z out of the pad. `normal`: the cells' normal compliance.
  void set_normal_rows(const ShearedCells& sheared, const Matrix& normal, Workspace& workspace,
                       Matrix& compliance) const;
  // Set the rows of the tangential displacement, after those of the normal one and with the same workspace.
  void set_tangential_rows(const ShearedCells& sheared, Workspace& workspace, Matrix& compliance) const;

 private:
  const double* per_areas(const SurfaceCells& cells, std::size_t cell, Workspace& workspace) const;
  // Compute the inverse areas of the cells and the mean values of the splines over each.
  void prepare(const SurfaceCells& cells, Workspace& workspace) const;
  // Add the remainder between the cells of the last prepare() to `block`. `upper`: only on and above the
  // diagonal. `remainder`: first entry of its coefficients.
  void add_remainder(const double* remainder, std::size_t stride, bool upper, Workspace& workspace, double* block,
                     std::size_t block_stride) const;

  double factor_ = 0.0;
  QuadraticSplines x_{{}}, y_{{}};
  Matrix remainder_, full_remainder_;
  double poisson_ = 0.0;
  std::vector<double> areas_, stiffnesses_;  // logarithms
};

// Compliance of contact cells in all directions, (component, cell) by (component, cell) [m/N], both triangles. Most of
// it is computed only when it is asked for, because contacts that slide as a whole need the rows of the normal
// displacement only.
class FullCompliance {
 public:
  // Of other cells. What is given must stay until all is computed or the next call. `normal`: their normal compliance;
  // null if it is not known.
  void begin(const SurfaceCompliance& surface, const SurfaceCompliance::ShearedCells& sheared, const Matrix* normal,
             SurfaceCompliance::Workspace& workspace);
  // The matrix, for the caller to fill.
  Matrix& given(std::size_t cells);

  // Normal displacement of a cell under forces in all directions (component, cell).
  const double* normal_row(std::size_t cell) const { return matrix_[2 * (matrix_.rows() / 3) + cell]; }
  const Matrix& whole();

 private:
  Matrix matrix_, normal_;
  const SurfaceCompliance* surface_ = nullptr;   // null if the matrix is complete
  SurfaceCompliance::ShearedCells sheared_ = {};
  SurfaceCompliance::Workspace* workspace_ = nullptr;
};

}  // namespace mjtactile
