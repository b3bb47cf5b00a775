#include "index/build/internal/chunks.h"

#include <cassert>
#include <utility>

namespace filiform::internal {
namespace {

bool holds(const GridBox& box, const GridPoint& p) {
  return (p.array() >= box.lo.array()).all() && (p.array() <= box.hi.array()).all();
}

}  // namespace

BlockKey Chunk::core() const {
  BlockKey block = key;
  if (seen.empty()) return block;
  const MortonKey low = mortonKey(seen.lo), high = mortonKey(seen.hi);  // keys increase with each coordinate
  while (block.depth < kMortonBits && block.half(0).contains(low) == block.half(0).contains(high))
    block = block.half(block.half(0).contains(low) ? 0 : 1);
  return block;
}

Chunks::Chunks(Spool& spool, std::uint64_t most_segments, std::size_t most_open)
    : spool_(spool), most_segments_(most_segments), most_open_(most_open) {
  addChunk(BlockKey{}, kNone, 0);
}

std::uint32_t Chunks::addChunk(const BlockKey& key, std::uint32_t parent, int side) {
  assert(chunks_.size() < kChunkBit);
  chunks_.push_back({key, key.box(), {}, SegmentChain(spool_), SegmentChain(spool_), parent, side});
  return static_cast<std::uint32_t>(chunks_.size() - 1);
}

std::uint32_t Chunks::chunkOf(std::uint32_t split, const GridPoint& middle) const {
  std::uint32_t at = split;
  while ((at & kChunkBit) == 0) at = splits_[at].child[middle[splits_[at].axis] >= splits_[at].plane];
  return at & ~kChunkBit;
}

void Chunks::add(const SegmentRecord& record) {
  const GridPoint middle = midpoint(record.child, record.parent);
  if (!holds(chunks_[last_].box, middle)) last_ = splits_.empty() ? 0 : chunkOf(0, middle);
  put(last_, record, middle);
}

void Chunks::put(std::uint32_t chunk, const SegmentRecord& record, const GridPoint& middle) {
  Chunk& to = chunks_[chunk];
  if (!to.own.isOpen()) open_.push_back(chunk);
  to.own.add(record);
  to.seen.extend(middle);
  // Each chunk that a split creates may have a buffer.
  if (to.own.count() > most_segments_ && to.seen.lo != to.seen.hi && chunks_.size() - closed_ < most_open_)
    split(chunk);
}

// Halves the block until both sides have midpoints. Its contents stay until input ends.
void Chunks::split(std::uint32_t chunk) {
  Remnant remnant{std::move(chunks_[chunk].own), 0};
  remnant.chain.close();
  const GridBox seen = chunks_[chunk].seen;
  BlockKey key = chunks_[chunk].key;
  std::uint32_t parent = chunks_[chunk].parent;
  int side = chunks_[chunk].side;
  for (bool apart = false; !apart;) {
    const int axis = key.depth % 3;
    const std::int64_t plane = mortonPoint(key.half(1).low)[axis];
    const auto self = static_cast<std::uint32_t>(splits_.size());
    splits_.push_back({plane, axis, {0, 0}});
    if (parent != kNone) splits_[parent].child[side] = self;
    apart = seen.lo[axis] < plane && seen.hi[axis] >= plane;
    // The half with which the loop continues, or the lower half, takes the chunk's position in the list.
    const int kept = seen.lo[axis] >= plane ? 1 : 0;
    splits_[self].child[1 - kept] = kChunkBit | addChunk(key.half(1 - kept), self, 1 - kept);
    splits_[self].child[kept] = kChunkBit | chunk;
    key = key.half(kept);
    parent = self;
    side = kept;
    remnant.split = self;
  }
  chunks_[chunk] = {key, key.box(), {}, SegmentChain(spool_), SegmentChain(spool_), parent, side};
  remnants_.push_back(std::move(remnant));
}

// Moves the contents of split chunks to the present chunks, which may have to be split in turn.
void Chunks::settleRemnants(const std::function<void(std::uint64_t)>& progress) {
  std::uint64_t done = 0;
  for (std::size_t i = 0; i < remnants_.size(); ++i) {
    SegmentChain chain = std::move(remnants_[i].chain);
    const std::uint32_t from = remnants_[i].split;
    SegmentChain::Reader reader(chain, true);
    std::uint32_t at = chunkOf(from, GridPoint::Zero());
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
      const GridPoint middle = midpoint(record.child, record.parent);
      if (!holds(chunks_[at].box, middle)) at = chunkOf(from, middle);
      put(at, record, middle);
      if ((++done & 0xFFFF) == 0) progress(done);
    }
  }
  remnants_.clear();
  for (const std::uint32_t chunk : open_) chunks_[chunk].own.close();
  open_.clear();
  closed_ = chunks_.size();
}

// Splits, one after the other, the chunks that waited because too many buffers were open.
void Chunks::settle(const std::function<void(std::uint64_t)>& progress) {
  settleRemnants(progress);
  for (std::uint32_t i = 0; i < chunks_.size(); ++i) {
    while (chunks_[i].own.count() > most_segments_ && chunks_[i].seen.lo != chunks_[i].seen.hi) {
      split(i);
      settleRemnants(progress);
    }
  }
}

}  // namespace filiform::internal
