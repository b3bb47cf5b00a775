// ContactOptions: which contacts are wanted. Thread rule: a value.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform {

struct ContactOptions {
  enum class Detail : std::uint8_t {
    kCounts,  // sites have their cells and number of pairs alone
    kSites,   // all but places, sample ids and paths: cells are not read as wholes
    kPlaces,
  };

  double within_um = 0;  // above 0; a distance of exactly this is within
  // Distances are between surfaces: round cones between the radii of child and parent. An unknown radius counts 0.
  bool surface = false;
  std::vector<std::uint32_t> from{}, to{};              // cells, ascending, each below cell_count()
  std::vector<std::uint16_t> from_types{}, to_types{};  // ascending; empty: all
  Detail detail = Detail::kPlaces;
  std::uint64_t memory_bytes = std::uint64_t{1} << 30;
  unsigned threads = 1;  // at least 1
  // Called now and then on the calling thread, with the tiles done so far; its exceptions end the search.
  std::function<void(std::uint64_t done, std::uint64_t tiles)> check{};

  // Both sides have the same cells and types.
  bool sidesAreAlike() const { return from == to && from_types == to_types; }
};

}  // namespace filiform
