// The outer surface of a curved pad: a smooth graph z(x, y) in the pad frame (mjtactile/pad_shape/surfaces.py).
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/triangles.hpp"

namespace mjtactile {

// The surface above a point of the pad's plane.
struct SurfacePoint {
  double z, slopes[2];   // height [m], and its slopes along x and y [-]
};

class OuterSurface {
 public:
  // The plane z = 0.
  OuterSurface() = default;
  // The upper half of p x^2 + q y^2 + ((z + c) / c)^2 = 1, with its apex in the origin; p and q in 1/m^2, c in m.
  static OuterSurface quadric(const Rectangle& sheet, double p, double q, double c);
  // Heights, slopes and twists (z, dz/dx, dz/dy, d2z/dxdy) at the nodes of an even grid over the sheet, (rows along y,
  // columns along x, 4), and bicubic in between.
  static OuterSurface patch(const Rectangle& sheet, std::size_t count_x, std::size_t count_y, const double* jets);

  bool is_flat() const { return kind_ == Kind::flat; }
  bool is_quadric() const { return kind_ == Kind::quadric; }
  // Of a quadric: p, q and c.
  const double* numbers() const { return numbers_; }
  const Rectangle& sheet() const { return sheet_; }
  // Beyond the sheet the surface goes on along its tangents.
  SurfacePoint at(double x, double y) const;

 private:
  enum class Kind { flat, quadric, patch };
  // A patch's lines along one axis, evenly apart [m].
  struct Lines {
    double first = 0.0, distance = 0.0, per_distance = 0.0;
    std::size_t last = 0;   // of those that have one after them

    Lines() = default;
    Lines(double first_one, double last_one, std::size_t lines);
    // The last line before a place, of those that have one after them, and how far beyond it that is, over the distance.
    std::size_t before(double place, double& beyond) const;
  };
  // Between lines a patch is a polynomial of the place in parts of the distances: coefficients by powers along y and x.
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
