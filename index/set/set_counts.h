// What a revision of a tile set states of itself: its totals and its files. Thread rule: values.
#pragma once

#include <cstdint>
#include <string>

namespace filiform {

// Totals of a tile set.
struct SetCounts {
  std::uint64_t cells = 0, samples = 0, segments = 0, isolated = 0, roots = 0;
  std::uint64_t removed = 0;                     // cells that were removed; `cells` does not count them
  std::uint64_t tiles = 0, stored_segments = 0;  // stored: owned and ghosts, isolated ones included
  std::uint64_t decoded_bytes = 0;               // of all tiles, once in memory
  bool operator==(const SetCounts&) const = default;
};

// One file of a revision.
struct SetFile {
  std::string name;                     // in the revision's folder; a section's name is section-NAME.bin
  std::uint64_t bytes = 0, digest = 0;  // digest: XXH3 of the file
  std::string revision = {};            // in whose folder it lies; empty: the revision's own
};

}  // namespace filiform
