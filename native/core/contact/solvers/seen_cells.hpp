// Which sets of cells a search has been at, so that it notices when it goes in circles.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace mjtactile {

class SeenCells {
 public:
  void clear() { fingerprints_.clear(); }
  // Whether these flags of cells came up since clear(); now they have.
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
