// Somata of levels of detail: balls instead of the segments inside them.
#pragma once

#include "index/build/internal/level_writer.h"
#include "index/tile/internal/neurites.h"

#include <vector>

namespace filiform::internal {

// The somata of a set, for its leaves. Thread rule: immutable after construction.
class LevelSomata {
 public:
  explicit LevelSomata(std::vector<SomaRoot> somata, const Grid& grid);

  // Removes the segments between samples inside a soma of their cell, and adds the somata whose centres lie in the leaf
  // as balls. O(n).
  void apply(Neurites& neurites, const BlockKey& leaf) const;

 private:
  void removeInside(Neurites& neurites) const;

  Grid grid_;
  std::vector<SomaRoot> by_cell_, by_place_;  // ascending by cell; by Morton key
};

}  // namespace filiform::internal
