#include "index/build/internal/chunks.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kPartsOfChunk = 8, kLeastInPart = 512;

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
    : spool_(spool),
      most_segments_(most_segments),
      most_in_part_(std::min(most_segments, std::max(most_segments / kPartsOfChunk, kLeastInPart))),
      most_open_(most_open) {
  addPart(BlockKey{}, kNone, 0);
}

std::uint32_t Chunks::addPart(const BlockKey& key, std::uint32_t parent, int side) {
  assert(parts_.size() < kPartBit);
  parts_.push_back({key, key.box(), {{}, SegmentChain(spool_)}, parent, side});
  return static_cast<std::uint32_t>(parts_.size() - 1);
}

std::uint32_t Chunks::partOf(std::uint32_t node, const GridPoint& middle) const {
  std::uint32_t at = node;
  while ((at & kPartBit) == 0) at = splits_[at].child[middle[splits_[at].axis] >= splits_[at].plane];
  return at & ~kPartBit;
}

bool Chunks::crosses(const BlockKey& block) const {
  const auto holdsInside = [&block](MortonKey key) { return key > block.low && key <= block.high(); };
  return holdsInside(low_) || holdsInside(end_);
}

// Halves the blocks that cross the key, as split() does, although they hold nothing.
void Chunks::divideAt(MortonKey key) {
  if (key == 0 || key == kEndOfWorld) return;
  std::uint32_t part = splits_.empty() ? 0 : partOf(0, mortonPoint(key));
  while (parts_[part].key.low != key) {
    const Leaf leaf{
        parts_[part].key, parts_[part].box, {{}, SegmentChain(spool_)}, parts_[part].parent, parts_[part].side};
    const int axis = leaf.key.depth % 3;
    const auto self = static_cast<std::uint32_t>(splits_.size());
    splits_.push_back({mortonPoint(leaf.key.half(1).low)[axis], axis, {0, 0}, {{}, SegmentChain(spool_)}});
    if (leaf.parent != kNone) splits_[leaf.parent].child[leaf.side] = self;
    const int kept = leaf.key.half(1).contains(key) ? 1 : 0;
    splits_[self].child[1 - kept] = kPartBit | addPart(leaf.key.half(1 - kept), self, 1 - kept);
    splits_[self].child[kept] = kPartBit | part;
    const BlockKey half = leaf.key.half(kept);
    parts_[part] = {half, half.box(), {{}, SegmentChain(spool_)}, self, kept};
  }
}

void Chunks::confine(MortonKey low, MortonKey end) {
  low_ = low;
  end_ = end;
  divideAt(low);
  divideAt(end);
  closed_ = parts_.size();
  last_ = 0;
}

std::vector<Chunks::Step> Chunks::outline(std::uint32_t capacity, std::uint64_t parts) const {
  std::vector<Step> steps;
  const std::uint32_t root = splits_.empty() ? kPartBit : 0;
  outline(root, BlockKey{}, count(root) / parts, capacity, steps);
  return steps;
}

// A block of more midpoints than the capacity, not all equal, is split by the partition of all midpoints.
void Chunks::outline(std::uint32_t node, const BlockKey& key, std::uint64_t least, std::uint32_t capacity,
                     std::vector<Step>& steps) const {
  const std::uint64_t all = count(node);
  if ((node & kPartBit) != 0 || all <= std::max<std::uint64_t>(least, capacity)) {
    if (all > 0) steps.push_back({key.low, all, false});
    return;
  }
  const Split& split = splits_[node];
  outline(split.child[0], key.half(0), least, capacity, steps);
  steps.push_back({key.half(1).low, split.before.chain.count(), true});
  outline(split.child[1], key.half(1), least, capacity, steps);
}

template <typename Use>
void Chunks::forEachChain(std::uint32_t node, const BlockKey& key, const Use& use) {
  if ((node & kPartBit) != 0) {
    use(parts_[node & ~kPartBit].part.chain, key);
    return;
  }
  use(splits_[node].before.chain, key);
  for (const int side : {0, 1}) forEachChain(splits_[node].child[side], key.half(side), use);
}

void Chunks::drain(const std::function<void(const BlockKey& block)>& begin,
                   const std::function<void(const SegmentRecord& record)>& use) {
  closeBuffers();
  forEachChain(splits_.empty() ? kPartBit : 0, BlockKey{}, [&](SegmentChain& chain, const BlockKey& key) {
    if (chain.count() == 0) return;
    begin(key);
    SegmentChain::Reader reader(chain, true);
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) use(record);
  });
}

void Chunks::add(const SegmentRecord& record) {
  const GridPoint middle = midpoint(record.child, record.parent);
  if (!holds(parts_[last_].box, middle)) last_ = splits_.empty() ? 0 : partOf(0, middle);
  put(last_, record, middle);
}

void Chunks::put(std::uint32_t part, const SegmentRecord& record, const GridPoint& middle) {
  Part& to = parts_[part].part;
  if (!to.chain.isOpen()) open_.push_back(part);
  to.chain.add(record);
  to.seen.extend(middle);
  // Each part that a split creates may have a buffer.
  if (to.chain.count() > most_in_part_ && to.seen.lo != to.seen.hi && parts_.size() - closed_ < most_open_) split(part);
}

