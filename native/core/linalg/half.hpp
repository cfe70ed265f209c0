// Half precision (IEEE 754 binary16) in portable code. The kernels that use the processor's conversions must agree with
// it.
#pragma once

#include <cstdint>
#include <cstring>

namespace mjtactile {

using Half = std::uint16_t;
using Byte = std::int8_t;

inline float to_float(Half half) {
  const std::uint32_t sign = static_cast<std::uint32_t>(half & 0x8000u) << 16;
  const std::uint32_t exponent = (half >> 10) & 0x1fu;
  const std::uint32_t fraction = half & 0x3ffu;
  float value;
  if (exponent == 0) {  // zero and subnormal numbers: fraction * 2^-24
    value = static_cast<float>(fraction) * 0x1p-24f;
    return sign ? -value : value;
  }
  const std::uint32_t bits = sign | ((exponent == 31 ? 255u : exponent + 112u) << 23) | (fraction << 13);
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

// Round to nearest, ties to even, as hardware does.
inline Half to_half(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  const Half sign = static_cast<Half>((bits >> 16) & 0x8000u);
  const std::uint32_t magnitude = bits & 0x7fffffffu;
  if (magnitude >= 0x7f800000u) {  // infinite or NaN
    return static_cast<Half>(sign | 0x7c00u | (magnitude > 0x7f800000u ? 0x200u : 0u));
  }
  if (magnitude >= 0x477ff000u) return static_cast<Half>(sign | 0x7c00u);  // rounds beyond 65504
  if (magnitude < 0x38800000u) {                                            // below the least normal half
    float scaled;
    std::memcpy(&scaled, &magnitude, sizeof scaled);
    const float shifted = scaled + 0.5f;  // 0.5 has 2^-24 for its last bit: the addition rounds to it
    std::uint32_t rounded;
    std::memcpy(&rounded, &shifted, sizeof rounded);
    return static_cast<Half>(sign | (rounded - 0x3f000000u));
  }
  const std::uint32_t odd = (magnitude >> 13) & 1u;
  return static_cast<Half>(sign | ((magnitude - 0x38000000u + 0xfffu + odd) >> 13));
}

}  // namespace mjtactile
