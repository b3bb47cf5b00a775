// Finds the leaves that store the most segments across borders of chunks, at a small part of the cost of counting all
// leaves.
#pragma once

#include "index/geometry/partition.h"
#include "index/tile/internal/segment_chain.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace filiform::internal {

class CrowdedLeaves {
 public:
  // Keeps references; chains must be closed. Reads each on a thread of its own. `stop` is called now and then, on these
  // threads, and may throw.
  CrowdedLeaves(const Partition& partition, std::span<SegmentChain> crossing, std::function<void()> stop);

  // Number of segments that the fullest leaf stores, estimated from one segment in 64.
  std::uint64_t estimate() const { return estimate_; }
  // The same, counted exactly for the leaves that may be the fullest. chunkOf(leaf) has its segments; `crossing` holds
  // those of them that are not strictly inside the chunk's closed block. O(segments), and the cost of looking for
  // leaves for those that these leaves store.
  struct Chunk {
    SegmentChain* own;
    GridBox closed_block;
  };
  std::uint64_t count(const std::function<Chunk(std::uint32_t leaf)>& chunkOf);
  std::uint64_t visited() const { return visited_; }  // visited nodes of the partition

 private:
  struct Work {
    std::vector<std::uint32_t> met{};
    std::uint64_t visited = 0;
  };
  template <typename Use>
  void forEachMet(const SegmentRecord& record, Work& work, const Use& use);
  template <typename Use>
  void forEachRecord(SegmentChain& chain, const Use& use);

  const Partition& partition_;
  std::span<SegmentChain> crossing_;
  std::function<void()> stop_;
  std::vector<std::uint32_t> leaves_;
  std::uint64_t estimate_ = 0;
  std::atomic<std::uint64_t> visited_{0};
};

// True if the segment meets only this closed block.
inline bool strictlyInside(const GridBox& closed, const GridPoint& a, const GridPoint& b) {
  return closed.containsInside(a) && closed.containsInside(b);
}

}  // namespace filiform::internal
