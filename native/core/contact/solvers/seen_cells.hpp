// The sets of cells that a search has tried, so that it notices a cycle.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace mjtactile {

class SeenCells {
 public:
  void clear() { fingerprints_.clear(); }
  // Add a set of cells, given by flags. Returns whether it was added before, since clear().
  bool again(std::initializer_list<const std::vector<std::uint8_t>*> flags) {
    std::uint64_t hash = 1469598103934665603u;  // FNV-1a
    for (const auto* one : flags) {
      for (const std::uint8_t flag : *one) hash = (hash ^ flag) * 1099511628211u;
    }
    const bool found = std::find(fingerprints_.begin(), fingerprints_.end(), hash) != fingerprints_.end();
    fingerprints_.push_back(hash);
    return found;
  }

 private:
  std::vector<std::uint64_t> fingerprints_;
};

}  // namespace mjtactile
