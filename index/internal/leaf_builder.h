// From the segments of neighbouring leaves to what each leaf stores, in a bounded share of memory.
//
// Usually all segments of the leaves are in memory together. Where they, or what the leaves store of them, take more
// than the share, the leaves are divided into parts, and the segments go through the spool once more, each to all parts
// that store it. The smallest part is one leaf: its tile must fit the memory as a whole.
#pragma once

#include "index/internal/memory_gate.h"
#include "index/internal/segment_chain.h"
#include "index/partition.h"
#include "index/samples.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace filiform::internal {

// Thread-compatible: one for each worker. Throws IoError when the spool cannot be written or read.
class LeafBuilder {
 public:
  // Segments ascend by id; attributes are the children's. May be moved from.
  using HandOver =
      std::function<void(std::uint32_t leaf, std::vector<StoredSegment>& segments, TileAppearance& appearance)>;

  // Keeps references. `long_segments` gets each segment that meets too many leaves, once, from where its midpoint is.
  // `tile_segments`: what a tile stores as a rule.
  LeafBuilder(const Partition& partition, Spool& spool, SegmentChain& long_segments, std::uint64_t tile_segments,
              HandOver hand_over);

  // Neighbouring leaves, as positions in partition.leaves().
  struct Range {
    std::uint32_t first, end;
    CellKey core;  // holds the midpoints of all segments that these leaves own
  };
  // Bytes that it takes to build leaves from so many segments together, where each segment is stored about twice.
  std::uint64_t cost(std::uint64_t segments) const;
  // Bytes that it takes to build one leaf that stores so many.
  static std::uint64_t tileCost(std::uint64_t stored) { return stored * kBytesInTile; }

  // For each leaf of the range: the segments that its tile stores, and those of its own that go to the long-segment
  // tile.
  struct Counts {
    std::vector<std::uint32_t> stored, too_long;
  };
  // O(segments), with 56 bytes a leaf in memory.
  Counts count(std::span<SegmentChain* const> chains, const Range& range);
  // Hands over each leaf that stores anything, and empties the chains. Takes what memory `pass` allows; gives it back
  // while it waits for more. Throws InputError when one leaf takes more than pass's gate has at all.
  void build(std::span<SegmentChain* const> chains, const Range& range, MemoryGate& gate, MemoryGate::Pass& pass);
  // Frees the memory that is kept from one range to the next.
  void release();

  std::uint64_t visited() const { return visited_; }  // nodes of the partition

  // A tile that was refused says so.
  [[noreturn]] static void refuse(std::uint64_t stored, std::uint64_t needed_memory);
  // --memory that gives the gate so many bytes; set by the owner.
  std::function<std::uint64_t(std::uint64_t bytes)> memoryFor;

 private:
  // Of a tile with all that is needed to make it, and of a segment beside it.
  static constexpr std::uint64_t kBytesInTile = 420, kBytesOfRecord = sizeof(SegmentRecord);
  static constexpr std::uint64_t kBytesOfPlace = 24;  // 8, three times while a vector grows
  static constexpr std::uint64_t kBytesTogether = 160;
  static constexpr std::uint32_t kOwned = std::uint32_t{1} << 31;

  void enter(const Range& range);
  template <typename Use>
  bool forEachLeaf(const SegmentRecord& record, const Use& use);
  bool buildTogether(std::span<SegmentChain* const> chains, std::uint64_t most_bytes);
  void divide(std::span<SegmentChain* const> chains, const Range& range, MemoryGate& gate, MemoryGate::Pass& pass);
  struct Part {
    std::uint32_t first, end;        // leaves
    std::uint64_t stored, too_long;  // of all of them
    std::uint64_t largest;           // stored by one leaf
    bool fits;                       // a thread's share
    std::uint64_t bytes() const { return (stored + too_long) * (kBytesOfRecord + kBytesOfPlace) + tileCost(largest); }
  };
  std::vector<Part> partsOf(std::span<SegmentChain* const> chains, const Range& range, std::uint64_t share);
  void buildAlone(SegmentChain& chain, const Part& part, const Range& range, MemoryGate& gate, MemoryGate::Pass& pass);

  const Partition& partition_;
  Spool& spool_;
  SegmentChain& long_segments_;
  std::uint64_t tile_segments_;
  HandOver hand_over_;
  std::uint64_t visited_ = 0;

  // Of the range at hand.
  std::uint32_t first_ = 0, end_ = 0, owner_ = 0;
  Partition::Subtree subtree_{};
  GridBox core_;
  std::vector<GridBox> closed_;

  std::vector<SegmentRecord> records_;
  std::vector<std::uint64_t> placed_, ordered_;  // leaf << 32 | owned | place in records_
  std::vector<std::uint32_t> begin_, long_, met_;
  std::vector<std::size_t> runs_;
  std::vector<StoredSegment> segments_;
  TileAppearance appearance_;
};

}  // namespace filiform::internal
