// SegmentFilter: which segments a search considers. Thread rule: a value.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace filiform {

struct SegmentFilter {
  std::optional<std::vector<std::uint32_t>> cells{};  // ids, ascending; nullopt: all cells
  std::vector<std::uint16_t> types{};                 // of the segment's child, in any order; empty: all types
  // Which of these are wanted; empty: all. Called on any thread, for each segment that `cells` and `types` take,
  // whenever the tile that owns it is read; so it must always answer the same for a cell and a type. Its exceptions end
  // the search.
  std::function<bool(std::uint32_t cell, std::uint16_t type)> wants{};

  // Two filters with functions are never equal.
  bool operator==(const SegmentFilter& other) const {
    return !wants && !other.wants && cells == other.cells && types == other.types;
  }
  bool takesAll() const { return !cells && types.empty() && !wants; }
};

}  // namespace filiform
