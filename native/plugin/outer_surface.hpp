// The outer surface of a curved pad as far as MuJoCo's side needs it: how high it stands, and where its normals point.
#pragma once

#include <cstddef>
#include <vector>

namespace mjtactile::mujoco {

class OuterSurface {
 public:
  // Of a flat pad.
  OuterSurface() = default;
  // Samples (rows along y, columns along x, 4): height [m] and unit normal, over a rectangle of this half size [m].
  OuterSurface(const double* samples, std::size_t rows, std::size_t columns, const double* half_size);

  bool flat() const { return samples_.empty(); }
  // Height [m] and unit normal above a point of the projection; of the nearest one over the pad beside it.
  struct Point {
    double height, normal[3];
  };
  Point at(double x, double y) const;

 private:
  std::vector<double> samples_;
  std::size_t rows_ = 0, columns_ = 0;
  double half_[2] = {};
};

}  // namespace mjtactile::mujoco
