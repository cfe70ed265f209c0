// Cells in the order in which they are likely to be pressed: a factor goes on from those that stay.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace mjtactile {

// By height, so that cells that change sides come last; as they are where heights are null.
inline void order_by_height(const double* heights, std::size_t cells, std::vector<std::size_t>& order) {
  order.resize(cells);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (heights == nullptr) return;
  std::sort(order.begin(), order.end(), [heights](std::size_t i, std::size_t j) {
    return heights[i] != heights[j] ? heights[i] < heights[j] : i < j;
  });
}

}  // namespace mjtactile
