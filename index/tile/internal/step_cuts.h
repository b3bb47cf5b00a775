// What the vector code of step_sums.cpp shares with the code around it: tables, and the head of a group of steps.
#pragma once

#include "index/tile/internal/step_sums.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace filiform::internal::steps {

inline constexpr std::size_t kReadable = 64;  // the vector code may read so many bytes from the head of a group on

// How to cut eight values of `width` bits from `width` bytes: four from the first byte on, four from byte width / 2 on.
struct alignas(16) Cut {
  std::uint8_t bytes[2][16];   // the four bytes that contain each value
  std::uint32_t shifts[2][4];  // bits before the value in these bytes
};
struct Cuts {
  std::array<Cut, kNarrowStepBits + 1> of{};

  constexpr Cuts() {
    for (std::uint32_t width = 0; width < of.size(); ++width)
      for (std::uint32_t half = 0; half < 2; ++half)
        for (std::uint32_t i = 0; i < 4; ++i) {
          const std::uint32_t bit = 4 * half * width % 8 + i * width;
          of[width].shifts[half][i] = bit % 8;
          for (std::uint32_t b = 0; b < 4; ++b)
            of[width].bytes[half][4 * i + b] = static_cast<std::uint8_t>(bit / 8 + b);
        }
  }
};
inline constexpr Cuts kCuts;

struct Widths {
  unsigned x, y, z;

  explicit Widths(unsigned head) : x(head & 31), y(head >> kStepWidthBits & 31), z(head >> 2 * kStepWidthBits & 31) {}
  bool narrow() const { return x <= kNarrowStepBits && y <= kNarrowStepBits && z <= kNarrowStepBits; }
};

// Decodes whole groups while they are narrow and `readable`, and returns how far it came. `sums`: the entry before.
struct Progress {
  const std::uint8_t* at;
  std::size_t groups;
};
using SumGroups = Progress (*)(const std::uint8_t* at, std::size_t readable, std::size_t groups, std::uint16_t* sums);

}  // namespace filiform::internal::steps
