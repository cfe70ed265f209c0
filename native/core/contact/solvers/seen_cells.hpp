// The sets of cells that a search has tried, so that it notices a cycle.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "geometry/hash.hpp"

namespace mjtactile {

class SeenCells {
 public:
  void clear() { fingerprints_.clear(); }
  // Add a set of cells, given by flags. Returns whether it was added before, since clear().
  bool again(std::initializer_list<const std::vector<std::uint8_t>*> flags) {
    std::uint64_t hash = 0;
    for (const auto* one : flags) hash = mixed(hash, one->data(), one->size());
    const bool found = std::find(fingerprints_.begin(), fingerprints_.end(), hash) != fingerprints_.end();
    fingerprints_.push_back(hash);
    return found;
  }

 private:
  std::vector<std::uint64_t> fingerprints_;
};

}  // namespace mjtactile
