// Makes the levels of detail of a set from its full-resolution tiles: bottom-up, in key order.
#pragma once

#include "index/set/tile_set.h"
#include "index/tile/internal/simplify.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

struct LevelOptions {
  std::uint32_t most_segments = 2048;                   // a tile
  unsigned threads = 1;                                 // does not affect the bytes
  std::uint64_t pack_bytes = std::uint64_t{256} << 20;  // a pack ends before the tile that would exceed this
  std::uint64_t memory = UINT64_MAX;                    // bytes for graphs and tiles at work
  // For the message: the memory of the process that leaves so many bytes to the levels. Empty: these bytes.
  std::function<std::uint64_t(std::uint64_t bytes)> memoryFor = {};
};

// The full-resolution tiles; several threads may call the functions.
struct LevelInput {
  Grid grid;
  std::span<const BlockKey> leaves;  // by TileId, ascending; without the long-segment tile
  std::function<std::shared_ptr<const Tile>(TileId)> load;
  std::function<TileAppearance(TileId)> loadAppearance;
  std::function<std::uint64_t(TileId)> stored;            // segments
  std::function<void(std::uint64_t done)> progress = {};  // tiles; may throw to stop
};

// Makes a level tile of every octree block (a prefix of 3, 6, ... bits) with at least two parts: leaves or such blocks.
// The tolerance is 1/512 of the smaller of the block's edge and its content's extent, rounded up to a power of two. It
// is up to eight times that if there are too many segments.
//
// Writes levels.bin and levels-NNNNN.pack into the folder. Returns these files with their digests, for the manifest.
// Takes options.memory for the graphs on the way up (at most eight a level of the octree) and, for each thread, those
// of the tiles below one block. Fewer threads work if memory is short. Throws InputError, naming the memory needed, if
// one does not suffice. Throws IoError, and what the input throws. O(segments).
std::vector<SetFile> writeLevels(const LevelInput& input, const LevelOptions& options, const std::string& folder);

}  // namespace filiform
