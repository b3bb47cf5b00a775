// SegmentRun: what a leaf of a tile's search tree holds. Thread rule: a value.
#pragma once

#include <cstdint>

namespace filiform {

// One to eight consecutive segments of one fragment: the content of a leaf of the search tree.
struct SegmentRun {
  std::uint32_t begin_and_count;  // 8 * first segment + count - 1

  std::uint32_t begin() const { return begin_and_count >> 3; }
  std::uint32_t count() const { return (begin_and_count & 7) + 1; }
};

}  // namespace filiform
