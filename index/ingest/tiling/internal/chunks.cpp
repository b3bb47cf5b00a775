#include "index/ingest/tiling/internal/chunks.h"

#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <iterator>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kPartsOfChunk = 8, kLeastInPart = 512;
constexpr std::uint64_t kPlacesOfThread = 4;  // parts of the world that a thread settles, about

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
  addPart(block_, kNone, 0);
}

Chunks::Chunks(const Chunks& whole, const BlockKey& block, std::size_t most_open)
    : block_(block),
      spool_(whole.spool_),
      most_segments_(whole.most_segments_),
      most_in_part_(whole.most_in_part_),
      most_open_(most_open),
      low_(whole.low_),
      end_(whole.end_) {
  addPart(block_, kNone, 0);
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

// Halves a block. What it holds stays in the split, which is returned. The lower half takes the part's position.
std::uint32_t Chunks::halve(std::uint32_t part) {
  const auto self = static_cast<std::uint32_t>(splits_.size());
  Leaf& whole = parts_[part];
  const BlockKey key = whole.key;
  const int axis = key.depth % 3;
  splits_.push_back({mortonPoint(key.half(1).low)[axis], axis, {kPartBit | part, 0}});
  before_.push_back(std::move(whole.part));
  if (whole.parent != kNone) splits_[whole.parent].child[whole.side] = self;
  const BlockKey low = key.half(0);
  whole = {low, low.box(), {{}, SegmentChain(spool_)}, self, 0};
  splits_[self].child[1] = kPartBit | addPart(key.half(1), self, 1);
  return self;
}

// Halves the blocks that cross the key, as split() does, although they hold nothing.
void Chunks::divideAt(MortonKey key) {
  if (key == 0 || key == kEndOfWorld) return;
  std::uint32_t part = partOf(root(), mortonPoint(key));
  while (parts_[part].key.low != key) {
    const int side = parts_[part].key.half(1).contains(key) ? 1 : 0;
    part = splits_[halve(part)].child[side] & ~kPartBit;
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
  outline(root(), block_, count(root()) / parts, capacity, steps);
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
  steps.push_back({key.half(1).low, before_[node].chain.count(), true});
  outline(split.child[1], key.half(1), least, capacity, steps);
}

template <typename Use>
void Chunks::forEachChain(std::uint32_t node, const BlockKey& key, const Use& use) {
  if ((node & kPartBit) != 0) {
    use(parts_[node & ~kPartBit].part.chain, key);
    return;
  }
  use(before_[node].chain, key);
  for (const int side : {0, 1}) forEachChain(splits_[node].child[side], key.half(side), use);
}

void Chunks::drain(const std::function<void(const BlockKey& block)>& begin,
                   const std::function<void(const SegmentRecord& record)>& use) {
  closeBuffers();
  forEachChain(root(), block_, [&](SegmentChain& chain, const BlockKey& key) {
    if (chain.count() == 0) return;
    begin(key);
    SegmentChain::Reader reader(chain, true);
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) use(record);
  });
}

void Chunks::add(const SegmentRecord& record) {
  const GridPoint middle = midpoint(record.child, record.parent);
  if (!parts_[last_].box.contains(middle)) last_ = partOf(root(), middle);
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
  parts_[part].part.chain.close();
  for (;;) {
    const std::uint32_t self = halve(part);
    const Split& half = splits_[self];
    const GridBox& seen = before_[self].seen;
    if (seen.lo[half.axis] < half.plane && seen.hi[half.axis] >= half.plane) return first;
    part = half.child[seen.lo[half.axis] >= half.plane ? 1 : 0] & ~kPartBit;
    parts_[part].part = std::move(before_[self]);
    before_[self] = {{}, SegmentChain(spool_)};
  }
}

void Chunks::take(Chunks& other) {
  closeBuffers();
  other.closeBuffers();
  take(root(), other, other.root());
  closed_ = parts_.size();
  last_ = other.last_ = 0;
  other.splits_.clear();
  other.before_.clear();
  other.parts_.clear();
  other.addPart(other.block_, kNone, 0);
  other.closed_ = 0;
}

// Takes what lies below a node of another table; both nodes have the same block.
void Chunks::take(std::uint32_t node, Chunks& other, std::uint32_t from) {
  const bool is_part = (node & kPartBit) != 0;
  if ((from & kPartBit) != 0) {
    (is_part ? parts_[node & ~kPartBit].part : before_[node]).take(other.parts_[from & ~kPartBit].part);
    return;
  }
  if (is_part) node = halve(node & ~kPartBit);
  before_[node].take(other.before_[from]);
  for (const int side : {0, 1}) take(splits_[node].child[side], other, other.splits_[from].child[side]);
}

bool Chunks::exceeds(std::uint32_t part) const {
  const Part& p = parts_[part].part;
  return p.chain.count() > most_segments_ && p.seen.lo != p.seen.hi;
}

// Of the parts below a node, and of what its splits hold.
std::uint64_t Chunks::count(std::uint32_t node) const {
  if ((node & kPartBit) != 0) return parts_[node & ~kPartBit].part.chain.count();
  const Split& split = splits_[node];
  return before_[node].chain.count() + count(split.child[0]) + count(split.child[1]);
}

// Moves what blocks with more than `most` segments hold to the parts below them, which may have to be split in turn.
void Chunks::settle(std::uint32_t node, std::uint64_t most, const Moved& moved, unsigned worker) {
  constexpr std::uint64_t kBetweenCalls = 65536;
  if ((node & kPartBit) != 0 || count(node) <= most) return;
  {
    SegmentChain chain = std::move(before_[node].chain);
    before_[node] = {{}, SegmentChain(spool_)};
    SegmentChain::Reader reader(chain, true);
    std::uint32_t at = partOf(node, GridPoint::Zero());
    std::uint64_t done = 0;
    for (SegmentRecord record = SegmentChain::first(); reader.next(record);) {
      const GridPoint middle = midpoint(record.child, record.parent);
      if (!parts_[at].box.contains(middle)) at = partOf(node, middle);
      put(at, record, middle);
      if (++done % kBetweenCalls == 0) moved(worker, kBetweenCalls);
    }
    moved(worker, done % kBetweenCalls);
  }
  for (const int side : {0, 1}) settle(splits_[node].child[side], most, moved, worker);
}

void Chunks::closeBuffers() {
  for (const std::uint32_t part : open_) parts_[part].part.chain.close();
  open_.clear();
  closed_ = parts_.size();
}

// The largest blocks with at most `most` segments, ascending by key.
void Chunks::listPlaces(std::uint32_t node, const BlockKey& key, std::uint64_t most, std::vector<Place>& places) const {
  if ((node & kPartBit) != 0 || count(node) <= most) {
    places.push_back({node, key});
    return;
  }
  for (const int side : {0, 1}) listPlaces(splits_[node].child[side], key.half(side), most, places);
}

// What lies in large blocks is moved by the calling thread. Then each thread settles smaller blocks, in tables of their
// own.
void Chunks::settle(unsigned threads, std::size_t most_open, const Moved& moved) {
  closeBuffers();
  most_open_ = most_open;
  const std::uint64_t most = std::max(most_segments_, count(root()) / (kPlacesOfThread * threads));
  if (threads > 1 && count(root()) > most) {
    settle(root(), most, moved, 0);
    closeBuffers();
    std::vector<Place> places;
    listPlaces(root(), block_, most, places);
    std::vector<std::vector<Chunk>> found(places.size());
    std::atomic<std::size_t> next{0};
    runWorkers(std::min<std::size_t>(threads, places.size()), [&](unsigned worker, const std::atomic<bool>& failed) {
      for (std::size_t i; !failed && (i = next.fetch_add(1)) < places.size();) {
        Chunks part(*this, places[i].key, std::max(kLeastOpen, most_open_ / threads));
        part.take(part.root(), *this, places[i].node);
        part.closed_ = part.parts_.size();
        part.settleAll(moved, worker);
        found[i] = std::move(part.all_);
      }
    });
    for (std::vector<Chunk>& chunks : found) std::move(chunks.begin(), chunks.end(), std::back_inserter(all_));
  } else {
    settleAll(moved, 0);
  }
  std::vector<Leaf>().swap(parts_);
  std::vector<Split>().swap(splits_);
  std::vector<Part>().swap(before_);
}

// Splits, one after the other, the parts that waited because too many buffers were open.
void Chunks::settleAll(const Moved& moved, unsigned worker) {
  settle(root(), most_segments_, moved, worker);
  closeBuffers();
  most_in_part_ = std::max(most_in_part_, most_segments_ / 4);  // few parts: each is read at once
  for (std::uint32_t i = 0; i < parts_.size(); ++i) {
    while (exceeds(i)) {
      settle(split(i), most_segments_, moved, worker);
      closeBuffers();
    }
  }
  gather(root(), block_);
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
  Part& part = is_part ? parts_[node & ~kPartBit].part : before_[node];
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
