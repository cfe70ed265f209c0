#include <immintrin.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "linalg/angles.hpp"
#include "linalg/kernels_sets.hpp"

namespace mjtactile::avx512 {
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
  using Type = __m512;
  static constexpr std::size_t width = 16;
  static Type all(float value) { return _mm512_set1_ps(value); }
  static Type load(const float* at) { return _mm512_loadu_ps(at); }
  static Type load(const Half* at) {
    return _mm512_maskz_cvtph_ps(0xffff, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(at)));
  }
  static Type load(const Byte* at) {
    const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(at));
    return _mm512_maskz_cvtepi32_ps(0xffff, _mm512_maskz_cvtepi8_epi32(0xffff, bytes));
  }
  static void store(float* at, Type value) { _mm512_storeu_ps(at, value); }
  static Type multiply(Type a, Type b) { return _mm512_mul_ps(a, b); }
  static Type multiply_add(Type a, Type b, Type c) { return _mm512_fmadd_ps(a, b, c); }
  static Type root(Type a) { return _mm512_maskz_sqrt_ps(0xffff, a); }
};

template <>
struct Lanes<double> {
  using Type = __m512d;
  static constexpr std::size_t width = 8;
  static Type all(double value) { return _mm512_set1_pd(value); }
  static Type load(const double* at) { return _mm512_loadu_pd(at); }
  static void store(double* at, Type value) { _mm512_storeu_pd(at, value); }
  // Mask of the first lanes.
  static __mmask8 first(std::size_t count) { return static_cast<__mmask8>((1u << count) - 1u); }
  static Type load_first(const double* at, std::size_t count) { return _mm512_maskz_loadu_pd(first(count), at); }
  static void store_first(double* at, std::size_t count, Type value) { _mm512_mask_storeu_pd(at, first(count), value); }
  static Type multiply(Type a, Type b) { return _mm512_mul_pd(a, b); }
  static Type multiply_add(Type a, Type b, Type c) { return _mm512_fmadd_pd(a, b, c); }
  static Type root(Type a) { return _mm512_maskz_sqrt_pd(0xff, a); }
  // Bits of the lanes that are not above a bound.
  static std::uint32_t up_to(Type a, Type bound) { return _mm512_cmp_pd_mask(a, bound, _CMP_LE_OQ); }
};

// Sixteen forces at a time. Those selected are compressed to the front of the vector.
inline std::size_t select_floats(const double* forces, const std::uint32_t* columns, std::size_t count, double least,
                               double factor, std::uint32_t* places, float* weights) {
  const __m512d bound = _mm512_set1_pd(least), times = _mm512_set1_pd(factor), none = _mm512_setzero_pd();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; i += 16) {
    const __m512d low = _mm512_loadu_pd(forces + i), high = _mm512_loadu_pd(forces + i + 8);
    const auto counts = [&](__m512d part) {
      return static_cast<unsigned>(_mm512_cmp_pd_mask(_mm512_abs_pd(part), bound, _CMP_NLT_UQ) &
                                   _mm512_cmp_pd_mask(part, none, _CMP_NEQ_UQ));
    };
    const unsigned mask = counts(low) | counts(high) << 8;
    const __m512d halves = _mm512_maskz_insertf64x4(
        0xff,
        _mm512_castpd256_pd512(_mm256_castps_pd(_mm512_maskz_cvtpd_ps(0xff, _mm512_mul_pd(low, times)))),
        _mm256_castps_pd(_mm512_maskz_cvtpd_ps(0xff, _mm512_mul_pd(high, times))), 1);
    const auto chosen = static_cast<__mmask16>(mask);
    _mm512_storeu_ps(weights + kept, _mm512_maskz_compress_ps(chosen, _mm512_castpd_ps(halves)));
    _mm512_storeu_si512(places + kept, _mm512_maskz_compress_epi32(chosen, _mm512_loadu_si512(columns + i)));
    kept += static_cast<std::size_t>(__builtin_popcount(mask));
  }
  return kept;
}

constexpr std::size_t kSumVectors = 16;  // vectors of a tile of sums, which stay in registers
constexpr std::size_t kTileVectors = 4;  // width of a tile of a matrix product
constexpr std::size_t kTallRows = 16;  // rows of such a tile that is one vector wide

#include "linalg/kernels_body.hpp"

}  // namespace

constexpr Kernels kKernels = kernels_named("avx512", select_floats);

}  // namespace mjtactile::avx512
