// Makes the levels of detail of a set from its full-resolution tiles, bottom-up, in the order of their keys.
#pragma once

#include "index/simplify.h"
#include "index/tile_set.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

struct LevelOptions {
  std::uint32_t most_segments = 2048;                   // a tile
  unsigned threads = 1;                                 // the bytes do not depend on it
  std::uint64_t pack_bytes = std::uint64_t{256} << 20;  // a pack ends before the tile that would exceed this
  std::uint64_t memory = UINT64_MAX;                    // bytes for graphs and tiles at work
  // For the message: the memory of the process that leaves so many bytes to the levels. Empty: these bytes.
  std::function<std::uint64_t(std::uint64_t bytes)> memoryFor = {};
};

// The tiles that levels are made of; calls may come from several threads.
struct LevelInput {
  Grid grid;
  std::span<const CellKey> leaves;  // by TileId, ascending; without the long-segment tile
  std::function<std::shared_ptr<const Tile>(TileId)> load;
  std::function<TileAppearance(TileId)> loadAppearance;
  std::function<std::uint64_t(TileId)> stored;            // segments
  std::function<void(std::uint64_t done)> progress = {};  // tiles; may throw to stop
};

// Every octree cell (a prefix of 3, 6, ... bits) that holds at least two leaves or such cells becomes a tile. The
// tolerance is a 512th of the cell's edge, or of its content's rounded up to a power of two; eight times that where the
// threads are too many. Memory: options.memory, for the graphs on the way up, at most eight a level of the octree, and
// those of the tiles below one cell for each thread. Throws InputError, naming the memory, where that is not enough:
// fewer threads are at work before. Writes levels.bin and levels-NNNNN.pack into the folder and answers them with their
// digests, for the manifest. Throws IoError, and what the input throws. O(segments).
std::vector<SetFile> writeLevels(const LevelInput& input, const LevelOptions& options, const std::string& folder);

}  // namespace filiform
