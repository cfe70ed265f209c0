// Nodal forces replaced by forces on the elements' corners, for tables that hold columns of corners only
// (mjtactile/fem/corner_loads.py). These have a quarter of the columns. Forces on mid-side nodes are distributed over
// the nearest corners by cubic Lagrange interpolation, so that resultants and moments up to third order are kept.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mjtactile {

class CornerSpread {
 public:
  // Coordinates of the element boundaries along both axes, ascending [m].
  CornerSpread(const std::vector<double>& ends_x, const std::vector<double>& ends_y);

  std::size_t corners_x() const { return x_.corners; }
  std::size_t corners_y() const { return y_.corners; }
  // Compute the forces on corners (corners y, corners x, 3) [N] that replace forces on nodes (nodes y, nodes x, 3) [N].
  // `row` is scratch memory.
  void spread(const double* nodal, std::vector<double>& row, std::vector<double>& corners) const;

 private:
  static constexpr std::size_t kMost = 4;  // corners that share a mid-side node's force
  static constexpr std::size_t kMostNodes = 1 + 2 * kMost;  // nodes from which one corner takes a share of the force
  struct Axis {
    std::size_t corners, nodes;
    // A sparse matrix (corners, nodes) by rows: corner i takes weights[k] of the force on node places[k], for k from
    // starts[i] to before starts[i + 1].
    std::vector<std::uint32_t> starts, places;
    std::vector<double> weights;
  };
  static Axis axis(const std::vector<double>& ends);

  Axis x_, y_;
};

}  // namespace mjtactile
