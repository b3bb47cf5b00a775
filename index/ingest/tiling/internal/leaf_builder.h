// Builds the content of neighbouring leaves from their segments, within a bounded share of memory.
//
// Usually all segments of the leaves are in memory together. If they, or the content of the leaves, exceed the share,
// the leaves are divided into parts. The segments then go through the spool once more, each to all parts that store it.
// The smallest part is one leaf: its tile must fit the memory.
#pragma once

#include "index/geometry/partition.h"
#include "index/ingest/tiling/internal/leaf_content.h"
#include "index/ingest/tiling/landmarks.h"
#include "index/internal/memory_budget.h"
#include "index/tile/internal/segment_chain.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace filiform::internal {

// Thread rule: thread-compatible; one for each worker. Throws IoError if the spool cannot be written or read.
class LeafBuilder {
 public:
  // Receives the content of one leaf; its vectors may be moved from.
  using HandOver = std::function<void(LeafContent& content)>;

  // Keeps references. `long_segments` gets each segment that meets too many leaves, once, from the leaf of its
  // midpoint. `capacity`: of a leaf.
  LeafBuilder(const Partition& partition, Spool& spool, SegmentChain& long_segments, std::uint64_t capacity,
              HandOver hand_over);

  // Neighbouring leaves: a range of positions in partition.leaves().
  struct Range {
    std::uint32_t first, end;
    BlockKey core;  // contains the midpoints of all segments that these leaves own
  };
  // Bytes needed to build leaves from this number of segments together; each segment is stored about twice.
  std::uint64_t cost(std::uint64_t segments) const;
  // Bytes needed to build one leaf that stores this number of segments.
  static std::uint64_t tileCost(std::uint64_t stored) { return stored * kBytesInTile; }

  // For each leaf of the range: the segments that its tile stores, and those of its own that go to the long-segment
  // tile.
  struct Counts {
    std::vector<std::uint32_t> stored, too_long;
  };
  // O(segments), with 60 bytes a leaf in memory.
  Counts count(std::span<SegmentChain* const> chains, const Range& range);
  // Passes each leaf with content on, and empties the chains. Uses the memory of `hold`, and frees it while it waits
  // for more. Throws InputError if one leaf needs more than the whole budget.
  void build(std::span<SegmentChain* const> chains, const Range& range, MemoryBudget::Hold& hold);
  // Frees the memory kept between ranges.
  void release();

  std::uint64_t visited() const { return visited_; }  // visited nodes of the partition

  // Throws the InputError for a tile that does not fit.
  [[noreturn]] static void refuse(std::uint64_t stored, std::uint64_t needed_memory);
  // Returns the value of --memory that gives the budget this number of bytes; set by the owner.
  std::function<std::uint64_t(std::uint64_t bytes)> memoryFor;

 private:
  // Bytes for a segment of a tile under construction, and for a buffered segment.
  static constexpr std::uint64_t kBytesInTile = 420, kBytesOfRecord = sizeof(SegmentRecord);
  static constexpr std::uint64_t kBytesOfPlace = 24;  // 8, three times while a vector grows
  static constexpr std::uint64_t kBytesTogether = 160;
  static constexpr std::uint32_t kOwned = std::uint32_t{1} << 31;

  void enter(const Range& range);
  template <typename Use>
  bool forEachLeaf(const SegmentRecord& record, const Use& use);
  void fill(std::uint32_t leaf, std::span<std::uint32_t> items);
  bool buildTogether(std::span<SegmentChain* const> chains, std::uint64_t most_bytes);
  void divide(std::span<SegmentChain* const> chains, const Range& range, MemoryBudget::Hold& hold);
  struct Part {
    std::uint32_t first, end;        // leaves
    std::uint64_t stored, too_long;  // of all of them
    std::uint64_t largest;           // stored by one leaf
    bool fits;                       // a thread's share
    std::uint64_t bytes() const { return (stored + too_long) * (kBytesOfRecord + kBytesOfPlace) + tileCost(largest); }
  };
  std::vector<Part> partsOf(std::span<SegmentChain* const> chains, const Range& range, std::uint64_t share);
  void buildAlone(SegmentChain& chain, const Part& part, const Range& range, MemoryBudget::Hold& hold);

  const Partition& partition_;
  Spool& spool_;
  SegmentChain& long_segments_;
  std::uint64_t capacity_;
  HandOver hand_over_;
  std::uint64_t visited_ = 0;

  // Of the current range.
  std::uint32_t first_ = 0, end_ = 0, owner_ = 0;
  std::vector<Partition::Subtree> path_;  // to the range
  GridBox core_;
  std::vector<GridBox> closed_;

  std::vector<SegmentRecord> records_;
  std::vector<std::uint32_t> items_;          // by leaf: owned | position in records_
  std::vector<std::uint64_t> placed_;         // leaf << 32 | item
  std::vector<std::uint32_t> stored_, ends_;  // by leaf of the range: number and end of its items
  std::vector<std::uint32_t> long_, met_;
  std::vector<std::size_t> runs_;
  LeafContent content_;
};

}  // namespace filiform::internal
