// Heights in rising order. Only as many are sorted as are taken.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

namespace mjtactile {

class RisingHeights {
 public:
  struct Height {
    double height;
    std::uint32_t place;   // index among the given heights
  };

  // Begin with other heights; those that are not finite are left out.
  void begin(const std::vector<double>& heights) {
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const double one : heights) {
      if (std::isfinite(one)) least = std::min(least, one), most = std::max(most, one);
    }
    // Heights are distributed over shelves, equal intervals of height. A shelf is sorted when all below it are empty.
    const double per = most > least ? static_cast<double>(kShelves) / (most - least) : 0.0;
    const auto shelf = [&](double one) {
      return std::min(static_cast<std::size_t>((one - least) * per), kShelves - 1);
    };
    std::fill(ends_, ends_ + kShelves + 1, 0);
    shelves_.resize(heights.size());
    for (std::size_t place = 0; place < heights.size(); ++place) {
      const double one = heights[place];
      const std::size_t own = std::isfinite(one) ? shelf(one) : kShelves;
      shelves_[place] = static_cast<std::uint8_t>(own);
      ++ends_[own];
    }
    for (std::size_t k = 1; k < kShelves; ++k) ends_[k] += ends_[k - 1];
    order_.resize(static_cast<std::size_t>(ends_[kShelves - 1]));
    for (std::size_t place = heights.size(); place-- > 0;) {
      const std::size_t own = shelves_[place];
      if (own < kShelves) {
        order_[static_cast<std::size_t>(--ends_[own])] = {heights[place], static_cast<std::uint32_t>(place)};
      }
    }
    // The loop has moved `ends_` down to the beginning of each shelf.
    shelf_ = end_ = 0;
    open();
  }

  bool empty() const { return end_ == 0; }
  // The lowest height that is left; of equal heights the one given first.
  Height lowest() const {
    const auto& [height, place] = *(order_.begin() + first_);
    return {height, place};
  }
  void take_lowest() {
    const auto first = order_.begin() + first_, end = order_.begin() + end_;
    std::pop_heap(first, end, std::greater<>());
    if (--end_ == first_) open();
  }

 private:
  static constexpr std::size_t kShelves = 128;

  // Go to the next shelf that is not empty and make a heap of it, lowest first.
  void open() {
    while (shelf_ < kShelves) {
      first_ = ends_[shelf_];
      end_ = ++shelf_ < kShelves ? ends_[shelf_] : static_cast<std::ptrdiff_t>(order_.size());
      if (end_ == first_) continue;
      std::make_heap(order_.begin() + first_, order_.begin() + end_, std::greater<>());
      return;
    }
    first_ = end_ = 0;
  }

  std::vector<std::pair<double, std::uint32_t>> order_;
  // Ends of the shelves in `order_` while it is filled, then their beginnings; the last one is for heights that are
  // left out.
  std::ptrdiff_t ends_[kShelves + 1] = {};
  std::vector<std::uint8_t> shelves_;    // of each height
  std::size_t shelf_ = 0;
  std::ptrdiff_t first_ = 0, end_ = 0;   // range in `order_` of the heights left on the open shelf
};

}  // namespace mjtactile
