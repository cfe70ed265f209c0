// Nodal forces spread onto the elements' corners, for tables that hold columns of corners only
// (mjtactile/fem/vertex_loads.py): a quarter of the columns, the same resultants and moments up to the third.
#pragma once

#include <cstddef>
#include <vector>

namespace mjtactile {

class CornerSpread {
 public:
  // Element ends along both axes, ascending [m].
  CornerSpread(const std::vector<double>& ends_x, const std::vector<double>& ends_y);

  std::size_t corners_x() const { return x_.corners; }
  std::size_t corners_y() const { return y_.corners; }
  // Forces on corners (corners y, corners x, 3) of forces on nodes (nodes y, nodes x, 3) [N]; `rows` is scratch.
  void spread(const double* nodal, std::vector<double>& rows, std::vector<double>& corners) const;

 private:
  static constexpr std::size_t kMost = 4;  // corners that share a mid-side node's force
  struct Middle {
    std::size_t first, count;
    double weights[kMost];
  };
  struct Axis {
    std::size_t corners, nodes;
    std::vector<Middle> middles;  // of each element
  };
  static Axis axis(const std::vector<double>& ends);

  Axis x_, y_;
};

}  // namespace mjtactile
