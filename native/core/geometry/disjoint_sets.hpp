// Items joined into sets: parts of a face that are one cell, samples of a body that are one part of it (union-find).
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace mjtactile {

// `Item`: the integer that numbers items. The root of a set is its first item.
template <typename Item>
class DisjointSets {
 public:
  // Begin anew with `count` items, each a set of its own. Keeps its memory.
  void reset(std::size_t count) {
    parents_.resize(count);
    std::iota(parents_.begin(), parents_.end(), Item(0));
  }
  // One more item, a set of its own.
  Item add() {
    parents_.push_back(static_cast<Item>(parents_.size()));
    return parents_.back();
  }
  Item root(Item item) {
    while (parent(item) != item) item = parent(item) = parent(parent(item));
    return item;
  }
  void join(Item a, Item b) {
    a = root(a), b = root(b);
    parent(std::max(a, b)) = std::min(a, b);
  }

 private:
  Item& parent(Item item) { return parents_[static_cast<std::size_t>(item)]; }

  std::vector<Item> parents_;
};

}  // namespace mjtactile
