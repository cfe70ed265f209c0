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
    const auto shelf = [&](double one) { return std::min(static_cast<std::size_t>((one - least) * per), kShelves - 1); };
    std::fill(ends_, ends_ + kShelves, 0u);
    for (const double one : heights) {
      if (std::isfinite(one)) ++ends_[shelf(one)];
    }
    for (std::size_t k = 1; k < kShelves; ++k) ends_[k] += ends_[k - 1];
    order_.resize(ends_[kShelves - 1]);
    for (std::size_t place = heights.size(); place-- > 0;) {
      const double one = heights[place];
      if (std::isfinite(one)) order_[--ends_[shelf(one)]] = {one, static_cast<std::uint32_t>(place)};
    }
    // The loop has moved `ends_` down to the beginning of each shelf.
    shelf_ = end_ = 0;
    open();
  }

  bool empty() const { return end_ == 0; }
  // The lowest height that is left; of equal heights the one given first.
  Height lowest() const { return {order_[first_].first, order_[first_].second}; }
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
  std::ptrdiff_t ends_[kShelves] = {};   // ends of the shelves in `order_` while it is filled, then their beginnings
  std::size_t shelf_ = 0;
  std::ptrdiff_t first_ = 0, end_ = 0;   // range in `order_` of the heights left on the open shelf
};

}  // namespace mjtactile
