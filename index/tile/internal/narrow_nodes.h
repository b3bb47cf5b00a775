// Vector code for the nodes of tiles whose offsets have at most 16 bits: decodes the steps between nodes, and tests
// midpoints. One source is compiled for every instruction set that Highway knows, and chosen when the program runs; all
// give the same bits. Thread rule: functions without state.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/geometry/grid.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform::internal {

inline constexpr std::size_t kStepGroup = 8;    // steps that share their widths
inline constexpr int kNarrowStepBits = 17;      // a step between 16-bit offsets, as zigzag
inline constexpr int kStepWidthBits = 5;        // of a width in the head of a group
inline constexpr unsigned kWideSteps = 0x8000;  // a group's head: the widths follow, a byte each

// The room for the running sums of this many steps, in entries of four numbers.
constexpr std::size_t sumsRoom(std::size_t steps) { return 1 + (steps + kStepGroup - 1) / kStepGroup * kStepGroup; }
// Reads groups of steps. Entry k of `sums` becomes x, y and z of the sum of the first k steps, modulo 2^16, and 0.
// Requires sumsRoom(steps) entries. Throws Damage if the bytes end too early or a step is wider than kNarrowStepBits.
// `set`: an instruction set, below narrowSets(); otherwise the fastest. O(steps).
void sumSteps(ByteReader& in, std::size_t steps, std::uint16_t* sums, std::size_t set = SIZE_MAX);

// A block as bounds of 16-bit offsets, repeated for eight nodes.
struct NarrowBlock {
  std::array<std::uint16_t, 24> lo{}, range{};
  bool empty = false;  // no offset lies in the block; the bounds are then not valid

  NarrowBlock(const GridBox& block, const GridPoint& origin);
};
// Bit i of `inside`: the midpoint of nodes i and i + 1, rounded down, lies in the block. Later bits are not specified.
// Reads x, y, z of nodes + 8 nodes. O(nodes). `set` as above.
void findMidpoints(const std::uint16_t* offsets, std::size_t nodes, const NarrowBlock& block,
                   std::vector<std::uint32_t>& inside, std::size_t set = SIZE_MAX);

std::size_t narrowSets();  // instruction sets that this machine runs

}  // namespace filiform::internal
