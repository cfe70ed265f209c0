// Nodal forces spread onto the elements' corners, for tables that hold columns of corners only
// (mjtactile/fem/vertex_loads.py): a quarter of the columns, the same resultants and moments up to the third.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mjtactile {

class CornerSpread {
 public:
  // Element ends along both axes, ascending [m].
  CornerSpread(const std::vector<double>& ends_x, const std::vector<double>& ends_y);

  std::size_t corners_x() const { return x_.corners; }
  std::size_t corners_y() const { return y_.corners; }
  // Forces on corners (corners y, corners x, 3) of forces on nodes (nodes y, nodes x, 3) [N]; `row` is scratch.
  void spread(const double* nodal, std::vector<double>& row, std::vector<double>& corners) const;

 private:
  static constexpr std::size_t kMost = 4;  // corners that share a mid-side node's force
  static constexpr std::size_t kMostNodes = 1 + 2 * kMost;  // whose force one corner has a share of
  struct Axis {
    std::size_t corners, nodes;
    std::vector<std::uint32_t> starts, places;   // by corner: nodes of whose force it has a share
    std::vector<double> weights;
  };
  static Axis axis(const std::vector<double>& ends);

  Axis x_, y_;
};

}  // namespace mjtactile
