// Memory aligned to cache lines, so that a SIMD load never straddles two of them, and rows of whole vectors.
#pragma once

#include <cstddef>
#include <new>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace mjtactile {

template <typename Value>
struct AlignedAllocator {
  using value_type = Value;
  static constexpr std::align_val_t kLine{64};

  AlignedAllocator() = default;
  template <typename Other>
  AlignedAllocator(const AlignedAllocator<Other>&) {}

  // Large matrices use the system's large pages if it has them. A step reads scattered columns of them, and with small
  // pages the address lookups would take longer than the reading.
  static constexpr std::size_t kLargePage = std::size_t{1} << 21;

  Value* allocate(std::size_t count) {
    const std::size_t size = count * sizeof(Value);
    if (size < kLargePage) return static_cast<Value*>(::operator new(size, kLine));
    void* at = ::operator new(size, std::align_val_t{kLargePage});
#ifdef __linux__
    madvise(at, size / kLargePage * kLargePage, MADV_HUGEPAGE);  // may fail: only speed depends on it
#endif
    return static_cast<Value*>(at);
  }
  void deallocate(Value* at, std::size_t count) {
    const bool large = count * sizeof(Value) >= kLargePage;
    ::operator delete(at, large ? std::align_val_t{kLargePage} : kLine);
  }
  bool operator==(const AlignedAllocator&) const { return true; }
  bool operator!=(const AlignedAllocator&) const { return false; }
};

template <typename Value>
using AlignedVector = std::vector<Value, AlignedAllocator<Value>>;

// Rows are padded to a multiple of this, so that kernels see whole vectors only.
constexpr std::size_t kAligned = 16;

constexpr std::size_t padded(std::size_t count) { return (count + kAligned - 1) / kAligned * kAligned; }

}  // namespace mjtactile
