// TilePacker: encodes tiles as they arrive, and passes them on in the order of their ids.
//
// The tiles of the range of leaves that is next in order are passed on at once. Tiles of later ranges wait in a spool.
#pragma once

#include "index/file/internal/spool.h"
#include "index/ingest/tiling/internal/tile_sink.h"
#include "index/levels/internal/neurites.h"
#include "index/set/tile_store.h"

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace filiform::internal {

// Thread rule: as TileSink for add(), begin() and end(); everything else is thread-compatible. Throws IoError if the
// spool cannot be written or read.
class TilePacker final : public TileSink {
 public:
  // Receives the encoded tiles in the order of their ids, one call at a time, on any thread. The long-segment tile has
  // the number of leaves for `leaf`.
  using Write = std::function<void(const TileEntry& entry, std::uint32_t leaf, ByteSpan geometry, ByteSpan appearance)>;

  struct Options {
    Grid grid;
    unsigned workers = 1;
    std::string folder;  // for the files of the spools
    // Bytes of tiles that wait, and of neurites, which stay in memory.
    std::uint64_t memory = 0;
    // By leaf. If not empty, keep the neurites of each tile within this tolerance, for levels of detail.
    std::vector<float> tolerances_um;
    std::uint32_t leaves = 0;
    bool hold = false;  // all tiles wait until passHeld()
  };
  TilePacker(Options options, Write write);

  void begin(unsigned worker, std::uint32_t first) override;
  void add(unsigned worker, LeafContent& content) override;
  void end(unsigned worker, std::uint32_t end) override;

  // With Options::hold, after the last end(): the bytes of each tile, in order.
  std::vector<std::uint64_t> heldSizes() const;
  void passHeld();
  // Takes the next tile, which another rank has made. `neurites` are packed; they are kept as those of own tiles.
  void take(std::uint32_t leaf, std::uint32_t neurite_points, ByteSpan neurites);

  // After the last end(). By leaf, and for the long-segment tile; kNoTile for leaves without segments.
  const std::vector<TileId>& tile_of() const { return tile_of_; }
  // For levels of detail: the neurites of a tile, and the number of their points. Several threads may call them.
  void closeNeurites();  // call it once, before
  Neurites neurites(TileId tile) const { return unpacked(packedNeurites(tile)); }
  Bytes packedNeurites(TileId tile) const;
  std::uint32_t neurite_points(TileId tile) const { return kept_[tile].points; }

 private:
  static constexpr std::size_t kBlockBytes = std::size_t{64} << 10;
  struct Kept {  // neurites of a tile
    unsigned worker;
    std::uint32_t points;
    std::uint64_t offset, bytes;
  };
  struct Waiting {
    TileEntry entry;
    std::uint32_t leaf;
    Kept neurites;
    std::size_t geometry_bytes, appearance_bytes;
  };
  struct Range {  // tiles of neighbouring leaves, in order
    explicit Range(Spool& spool) : bytes(spool) {}
    std::uint32_t end = 0;
    ByteChain bytes;
    std::deque<Waiting> tiles;  // a growing vector would need twice the memory
  };
  struct Worker {
    std::uint32_t first = 0;
    Range range;
    ByteChain neurites;
  };

  void pass(const Waiting& tile, ByteSpan geometry, ByteSpan appearance);
  void passAll(Range& range);

  Options options_;
  Write write_;
  Spool waiting_spool_, neurites_spool_;
  std::deque<Worker> workers_;
  std::mutex mutex_;
  std::map<std::uint32_t, Range> waiting_;  // by first leaf; guarded by mutex_
  static constexpr std::uint32_t kNone = UINT32_MAX;
  std::atomic<std::uint32_t> head_{0};  // first leaf of the range that is passed on; changed under mutex_
  // Of the thread that has the range at the head.
  std::vector<TileId> tile_of_;
  std::deque<Kept> kept_;
  TileId next_ = 0;
};

}  // namespace filiform::internal
