// Makes the levels of detail of a set: bottom-up, in key order.
#pragma once

#include "index/levels/internal/level_input.h"
#include "index/set/tile_set.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform {

struct LevelOptions {
  std::uint64_t least_segments = 262144;                // below a level tile, in full resolution; the outermost: any
  unsigned threads = 1;                                 // does not affect the bytes
  std::uint64_t pack_bytes = std::uint64_t{256} << 20;  // a pack ends before the tile that would exceed this
  std::uint64_t memory = UINT64_MAX;                    // bytes for neurites and tiles at work
  // For the message: the memory of the process that leaves so many bytes to the levels. Empty: these bytes.
  std::function<std::uint64_t(std::uint64_t bytes)> memoryFor = {};
};

// Makes level tiles of octree blocks (LevelBlocks says which) with at least two parts (leaves or such blocks), where a
// tile has several times fewer segments than the tiles below it. The outermost block always has one. E is the smaller
// of the block's edge and its content's extent. The tolerance is E / 512, or E / 256 without level tiles below. If
// neurites overlap, hide() removes segments, with pixels of E / 512. The tile is then stored in parts, each a tile. The
// outermost block has further, coarser tiles in one piece, each 1.5 times the one before, until few segments remain.
//
// Writes levels.bin and levels-NNNNN.pack into the folder. Returns these files with their digests, for the manifest.
// Takes options.memory for the neurites of one block and, for each thread, those of the leaves below one block. The
// neurites of finished blocks wait in an unnamed file. Fewer threads work if memory is short. Throws InputError if one
// does not suffice; the message names a memory that is still too small. Throws IoError, and what the input throws.
// O(segments).
std::vector<SetFile> writeLevels(const LevelInput& input, const LevelOptions& options, const std::string& folder);

}  // namespace filiform
