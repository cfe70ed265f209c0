#include <immintrin.h>

#include <cmath>
#include <cstdint>
#include <cstring>

#include "linalg/kernels_sets.hpp"

namespace mjtactile::avx512 {
namespace {

template <typename Value>
Value widened(Half stored) {
  return _cvtsh_ss(stored);
}
template <typename Value>
Value widened(Byte stored) {
  return stored;
}
template <typename Value>
Value widened(float stored) {
  return stored;
}
template <typename Value>
Value widened(double stored) {
  return stored;
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
  static Type multiply(Type a, Type b) { return _mm512_mul_pd(a, b); }
  static Type multiply_add(Type a, Type b, Type c) { return _mm512_fmadd_pd(a, b, c); }
  static Type root(Type a) { return _mm512_maskz_sqrt_pd(0xff, a); }
};

constexpr std::size_t kSumVectors = 16;  // of sums that stay in registers
constexpr std::size_t kTileVectors = 4;  // of a tile of a matrix product

#include "linalg/kernels_body.hpp"

}  // namespace

Kernels make() { return make_kernels("avx512"); }

}  // namespace mjtactile::avx512