// Halves the block until both sides have midpoints. Its contents stay in the last split. Returns the first split.
std::uint32_t Chunks::split(std::uint32_t part) {
  const auto first = static_cast<std::uint32_t>(splits_.size());
  Part before = std::move(parts_[part].part);
  before.chain.close();
  BlockKey key = parts_[part].key;
  std::uint32_t parent = parts_[part].parent;
  int side = parts_[part].side;
  for (bool apart = false; !apart;) {
    const int axis = key.depth % 3;
    const std::int64_t plane = mortonPoint(key.half(1).low)[axis];
    const auto self = static_cast<std::uint32_t>(splits_.size());
    splits_.push_back({plane, axis, {0, 0}, {{}, SegmentChain(spool_)}});
    if (parent != kNone) splits_[parent].child[side] = self;
    apart = before.seen.lo[axis] < plane && before.seen.hi[axis] >= plane;
    // The half with which the loop continues, or the lower half, takes the part's position in the list.
    const int kept = before.seen.lo[axis] >= plane ? 1 : 0;
    splits_[self].child[1 - kept] = kPartBit | addPart(key.half(1 - kept), self, 1 - kept);
    splits_[self].child[kept] = kPartBit | part;
    key = key.half(kept);
    parent = self;
    side = kept;
  }
  parts_[part] = {key, key.box(), {{}, SegmentChain(spool_)}, parent, side};
  splits_.back().before = std::move(before);
  return first;
}

bool Chunks::exceeds(std::uint32_t part) const {
  const Part& p = parts_[part].part;
  return p.chain.count() > most_segments_ && p.seen.lo != p.seen.hi;
}

// Of the parts below a node, and of what its splits hold.
std::uint64_t Chunks::count(std::uint32_t node) const {
  if ((node & kPartBit) != 0) return parts_[node & ~kPartBit].part.chain.count();
  const Split& split = splits_[node];
  return split.before.chain.count() + count(split.child[0]) + count(split.child[1]);
}

// Moves what the blocks beyond the limit hold to the parts below them, which may have to be split in turn.
void Chunks::settle(std::uint32_t node, const std::function<void(std::uint64_t)>& progress) {
  if ((node & kPartBit) != 0 || count(node) <= most_segments_) return;
  {
    SegmentChain chain = std::move(splits_[node].before.chain);
    splits_[node].before = {{}, SegmentChain(spool_)};
    SegmentChain::Reader reader(chain, true);
    std::uint32_t at = partOf(node, GridPoint::Zero());
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
      const GridPoint middle = midpoint(record.child, record.parent);
      if (!holds(parts_[at].box, middle)) at = partOf(node, middle);
      put(at, record, middle);
      if ((++moved_ & 0xFFFF) == 0) progress(moved_);
    }
  }
  for (const int side : {0, 1}) settle(splits_[node].child[side], progress);
}

void Chunks::closeBuffers() {
  for (const std::uint32_t part : open_) parts_[part].part.chain.close();
  open_.clear();
  closed_ = parts_.size();
}

// Splits, one after the other, the parts that waited because too many buffers were open.
void Chunks::settle(const std::function<void(std::uint64_t)>& progress) {
  if (!splits_.empty()) settle(0, progress);
  closeBuffers();
  most_in_part_ = std::max(most_in_part_, most_segments_ / 4);  // few parts: each is read at once
  for (std::uint32_t i = 0; i < parts_.size(); ++i) {
    while (exceeds(i)) {
      settle(split(i), progress);
      closeBuffers();
    }
  }
  gather(splits_.empty() ? kPartBit : 0, BlockKey{});
  std::vector<Leaf>().swap(parts_);
  std::vector<Split>().swap(splits_);
}

// Makes chunks of the largest blocks within the limit.
void Chunks::gather(std::uint32_t node, const BlockKey& key) {
  if ((node & kPartBit) == 0 && (count(node) > most_segments_ || crosses(key))) {
    for (const int side : {0, 1}) gather(splits_[node].child[side], key.half(side));
    return;
  }
  if (key.high() < low_ || key.low >= end_) return;
  all_.push_back({key, {}, SegmentChain(spool_), SegmentChain(spool_)});
  collect(node, all_.back());
}

// Older segments first, so that the ids ascend as far as possible.
void Chunks::collect(std::uint32_t node, Chunk& chunk) {
  const bool is_part = (node & kPartBit) != 0;
  Part& part = is_part ? parts_[node & ~kPartBit].part : splits_[node].before;
  chunk.own.take(part.chain);
  chunk.seen.extend(part.seen);
  if (is_part) return;
  for (const int side : {0, 1}) collect(splits_[node].child[side], chunk);
}

std::size_t Chunks::ofLeaf(std::uint32_t leaf) const {
  const auto after = std::upper_bound(all_.begin(), all_.end(), leaf,
                                      [](std::uint32_t l, const Chunk& chunk) { return l < chunk.first_leaf; });
  return static_cast<std::size_t>(after - all_.begin() - 1);
}

}  // namespace filiform::internal
