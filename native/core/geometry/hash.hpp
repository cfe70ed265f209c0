// Hashes of numbers and of memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace mjtactile {

// Mix a number into a hash.
inline std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) {
  hash ^= value + 0x9e3779b97f4a7c15u + (hash << 6) + (hash >> 2);
  hash *= 0xff51afd7ed558ccdu;
  return hash ^ (hash >> 33);
}

// Mix memory into a hash. Four hashes run side by side, because each multiplication waits for the one before it.
inline std::uint64_t mixed(std::uint64_t hash, const void* memory, std::size_t bytes) {
  constexpr std::size_t kLanes = 4;
  const auto* at = static_cast<const unsigned char*>(memory);
  std::uint64_t lanes[kLanes] = {hash, 1, 2, 3}, words[kLanes];
  for (std::size_t left = bytes; left > 0;) {
    const std::size_t count = left < sizeof words ? left : sizeof words;
    if (count < sizeof words) std::memset(words, 0, sizeof words);
    std::memcpy(words, at, count);
    for (std::size_t k = 0; k < kLanes; ++k) {
      lanes[k] = (lanes[k] ^ words[k]) * 0x9e3779b97f4a7c15u;
      lanes[k] ^= lanes[k] >> 29;
    }
    at += count, left -= count;
  }
  hash = bytes;
  for (const std::uint64_t lane : lanes) hash = mixed(hash, lane);
  return hash;
}

}  // namespace mjtactile
