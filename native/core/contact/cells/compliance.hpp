// How far the surface gives under contact cells: a half space in closed form plus the sheet's smooth remainder.
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/tangential.hpp"
#include "linalg/dense.hpp"

namespace mjtactile {

// Weights of patch values along one axis: a quadratic spline that keeps the values as its averages over the patches.
class AveragingSpline {
 public:
  // `ends`: of the patches, ascending [m]; `coefficients`: (3, patches, patches), highest power first, of the local
  // coordinate x - ends[interval], the weight of each patch last.
  AveragingSpline(std::vector<double> ends, std::vector<double> coefficients);

  std::size_t patches() const { return ends_.size() - 1; }
  void weights(double at, double* weights) const;

 private:
  std::vector<double> ends_, coefficients_;
};

// Normal compliance of one pad's surface between any contact cells.
class SurfaceCompliance {
 public:
  // `factor`: of the half space [1/Pa]; `remainder`: sheet minus half space between patches, patches by row [m/N].
  SurfaceCompliance(double factor, AveragingSpline x, AveragingSpline y, Matrix remainder);

  // Springs that stand for the surface under law "foundation": logarithms of contact areas [m^2], ascending, and of the
  // stiffness per area under each [Pa/m].
  void set_foundation(std::vector<double> areas, std::vector<double> stiffnesses);
  double foundation_stiffness(double area) const;
  bool has_foundation() const { return !areas_.empty(); }

  // What shear needs besides: Poisson's ratio of the half space, and the remainder of all three components, (component,
  // patch) by (component, patch) [m/N]. Set once, before any thread asks for `full`.
  void set_tangential(double poisson, Matrix remainder);
  bool has_tangential() const { return full_remainder_.rows() > 0; }

  double factor() const { return factor_; }
  std::size_t patches() const { return x_.patches() * y_.patches(); }

  struct Workspace {
    Matrix weights, transposed, through, block;
    std::vector<double> x, y, patches, smooth;
  };

  // Mean normal displacement of each cell per normal force on each cell [m/N].
  // `points` (cells, per_cell, 2) [m]: whose mean stands for each cell; `areas` (cells) [m^2]; `inverse_distance`:
  // integrals of 1/r over pairs of cells of the same shape elsewhere [m^3], (cells, cells), to be multiplied by
  // `scale`^3.
  void normal(const double* points, std::size_t per_cell, const double* areas, std::size_t cells,
              const double* inverse_distance, double scale, Workspace& workspace, Matrix& compliance) const;

  // How far points (count, 2) [m] go down under normal forces [N] on other cells, added to `sunk` [m]: point forces, but
  // for the mean over a square cell at its own middle.
  void add_sinking(const double* points, std::size_t count, const double* centroids, const double* areas,
                   const double* forces, std::size_t cells, Workspace& workspace, double* sunk) const;

  // Mean displacement of each cell per force on each cell, (component, cell) by (component, cell) [m/N], whole; pad
  // frame, z out of the pad. `integrals`: of the same cells, turned by an angle of this cosine and sine.
  void full(const double* centroids, const double* areas, std::size_t cells, const double* inverse_distance,
            const ShearIntegrals& integrals, double cosine, double sine, Workspace& workspace,
            Matrix& compliance) const;

 private:
  // Weights of the patches at the cells, and the same transposed.
  void weigh(const double* points, std::size_t per_cell, std::size_t cells, Workspace& workspace) const;

  double factor_;
  AveragingSpline x_, y_;
  Matrix remainder_, full_remainder_;
  double poisson_ = 0.0;
  std::vector<double> areas_, stiffnesses_;  // logarithms
};

}  // namespace mjtactile
