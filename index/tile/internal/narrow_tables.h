// What the vector code of narrow_nodes.cpp shares with the code around it: tables, and the head of a group of steps.
// Thread rule: values.
#pragma once

#include "index/tile/internal/narrow_nodes.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace filiform::internal::narrow {

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

// For each set of eight numbers: the nodes that have no number outside the set. The eight numbers are the first, second
// or third part of those of eight nodes.
struct NodesInside {
  std::array<std::array<std::uint8_t, 256>, 3> of{};

  constexpr NodesInside() {
    for (std::size_t part = 0; part < 3; ++part)
      for (std::size_t set = 0; set < 256; ++set) {
        unsigned nodes = 0xff;
        for (std::size_t i = 0; i < 8; ++i)
          if ((set >> i & 1) == 0) nodes &= ~(1u << (8 * part + i) / 3);
        of[part][set] = static_cast<std::uint8_t>(nodes);
      }
  }
};
inline constexpr NodesInside kNodesInside;

// The vector code of one instruction set.
struct Kernels {
  Progress (*sum)(const std::uint8_t* at, std::size_t readable, std::size_t groups, std::uint16_t* sums);
  void (*midpoints)(const std::uint16_t* offsets, std::size_t nodes, const NarrowBlock& block, std::uint8_t* inside);
};

}  // namespace filiform::internal::narrow
