// What levels of detail are made from.
#pragma once

#include "index/geometry/grid.h"
#include "index/geometry/morton.h"
#include "index/levels/internal/neurites.h"
#include "index/tile/tile.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace filiform {

// A root sample of type soma.
struct SomaRoot {
  std::uint32_t cell, sample;
  GridPoint p;
  float radius_um;
};

// Several threads may call the functions.
struct LevelInput {
  Grid grid;
  std::span<const BlockKey> leaves;                       // by TileId, ascending; without the long-segment tile
  std::span<const std::uint32_t> segments;                // by TileId: owned, isolated ones included
  std::function<Neurites(TileId)> neurites;               // of each tile, thinned() to leafTolerances_um()
  std::function<std::uint64_t(TileId)> points;            // of these neurites, or an upper bound
  std::vector<SomaRoot> somata = {};                      // in any order
  std::function<void(std::uint64_t done)> progress = {};  // tiles; may throw to stop
};

}  // namespace filiform
