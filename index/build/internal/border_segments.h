// Cuts chunks into leaves, and gives the segments at the border of a chunk to all chunks that they meet.
#pragma once

#include "index/build/internal/chunks.h"
#include "index/build/internal/segment_chain.h"
#include "index/geometry/internal/key_sort.h"
#include "index/geometry/partition.h"
#include "index/set/landmarks.h"

#include <cstddef>
#include <cstdint>
#include <functional>
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
  // Keeps references. `most_open`: number of chunks that may have a buffer at a time. `stop` is called now and then,
  // and may throw.
  BorderSegments(Chunks& chunks, const Partition& partition, Spool& spool, std::size_t most_open,
                 std::function<void()> stop);

  // Moves each segment to the ghosts of all chunks that store it, except its own.
  void deliver(SegmentChain& crossing);
  // The same, to chunks `begin` to `end` alone.
  void deliver(SegmentChain& crossing, std::size_t begin, std::size_t end);
  std::uint64_t visited() const { return visited_; }  // visited nodes of the partition

 private:
  Chunks& chunks_;
  const Partition& partition_;
  Spool& spool_;
  std::size_t most_open_;
  std::function<void()> stop_;
  std::uint64_t visited_ = 0;
};

}  // namespace filiform::internal
