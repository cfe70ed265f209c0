// Compliance of the surface between contact cells: a half space in closed form plus the sheet's smooth remainder.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "contact/cells/tangential.hpp"
#include "geometry/pose.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

// Quadratic B-splines along one axis: smooth where pieces meet, three of them over each piece.
class QuadraticSplines {
 public:
  static constexpr std::size_t kOver = 3;

  // `ends`: of the pieces, ascending [m]. Beyond the first and the last the outermost pieces go on.
  explicit QuadraticSplines(std::vector<double> ends);

  std::size_t count() const { return ends_.size() + 1; }
  // The first of the splines that are not zero at a place, and their values.
  std::size_t at(double place, double* values) const;

 private:
  std::vector<double> ends_;
  struct Piece {
    double low, high, falling, rising;  // what squares of the distance to its ends are multiplied by
  };
  std::vector<Piece> pieces_;
  double per_ = 0.0;  // pieces per length, on the average [1/m]
};

// Cells on a curved surface: positions (cells, 3) [m] in the pad frame; the ratio of a distance along the normal of the
// plane they were cut in to that along a cell's own normal (cells); and where they lie along that plane, u and v, and
// above it, w (cells each) [m]. Forces and displacements are measured along the plane's normal.
struct Bend {
  const double *positions, *stretches;
  const double *u, *v, *w;

  // Multiply entries [first, last) of a cell's row over cells by the distance of the two cells in the plane over their
  // distance on the surface.
  void bring_apart(std::size_t cell, std::size_t first, std::size_t last, double* row) const;
};

// Contact cells as the compliance of the surface sees them. A Bend says how they lie on a curved surface; null where it
// is flat.
struct SurfaceCells {
  std::size_t count;
  const double* points;             // (cells, per_cell, 2) [m]: what a point does is averaged over a cell's points
  std::size_t per_cell;
  const double* areas;              // [m^2]
  const double* inverse_distance;   // integrals of 1/r over pairs of cells [m^3], (cells, cells); null where unknown
  const Bend* bend;
};

// Normal compliance of one pad's surface between any contact cells.
class SurfaceCompliance {
 public:
  SurfaceCompliance() = default;
  // `factor`: of the half space [1/Pa]; `remainder`: sheet minus half space, as the coefficients of products of
  // splines, those along x first, of where it sinks by those of where it is pressed [m/N].
  SurfaceCompliance(double factor, QuadraticSplines x, QuadraticSplines y, Matrix remainder);

  // Springs of law "foundation": logarithms of contact areas [m^2], ascending, and of the
  // stiffness per area under each [Pa/m].
  void set_foundation(std::vector<double> areas, std::vector<double> stiffnesses);
  double foundation_stiffness(double area) const;

  // Additional data for shear: Poisson's ratio of the half space, and the remainder of all three components,
  // (component, spline) by (component, spline) [m/N]. Set once, before any thread asks for `full`.
  void set_tangential(double poisson, Matrix remainder);

  double factor() const { return factor_; }
  std::size_t splines() const { return x_.count() * y_.count(); }

  // Which splines are not zero at a cell: `columns` along x and `rows` along y from a first one, their values by row.
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
    std::vector<double> values, coefficients, smooth;
    std::vector<std::size_t> met;  // splines from one on up to another, by cell
    Matrix through, transposed;
  };

  // Mean normal displacement of each cell per normal force on each cell [m/N].
  void normal(const SurfaceCells& cells, Workspace& workspace, Matrix& compliance) const;

  // Add the displacement [m] of cells, one point each, under normal forces [N] on other cells to `sunk`. Forces act at
  // points, except at a cell's own point, where the mean over a square is used.
  void add_sinking(const SurfaceCells& cells, const SurfaceCells& pressed, const double* forces, Workspace& workspace,
                   double* sunk) const;

  // Mean displacement of each cell, one point each, per force on each cell, (component, cell) by (component, cell)
  // [m/N], whole; pad frame, z out of the pad. `integrals`: of the same cells before they were placed there.
  void full(const SurfaceCells& cells, const ShearIntegrals& integrals, const Placement& placement,
            Workspace& workspace, Matrix& compliance) const;

 private:
  // Mean splines over each cell.
  void weigh(const SurfaceCells& cells, Workspace& workspace) const;
  // Add a remainder between the cells whose splines were computed to `block`, all of it or from the diagonal on.
  // `remainder`: its first entry and its stride.
  void add_remainder(const double* remainder, std::size_t stride, bool upper, Workspace& workspace, double* block,
                     std::size_t block_stride) const;

  double factor_ = 0.0;
  QuadraticSplines x_{{}}, y_{{}};
  Matrix remainder_, full_remainder_;
  double poisson_ = 0.0;
  std::vector<double> areas_, stiffnesses_;  // logarithms
};

}  // namespace mjtactile
