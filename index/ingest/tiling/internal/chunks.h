// Chunks: store segments by the position of their midpoints until input ends.
//
// The extent of the data need not be known beforehand. While segments arrive, a block with too many of them is halved;
// what it holds stays. Once input ends, the largest blocks within the limit become the chunks. A chunk takes all that
// its halves hold, without reading it. Only what lies in larger blocks is moved to the chunks.
#pragma once

#include "index/geometry/partition.h"
#include "index/tile/internal/segment_chain.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform::internal {

struct Chunk {
  BlockKey key;
  GridBox seen;  // of the midpoints
  SegmentChain own, ghosts;
  std::uint32_t first_leaf = 0, end_leaf = 0;

  // The smallest block that contains its midpoints; the chunk's block may be far larger.
  BlockKey core() const;
};

// Thread rule: thread-compatible. Throws IoError if the spool cannot be written or read.
class Chunks {
 public:
  // On any thread of settle(); `worker` is 0 on the calling one.
  using Moved = std::function<void(unsigned worker, std::uint64_t segments)>;

  static constexpr std::size_t kLeastOpen = 8;
  // Keeps a reference. `most_open`: number of chunks that may have a buffer at a time.
  Chunks(Spool& spool, std::uint64_t most_segments, std::size_t most_open);

  // From now on, no chunk crosses the ends of the range [low, end) of Morton keys. Call it before the first add(). All
  // midpoints must lie in the range, and the partition of all midpoints must split every block that crosses an end.
  // settle() then leaves out the chunks outside the range. kEndOfWorld is the end of the last range.
  static constexpr MortonKey kEndOfWorld = MortonKey{1} << kMortonBits;
  void confine(MortonKey low, MortonKey end);

  // Takes all segments of another table of the same spool and limit, which is then empty. For both, no settle() came
  // before. O(blocks).
  void take(Chunks& other);

  // Before settle(): where the midpoints lie, in about `parts` steps, ascending by key.
  struct Step {
    MortonKey key;        // the segments lie about here
    std::uint64_t count;  // segments
    bool may_cut;         // the partition of these midpoints splits every block that crosses this key
  };
  std::vector<Step> outline(std::uint32_t capacity, std::uint64_t parts) const;
  // Instead of settle(): passes all segments on, and frees them. Calls begin(block) before the segments of a block.
  void drain(const std::function<void(const BlockKey& block)>& begin,
             const std::function<void(const SegmentRecord& record)>& use);

  // Adds a segment. O(depth); O(1) for consecutive segments.
  void add(const SegmentRecord& record);
  // Number of blocks that hold segments; after settle(), of chunks.
  std::size_t size() const { return all_.empty() ? parts_.size() : all_.size(); }
  // Call it once, after the last segment. Afterwards no chunk exceeds the limit, unless all its midpoints are equal.
  // Works on `threads` threads, with at most `most_open` buffers from now on; with more of them, a segment is moved
  // fewer times. Now and then each calls `moved` with the number of segments that it has moved since; an exception that
  // it throws ends the work.
  void settle(unsigned threads, std::size_t most_open, const Moved& moved);

  // After settle(): ascending by key, and together the world.
  std::vector<Chunk>& all() { return all_; }
  const std::vector<Chunk>& all() const { return all_; }
  // Position of the chunk with this leaf. Requires first_leaf and end_leaf. O(log chunks).
  std::size_t ofLeaf(std::uint32_t leaf) const;

 private:
  struct Part {  // segments of a block, or of what was a block before its split
    GridBox seen;
    SegmentChain chain;

    void take(Part& other) {
      chain.take(other.chain);
      if (!other.seen.empty()) seen.extend(other.seen);
    }
  };
  struct Leaf {
    BlockKey key;
    GridBox box;  // grid points of the block
    Part part;
    std::uint32_t parent;  // among the splits
    int side;
  };
  struct Split {
    std::int64_t plane;
    int axis;
    std::uint32_t child[2];  // among the splits, or kPartBit | among the parts
  };
  static constexpr std::uint32_t kPartBit = std::uint32_t{1} << 31;
  static constexpr std::uint32_t kNone = UINT32_MAX;

  struct Place {
    std::uint32_t node;
    BlockKey key;
  };

  Chunks(const Chunks& whole, const BlockKey& block, std::size_t most_open);  // the empty table of a block
  std::uint32_t root() const { return splits_.empty() ? kPartBit : 0; }
  std::uint32_t addPart(const BlockKey& key, std::uint32_t parent, int side);
  std::uint32_t partOf(std::uint32_t node, const GridPoint& middle) const;
  void put(std::uint32_t part, const SegmentRecord& record, const GridPoint& middle);
  std::uint32_t halve(std::uint32_t part);
  std::uint32_t split(std::uint32_t part);
  void take(std::uint32_t node, Chunks& other, std::uint32_t from);
  bool exceeds(std::uint32_t part) const;
  std::uint64_t count(std::uint32_t node) const;
  void settle(std::uint32_t node, std::uint64_t most, const Moved& moved, unsigned worker);
  void settleAll(const Moved& moved, unsigned worker);
  void listPlaces(std::uint32_t node, const BlockKey& key, std::uint64_t most, std::vector<Place>& places) const;
  template <typename Use>
  void forEachChain(std::uint32_t node, const BlockKey& key, const Use& use);
  void closeBuffers();
  bool crosses(const BlockKey& block) const;
  void divideAt(MortonKey key);
  void outline(std::uint32_t node, const BlockKey& key, std::uint64_t least, std::uint32_t capacity,
               std::vector<Step>& steps) const;
  void gather(std::uint32_t node, const BlockKey& key);
  void collect(std::uint32_t node, Chunk& chunk);

  BlockKey block_;  // of this table: the world, or a block of it
  Spool& spool_;
  std::uint64_t most_segments_, most_in_part_;
  std::size_t most_open_;
  std::vector<Leaf> parts_;
  std::vector<Split> splits_;
  std::vector<Part> before_;  // by split: what the block held. Apart, so that the caches hold all splits
  std::vector<Chunk> all_;
  std::uint32_t last_ = 0;                 // the part of the last segment
  std::vector<std::uint32_t> open_;        // parts opened since buffers were closed; some occur more than once
  std::size_t closed_ = 0;                 // number of parts without a buffer, except one that is being split
  MortonKey low_ = 0, end_ = kEndOfWorld;  // of the range
};

}  // namespace filiform::internal
