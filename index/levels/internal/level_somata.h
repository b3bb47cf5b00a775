// Somata of levels of detail: balls instead of the segments inside them.
#pragma once

#include "index/levels/internal/level_input.h"
#include "index/levels/internal/neurites.h"

#include <span>
#include <vector>

namespace filiform::internal {

// The somata of a set, for its leaves. Thread rule: immutable after construction.
class LevelSomata {
 public:
  explicit LevelSomata(std::vector<SomaRoot> somata, const Grid& grid);

  // Adds the somata whose centres lie in the leaf as balls, and removes the segments inside the ball of their cell.
  // Other leaves keep such segments, so that no cell is missing in a block without its ball. O(n).
  void apply(Neurites& neurites, const BlockKey& leaf) const;

  // The somata whose centres lie in the block, ascending by cell. O(log n + k log k) for k.
  std::vector<SomaRoot> within(const BlockKey& block) const;

 private:
  Grid grid_;
  std::vector<SomaRoot> by_place_;  // ascending by Morton key
};

// Removes the segments inside the balls of these somata, which are ascending by cell. O(n).
void removeInsideBalls(Neurites& neurites, std::span<const SomaRoot> balls, const Grid& grid);

}  // namespace filiform::internal
