// SegmentFilter: which segments a search considers. Thread rule: a value.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace filiform {

struct SegmentFilter {
  std::optional<std::vector<std::uint32_t>> cells{};  // ids, ascending; nullopt: all cells
  std::vector<std::uint16_t> types{};                 // of the segment's child, in any order; empty: all types

  bool operator==(const SegmentFilter&) const = default;
  bool takesAll() const { return !cells && types.empty(); }
};

}  // namespace filiform
