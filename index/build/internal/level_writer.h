// Makes the levels of detail of a set: bottom-up, in key order.
#pragma once

#include "index/set/tile_set.h"
#include "index/tile/internal/neurites.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace filiform {

// A root sample of type soma.
struct SomaRoot {
  std::uint32_t cell, sample;
  GridPoint p;
  float radius_um;
};

struct LevelOptions {
  std::uint64_t least_segments = 262144;                // below a level tile, in full resolution; the outermost: any
  unsigned threads = 1;                                 // does not affect the bytes
  std::uint64_t pack_bytes = std::uint64_t{256} << 20;  // a pack ends before the tile that would exceed this
  std::uint64_t memory = UINT64_MAX;                    // bytes for neurites and tiles at work
  // For the message: the memory of the process that leaves so many bytes to the levels. Empty: these bytes.
  std::function<std::uint64_t(std::uint64_t bytes)> memoryFor = {};
};

// Several threads may call the functions.
struct LevelInput {
  Grid grid;
  std::span<const BlockKey> leaves;                       // by TileId, ascending; without the long-segment tile
  std::function<Neurites(TileId)> neurites;               // leafNeurites() of each tile
  std::function<std::uint64_t(TileId)> bytes;             // an upper bound for these neurites in memory
  std::vector<SomaRoot> somata = {};                      // in any order
  std::function<void(std::uint64_t done)> progress = {};  // tiles; may throw to stop
};

// The neurites that a tile owns, simplified for the levels above its leaf. O(segments).
Neurites leafNeurites(std::span<const StoredSegment> segments, const TileAppearance& appearance, const BlockKey& leaf,
                      const Grid& grid);
Neurites leafNeurites(const Tile& tile, const TileAppearance& appearance);
// Bytes in memory of the neurites of this number of segments, at most.
std::uint64_t neuriteBytes(std::uint64_t segments);

// Makes level tiles of octree blocks (prefixes of 3, 6, ... bits) with at least two parts (leaves or such blocks) and
// least_segments, where a tile has several times fewer segments than the tiles below it. The outermost block always
// has one. E is the smaller of the block's edge and its content's extent.
// The tolerance is E / 512. If neurites overlap, hide() removes segments, with pixels of E / 512. The outermost block
// has further, coarser tiles, each 1.5 times the one before, until few segments remain.
//
// Writes levels.bin and levels-NNNNN.pack into the folder. Returns these files with their digests, for the manifest.
// Takes options.memory for the neurites on the way up and, for each thread, those of the tiles below one block. Fewer
// threads work if memory is short. Throws InputError if one does not suffice; the message names a memory that is still
// too small. Throws
// IoError, and what the input throws. O(segments).
std::vector<SetFile> writeLevels(const LevelInput& input, const LevelOptions& options, const std::string& folder);

}  // namespace filiform
