// The outer surface of a curved pad, a smooth function z(x, y) in the pad frame (see mjtactile/pad_shape/surfaces.py).
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/polygon.hpp"

namespace mjtactile {

// The surface above a point (x, y) of the pad's plane.
struct SurfacePoint {
  double z, slopes[2];   // height [m], and slopes along x and y [-]
};

class OuterSurface {
 public:
  // The plane z = 0.
  OuterSurface() = default;
  // The upper half of p x^2 + q y^2 + ((z + c) / c)^2 = 1, with its apex in the origin; p and q in 1/m^2, c in m.
  static OuterSurface quadric(const Rectangle& sheet, double p, double q, double c);
  // A bicubic surface. `jets`: height, slopes and twist (z, dz/dx, dz/dy, d2z/dxdy) at the nodes of an even grid over
  // the sheet, (count_y, count_x, 4) [m, -, -, 1/m].
  static OuterSurface patch(const Rectangle& sheet, std::size_t count_x, std::size_t count_y, const double* jets);

  bool is_flat() const { return kind_ == Kind::flat; }
  bool is_quadric() const { return kind_ == Kind::quadric; }
  // The numbers p [1/m^2], q [1/m^2] and c [m] of a quadric.
  const double* numbers() const { return numbers_; }
  const Rectangle& sheet() const { return sheet_; }
  // The surface above (x, y) [m]. Beyond the sheet it goes on along its tangents.
  SurfacePoint at(double x, double y) const;

 private:
  enum class Kind { flat, quadric, patch };
  // The evenly spaced grid lines of a patch along one axis.
  struct Lines {
    double first = 0.0, distance = 0.0, per_distance = 0.0;   // first line [m], spacing [m] and its inverse [1/m]
    std::size_t last = 0;   // number of the last line that has another one after it

    Lines() = default;
    Lines(double first_one, double last_one, std::size_t lines);
    // The cell that holds a place, by its first line. `beyond`: distance of the place from that line over the spacing
    // [-].
    std::size_t before(double place, double& beyond) const;
  };
  // A patch's polynomial between grid lines: coefficients (4, 4) of powers along y and x of the place within the cell,
  // each coordinate divided by the spacing.
  struct Cell {
    double powers[4][4];
  };
  SurfacePoint within(double x, double y) const;

  Kind kind_ = Kind::flat;
  Rectangle sheet_ = {};
  double numbers_[3] = {};
  Lines x_, y_;
  std::vector<Cell> cells_;   // of a patch, (rows along y, columns along x)
};

}  // namespace mjtactile
