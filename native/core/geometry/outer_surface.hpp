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
  // Heights, slopes and twists (z, dz/dx, dz/dy, d2z/dxdy) at the nodes of a grid, (rows along y, columns along x, 4),
  // and bicubic in between.
  static OuterSurface patch(std::vector<double> x, std::vector<double> y, std::vector<double> jets);

  bool is_flat() const { return kind_ == Kind::flat; }
  bool is_quadric() const { return kind_ == Kind::quadric; }
  // Of a quadric: p, q and c.
  const double* numbers() const { return numbers_; }
  const Rectangle& sheet() const { return sheet_; }
  // Beyond the sheet the surface goes on along its tangents.
  SurfacePoint at(double x, double y) const;

 private:
  enum class Kind { flat, quadric, patch };
  // A patch's lines along one axis, ascending [m], and what divides by the distances between them, and by their mean.
  struct Lines {
    std::vector<double> at, per_distance;
    double per_mean = 0.0;

    Lines() = default;
    explicit Lines(std::vector<double> places);
    // The last line before a place, of those that have one after them.
    std::size_t before(double place) const;
  };
  SurfacePoint within(double x, double y) const;

  Kind kind_ = Kind::flat;
  Rectangle sheet_ = {};
  double numbers_[3] = {};
  Lines x_, y_;
  std::vector<double> jets_;
};

}  // namespace mjtactile
