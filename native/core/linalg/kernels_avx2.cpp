#include <immintrin.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "linalg/angles.hpp"
#include "linalg/kernels_sets.hpp"

namespace mjtactile::avx2 {
namespace {

template <typename Value, typename Stored>
Value widened(Stored stored) {
  if constexpr (std::is_same_v<Stored, Half>) {
    return _cvtsh_ss(stored);
  } else {
    return stored;
  }
}

inline void prefetch(const char* at) { _mm_prefetch(at, _MM_HINT_T0); }

template <typename Value>
struct Lanes;

template <>
struct Lanes<float> {
  using Type = __m256;
  static constexpr std::size_t width = 8;
  static Type all(float value) { return _mm256_set1_ps(value); }
  static Type load(const float* at) { return _mm256_loadu_ps(at); }
  static Type load(const Half* at) {
    return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at)));
  }
  static Type load(const Byte* at) {
    return _mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(at))));
  }
  static void store(float* at, Type value) { _mm256_storeu_ps(at, value); }
  static Type multiply(Type a, Type b) { return _mm256_mul_ps(a, b); }
  static Type multiply_add(Type a, Type b, Type c) { return _mm256_fmadd_ps(a, b, c); }
  static Type root(Type a) { return _mm256_sqrt_ps(a); }
};

template <>
struct Lanes<double> {
  using Type = __m256d;
  static constexpr std::size_t width = 4;
  static Type all(double value) { return _mm256_set1_pd(value); }
  static Type load(const double* at) { return _mm256_loadu_pd(at); }
  static void store(double* at, Type value) { _mm256_storeu_pd(at, value); }
  // Mask of the first lanes.
  static __m256i first(std::size_t count) {
    return _mm256_cmpgt_epi64(_mm256_set1_epi64x(static_cast<long long>(count)), _mm256_setr_epi64x(0, 1, 2, 3));
  }
  static Type load_first(const double* at, std::size_t count) { return _mm256_maskload_pd(at, first(count)); }
  static void store_first(double* at, std::size_t count, Type value) { _mm256_maskstore_pd(at, first(count), value); }
  static Type multiply(Type a, Type b) { return _mm256_mul_pd(a, b); }
  static Type multiply_add(Type a, Type b, Type c) { return _mm256_fmadd_pd(a, b, c); }
  static Type root(Type a) { return _mm256_sqrt_pd(a); }
  // Bits of the lanes that are not above a bound.
  static std::uint32_t up_to(Type a, Type bound) {
    return static_cast<std::uint32_t>(_mm256_movemask_pd(_mm256_cmp_pd(a, bound, _CMP_LE_OQ)));
  }
};

constexpr std::size_t kSumVectors = 8;  // vectors of a tile of sums, which stay in registers
constexpr std::size_t kTileVectors = 2;  // width of a tile of a matrix product
constexpr std::size_t kTallRows = 8;  // rows of such a tile that is one vector wide

#include "linalg/kernels_body.hpp"

}  // namespace

constexpr Kernels kKernels = kernels_named("avx2", select<float>);

}  // namespace mjtactile::avx2
