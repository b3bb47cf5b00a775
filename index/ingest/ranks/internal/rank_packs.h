// packTogether: the tiles of all ranks go to packs, as one process would write them.
#pragma once

#include "index/ingest/tiling/internal/tile_packer.h"
#include "index/ingest/tiling/internal/tile_writer.h"
#include "index/ranks/ranks.h"

#include <cstdint>
#include <memory>
#include <string>

namespace filiform::internal {

struct RankPacks {
  Ranks& ranks;
  TilePacker& packer;  // of a rank other than 0: holds its tiles
  std::string folder;  // of the revision
  std::uint64_t pack_bytes;
  std::uint64_t memory;  // bytes of tiles and neurites under way, which stay in memory
  std::uint32_t leaves;  // of all ranks
  bool neurites;
};

// For rank 0, whose writer has the tiles of this rank: adds the tiles of the others to the writer and the packer.
void packTogether(const RankPacks& packs, TileWriter& writer);

// For the others. A pack is written by the rank of its first tile. The packer must pass its tiles to add().
class RankPacker {
 public:
  explicit RankPacker(const RankPacks& packs);
  RankPacker(const RankPacker&) = delete;
  RankPacker& operator=(const RankPacker&) = delete;
  ~RankPacker();

  void run();
  void add(const TileEntry& entry, std::uint32_t leaf, ByteSpan geometry, ByteSpan appearance);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::internal
