// Cells in the order in which they are likely to be pressed, so that a matrix factor of the first ones can be kept.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace mjtactile {

// Sort cells by height. Cells that change between pressed and free then come last, and the factor of those before them
// stays valid. With null heights the cells keep their order.
inline void order_by_height(const double* heights, std::size_t cells, std::vector<std::size_t>& order) {
  order.resize(cells);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (heights == nullptr) return;
  std::sort(order.begin(), order.end(), [heights](std::size_t i, std::size_t j) {
    return heights[i] != heights[j] ? heights[i] < heights[j] : i < j;
  });
}

}  // namespace mjtactile
