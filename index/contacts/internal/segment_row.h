// SegmentRow: segments in a row, packed so that one is tested against eight at once. Neighbours in the row lie close
// together.
#pragma once

#include "index/contacts/closest_places.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible.
struct SegmentRow {
  static constexpr std::size_t kFew = 8;
  template <class Value>
  using Few = std::array<Value, kFew>;

  struct Box {
    std::array<float, 3> lo{HUGE_VALF, HUGE_VALF, HUGE_VALF}, hi{-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};
    void extend(const Box& other);
  };
  struct Boxes {  // eight
    std::array<Few<float>, 3> lo, hi;
    Boxes();  // empty ones
    Box at(std::size_t lane) const;
    void extend(std::size_t lane, const Box& box);
  };
  struct Leaf {                              // eight segments
    std::array<Few<float>, 3> middle, half;  // um; half: of the way from child to parent
    Few<float> radius;                       // the larger one
    Few<std::uint32_t> cell;
    Box box(std::size_t lane) const;
  };

  std::uint32_t size = 0;
  std::vector<Leaf> leaves;
  std::array<std::vector<Boxes>, 2> boxes;  // of each leaf; of each eight leaves
  Box all;

  void add(std::uint32_t cell, const SegmentEnds& ends);
  void finish();  // makes the boxes
  std::uint32_t cell(std::uint32_t i) const { return leaves[i / kFew].cell[i % kFew]; }
  std::uint64_t bytes() const;
};

using NearSegments = std::array<std::uint32_t, 2>;  // of each row

// Calls visit(pairs), some at a time, for the pairs of segments of different cells that may lie within the distance:
// all pairs that do, and few others. The distance must include 2^-16 of the largest coordinate, for rounding. O(pairs
// of 64 and 64 segments, and what of them meets).
void findNear(const SegmentRow& a, const SegmentRow& b, float within_um,
              const std::function<void(std::span<const NearSegments>)>& visit);

}  // namespace filiform::internal
