#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "linalg/angles.hpp"
#include "linalg/kernels_sets.hpp"

namespace mjtactile::plain {
namespace {

template <typename Value, typename Stored>
Value widened(Stored stored) {
  if constexpr (std::is_same_v<Stored, Half>) {
    return to_float(stored);
  } else {
    return stored;
  }
}

inline void prefetch(const char*) {}

template <typename Value>
struct Lanes {
  using Type = Value;
  static constexpr std::size_t width = 1;
  static Type all(Value value) { return value; }
  template <typename Stored>
  static Type load(const Stored* at) {
    return widened<Value>(*at);
  }
  static void store(Value* at, Type value) { *at = value; }
  static Type load_first(const Value* at, std::size_t) { return *at; }
  static void store_first(Value* at, std::size_t, Type value) { *at = value; }
  static Type multiply(Type a, Type b) { return a * b; }
  static Type multiply_add(Type a, Type b, Type c) { return a * b + c; }
  static Type root(Type a) { return std::sqrt(a); }
  static std::uint32_t up_to(Type a, Type bound) { return a <= bound ? 1 : 0; }
};

constexpr std::size_t kSumVectors = 4;  // vectors of a tile of sums, which stay in registers
constexpr std::size_t kTileVectors = 1;  // width of a tile of a matrix product
constexpr std::size_t kTallRows = 4;  // rows of such a tile that is one vector wide

#include "linalg/kernels_body.hpp"

}  // namespace

constexpr Kernels kKernels = kernels_named("plain", select<float>);

}  // namespace mjtactile::plain
