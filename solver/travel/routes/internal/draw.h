// Random numbers that are the same on every machine. The standard distributions differ between libraries.
#pragma once

#include <cstdint>
#include <random>

namespace filiform::internal {

// A uniform random number below n. Requires n > 0.
inline std::uint64_t drawBelow(std::mt19937_64& random, std::uint64_t n) {
  const std::uint64_t most = UINT64_MAX - UINT64_MAX % n;
  std::uint64_t draw = random();
  while (draw >= most) draw = random();
  return draw % n;
}

}  // namespace filiform::internal
