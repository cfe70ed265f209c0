// How far the surface gives under contact cells: a half space in closed form plus the sheet's smooth remainder.
#pragma once

#include <cstddef>
#include <vector>

#include "dense.hpp"

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

  double factor() const { return factor_; }

  struct Workspace {
    Matrix weights, transposed, through;
    std::vector<double> x, y;
  };

  // Mean normal displacement of each cell per normal force on each cell [m/N], upper triangle.
  // `centroids` (cells, 2) [m], `areas` (cells) [m^2]; `inverse_distance`: integrals of 1/r over pairs of cells of the
  // same shape elsewhere [m^3], (cells, cells), to be multiplied by `scale`^3.
  void normal(const double* centroids, const double* areas, std::size_t cells, const double* inverse_distance,
              double scale, Workspace& workspace, Matrix& compliance) const;

 private:
  double factor_;
  AveragingSpline x_, y_;
  Matrix remainder_;
  std::vector<double> areas_, stiffnesses_;  // logarithms
};

}  // namespace mjtactile
