// Sorts many Morton keys. Thread rule: thread-compatible.
#pragma once

#include "index/geometry/morton.h"

#include <cstdint>
#include <vector>

namespace filiform::internal {

// Keeps its working memory, 16 bytes for each key of the largest sort.
class KeySorter {
 public:
  // Sorts ascending. O(n) if the keys differ in few bits, as in a small part of the world.
  void sort(std::vector<MortonKey>& keys);

 private:
  std::vector<std::uint64_t> low_, other_;
};

// For keys that are sorted once.
inline void sortKeys(std::vector<MortonKey>& keys) { KeySorter().sort(keys); }

}  // namespace filiform::internal
