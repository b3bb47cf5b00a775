// Where segments wait, by the place of their midpoints, until all of them are known.
//
// A chunk is a cell of the partition. It is halved like a leaf once it holds more than a chunk may, so that nothing
// need be known beforehand of where the data are. What a halved chunk held moves to its halves when everything is read.
#pragma once

#include "index/internal/segment_chain.h"
#include "index/partition.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform::internal {

struct Chunk {
  CellKey key;
  GridBox box;   // grid points of the cell
  GridBox seen;  // of the midpoints
  SegmentChain own, ghosts;
  std::uint32_t parent;  // among the splits
  int side;
  std::uint32_t first_leaf = 0, end_leaf = 0;

  // The smallest cell that holds its midpoints: the chunk's may be far larger.
  CellKey core() const;
};

// Thread-compatible. Throws IoError when the spool cannot be written or read.
class Chunks {
 public:
  // Keeps a reference. `most_open`: chunks that may have a buffer at a time.
  Chunks(Spool& spool, std::uint64_t most_segments, std::size_t most_open);

  // Adds a segment to the chunk of its midpoint. O(depth), O(1) where segments follow one another.
  void add(const SegmentRecord& record);
  // Once, after the last segment: no chunk is then larger than it may be, unless its midpoints are all equal. Calls
  // `progress` now and then, with the segments done; what it throws ends the work.
  void settle(const std::function<void(std::uint64_t done)>& progress);

  std::vector<Chunk>& all() { return chunks_; }
  const std::vector<Chunk>& all() const { return chunks_; }

 private:
  struct Split {
    std::int64_t plane;
    int axis;
    std::uint32_t child[2];  // among the splits, or kChunkBit | among the chunks
  };
  struct Remnant {  // what a chunk held when it was split
    SegmentChain chain;
    std::uint32_t split;
  };
  static constexpr std::uint32_t kChunkBit = std::uint32_t{1} << 31;
  static constexpr std::uint32_t kNone = UINT32_MAX;

  std::uint32_t addChunk(const CellKey& key, std::uint32_t parent, int side);
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
  std::uint32_t last_ = 0;           // that a segment was added to
  std::vector<std::uint32_t> open_;  // chunks that were begun since buffers were closed; some of them more than once
  std::size_t closed_ = 0;           // of the chunks, these have no buffer, but for one that is being split
};

}  // namespace filiform::internal
