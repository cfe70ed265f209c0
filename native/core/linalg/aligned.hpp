// Memory that begins at a cache line: vectors loaded from rows of whole ones never straddle two.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace mjtactile {

template <typename Value>
struct AlignedAllocator {
  using value_type = Value;
  static constexpr std::align_val_t kLine{64};

  AlignedAllocator() = default;
  template <typename Other>
  AlignedAllocator(const AlignedAllocator<Other>&) {}

  Value* allocate(std::size_t count) { return static_cast<Value*>(::operator new(count * sizeof(Value), kLine)); }
  void deallocate(Value* at, std::size_t) { ::operator delete(at, kLine); }
  bool operator==(const AlignedAllocator&) const { return true; }
  bool operator!=(const AlignedAllocator&) const { return false; }
};

template <typename Value>
using AlignedVector = std::vector<Value, AlignedAllocator<Value>>;

}  // namespace mjtactile
