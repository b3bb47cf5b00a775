// TileStack: encodes tiles as they arrive, and stores the bytes until their positions in the packs are known.
#pragma once

#include "index/build/internal/tile_writer.h"
#include "index/build/internal/tiler.h"
#include "index/file/internal/spool.h"
#include "index/tile/internal/neurites.h"

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

namespace filiform::internal {

// Thread rule: as TileSink for add(); everything else is thread-compatible. Throws IoError if the spool cannot be
// written or read.
class TileStack final : public TileSink {
 public:
  // `folder`: for the spool's file. Encoded tiles stay in memory up to `memory` bytes.
  // `tolerances_um`: by leaf; if not empty, also keep the neurites of each tile within it, for levels of detail.
  TileStack(const Grid& grid, unsigned workers, const std::string& folder, std::uint64_t memory,
            std::vector<float> tolerances_um);

  void add(unsigned worker, LeafUnit& unit) override;

  struct Encoded {
    TileEntry entry;
    std::uint32_t leaf;
    unsigned heap;
    std::uint64_t offset;
    std::uint32_t neurite_points;
    std::size_t geometry_bytes, appearance_bytes, neurite_bytes;
  };
  // All tiles, by leaf; the position is the tile's id. Call it once, after the last add().
  std::vector<Encoded> finish();
  // Passes one tile to the writer; after finish().
  void write(TileId id, const Encoded& tile, TileWriter& writer);
  // The neurites of a tile, for levels of detail; after finish(). Several threads may call it.
  Neurites neurites(const Encoded& tile) const;

 private:
  static constexpr std::size_t kBlockBytes = std::size_t{64} << 10;
  struct Heap {
    ByteChain bytes;
    std::deque<Encoded> tiles;  // a growing vector would need twice the memory
  };
  Grid grid_;
  std::vector<float> tolerances_um_;
  Spool spool_;
  std::vector<Heap> heaps_;
  Spool::Buffer scratch_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace filiform::internal
