// Cuts chunks into leaves, and gives the segments at the border of a chunk to all chunks that they meet.
#pragma once

#include "index/geometry/internal/key_sort.h"
#include "index/geometry/partition.h"
#include "index/ingest/tiling/internal/chunks.h"
#include "index/ingest/tiling/landmarks.h"
#include "index/tile/internal/segment_chain.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace filiform::internal {

struct CutLeaves {  // of a chunk, ascending
  std::vector<BlockKey> keys;
  std::vector<std::uint32_t> midpoints;  // in each leaf
};
struct CutWork {  // of one thread: 32 bytes a segment of the largest chunk, kept for the next one
  std::vector<MortonKey> keys;
  KeySorter sorter;
};
// Cuts a chunk into leaves. Adds the keys of its midpoints to `survey`, and the segments that touch its
// border to `crossing`. O(segments). Throws IoError.
CutLeaves cutChunk(Chunk& chunk, std::uint32_t capacity, LandmarkSurvey& survey, SegmentChain& crossing, CutWork& work);

// Thread rule: thread-compatible. Throws IoError.
class BorderSegments {
 public:
  struct Options {
    std::size_t most_open;  // number of chunks that may have a buffer at a time
    unsigned threads;
    std::function<void(unsigned worker, std::uint64_t segments)> moved;  // as Chunks::Moved
  };

  // Keeps references. Requires leaves in all chunks.
  BorderSegments(Chunks& chunks, const Partition& partition, Spool& spool, Options options);

  // Moves each segment to the ghosts of all chunks that store it, except its own. Works on all threads. A segment that
  // few leaves store may go to more chunks.
  void deliver(std::span<SegmentChain> crossing);
  // The same on the calling thread, to chunks `begin` to `end` alone.
  void deliver(SegmentChain& crossing, std::size_t begin, std::size_t end);
  std::uint64_t visited() const { return visited_; }  // visited nodes of the partition

 private:
  struct Work {
    unsigned worker;
    std::size_t most_open;
    std::vector<std::uint32_t> met{};
    std::uint64_t visited = 0, moved = 0;
  };
  template <typename Use>
  void forEachChunk(SegmentChain& crossing, Work& work, const Use& use);
  void sortOut(SegmentChain& crossing, std::size_t begin, std::size_t step, std::span<SegmentChain> groups, Work& work);
  void deliver(SegmentChain& crossing, std::size_t begin, std::size_t end, Work& work);

  std::vector<Chunk>& chunks_;
  Spool& spool_;
  Options options_;
  std::vector<std::uint32_t> chunk_of_;  // of each block
  Partition blocks_;                     // that chunks consist of
  std::atomic<std::uint64_t> visited_{0};
};

}  // namespace filiform::internal
