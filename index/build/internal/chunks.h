// Chunks: store segments by the position of their midpoints until input ends.
//
// A chunk is a block of the partition. A full chunk is split; its contents move to the halves once input ends. So the
// extent of the data need not be known beforehand.
#pragma once

#include "index/build/internal/segment_chain.h"
#include "index/geometry/partition.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform::internal {

struct Chunk {
  BlockKey key;
  GridBox box;   // grid points of the block
  GridBox seen;  // of the midpoints
  SegmentChain own, ghosts;
  std::uint32_t parent;  // among the splits
  int side;
  std::uint32_t first_leaf = 0, end_leaf = 0;

  // The smallest block that contains its midpoints; the chunk's block may be far larger.
  BlockKey core() const;
};

// Thread rule: thread-compatible. Throws IoError if the spool cannot be written or read.
class Chunks {
 public:
  // Keeps a reference. `most_open`: number of chunks that may have a buffer at a time.
  Chunks(Spool& spool, std::uint64_t most_segments, std::size_t most_open);

  // Adds a segment to the chunk of its midpoint. O(depth); O(1) for consecutive segments.
  void add(const SegmentRecord& record);
  // Call it once, after the last segment. Afterwards no chunk exceeds the limit, unless all its midpoints are equal.
  // Calls `progress` now and then with the number of segments done; an exception that it throws ends the work.
  void settle(const std::function<void(std::uint64_t done)>& progress);

  std::vector<Chunk>& all() { return chunks_; }
  const std::vector<Chunk>& all() const { return chunks_; }

 private:
  struct Split {
    std::int64_t plane;
    int axis;
    std::uint32_t child[2];  // among the splits, or kChunkBit | among the chunks
  };
  struct Remnant {  // contents of a chunk at its split
    SegmentChain chain;
    std::uint32_t split;
  };
  static constexpr std::uint32_t kChunkBit = std::uint32_t{1} << 31;
  static constexpr std::uint32_t kNone = UINT32_MAX;

  std::uint32_t addChunk(const BlockKey& key, std::uint32_t parent, int side);
  std::uint32_t chunkOf(std::uint32_t split, const GridPoint& middle) const;
  void put(std::uint32_t chunk, const SegmentRecord& record, const GridPoint& middle);
  void split(std::uint32_t chunk);
  void settleRemnants(const std::function<void(std::uint64_t)>& progress);

  Spool& spool_;
  std::uint64_t most_segments_;
  std::size_t most_open_;
  std::vector<Chunk> chunks_;
  std::vector<Split> splits_;
  std::vector<Remnant> remnants_;
  std::uint32_t last_ = 0;           // the chunk of the last segment
  std::vector<std::uint32_t> open_;  // chunks opened since buffers were closed; some occur more than once
  std::size_t closed_ = 0;           // number of chunks without a buffer, except one that is being split
};

}  // namespace filiform::internal
