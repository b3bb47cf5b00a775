#include "index/tile/tile.h"

#include "index/errors.h"
#include "index/tile/internal/decode_scratch.h"
#include "index/tile/internal/run_order.h"

#include <algorithm>
#include <bit>

namespace filiform {
namespace {

template <typename T>
std::size_t arrayBytes(const std::vector<T>& v) {
  return v.size() * sizeof(T);
}

constexpr std::uint32_t kNoSegment = UINT32_MAX;

NodeId childOf(const StoredSegment& s) { return {s.id.cell, s.child_sample}; }
NodeId parentOf(const StoredSegment& s) { return {s.id.cell, s.parent_sample}; }

// Finds the segment that places a node: the first of which it is the child.
class Children {
 public:
  explicit Children(std::span<const StoredSegment> segments) : segments_(segments) {
    named_ = std::all_of(segments.begin(), segments.end(),
                         [](const StoredSegment& s) { return s.id.segment == s.child_sample; });
    if (named_) {
      keys_.reserve(segments.size());
      for (const StoredSegment& s : segments) keys_.push_back(s.id.key());
      return;
    }
    rows_.reserve(segments.size());
    for (const StoredSegment& s : segments)
      rows_.emplace_back(childOf(s).key(), static_cast<std::uint32_t>(rows_.size()));
    std::sort(rows_.begin(), rows_.end());
    rows_.erase(
        std::unique(rows_.begin(), rows_.end(), [](const auto& a, const auto& b) { return a.first == b.first; }),
        rows_.end());
  }
  // kNoSegment: no segment. `near`: a segment of the same cell; the closer, the faster.
  std::uint32_t placing(NodeId node, std::uint32_t near) const {
    if (named_) return find(node.key(), near);
    const auto at = std::lower_bound(rows_.begin(), rows_.end(), std::pair(node.key(), std::uint32_t{0}));
    return at == rows_.end() || at->first != node.key() ? kNoSegment : at->second;
  }
  bool placed(std::uint32_t segment) const {
    return named_ || placing(childOf(segments_[segment]), segment) == segment;
  }

 private:
  // Searches in steps that double, then by halves.
  std::uint32_t find(std::uint64_t key, std::uint32_t near) const {
    std::size_t low = near, high = near, step = 1;
    if (keys_[near] < key) {
      do {
        low = high;
        high = std::min(keys_.size(), high + step);
        step *= 2;
      } while (high < keys_.size() && keys_[high] < key);
    } else {
      while (low > 0 && keys_[low] >= key) {
        high = low;
        low -= std::min(low, step);
        step *= 2;
      }
      ++high;
    }
    const auto begin = keys_.begin(), at = std::lower_bound(begin + static_cast<std::ptrdiff_t>(low),
                                                            begin + static_cast<std::ptrdiff_t>(high), key);
    return at == keys_.end() || *at != key ? kNoSegment : static_cast<std::uint32_t>(at - begin);
  }

  std::span<const StoredSegment> segments_;
  bool named_;
  std::vector<std::uint64_t> keys_;  // if named_: of all segments
  std::vector<std::pair<std::uint64_t, std::uint32_t>> rows_;
};

void setBits(std::vector<std::uint32_t>& words, std::uint32_t i) { words[i / 32] |= 1u << (i % 32); }

}  // namespace

Tile::Tile(TileId id, const BlockKey& key, bool is_long, const Grid& grid)
    : id_(id), key_(key), is_long_(is_long), grid_(grid) {}

Tile::Tile(TileId id, const BlockKey& key, bool is_long, const Grid& grid, std::span<const StoredSegment> segments)
    : Tile(id, key, is_long, grid) {
  if (segments.size() > kMaxSegments)
    throw InputError("a tile would hold more than 2^28 segments: too many have the same midpoint");
  const auto by_id = [](const StoredSegment& a, const StoredSegment& b) { return a.id < b.id; };
  std::vector<StoredSegment> sorted;
  if (!std::is_sorted(segments.begin(), segments.end(), by_id)) {
    sorted.assign(segments.begin(), segments.end());
    std::sort(sorted.begin(), sorted.end(), by_id);
    segments = sorted;
  }
  const auto n = static_cast<std::uint32_t>(segments.size());
  segment_count_ = n;

  const Children children(segments);
  std::vector<const GridPoint*> points;
  points.reserve(n + n / 4);
  // By segment: the child's node. By strip: its first node. By fragment: its first segment.
  std::vector<std::uint32_t> node_of(n), strips, starts;
  std::vector<bool> lead(n, false);
  std::vector<std::uint32_t> loose;
  bool was_placed = false;
  for (std::uint32_t s = 0; s < n; ++s) {
    const StoredSegment& segment = segments[s];
    const bool placed = children.placed(s);
    bool follows = s > 0 && placed && was_placed;
    if (follows) {
      const StoredSegment& before = segments[s - 1];
      follows = before.id.cell == segment.id.cell && before.id.segment + 1 == segment.id.segment &&
                before.child_sample + 1 == segment.child_sample && before.child_sample == segment.parent_sample;
    }
    was_placed = placed;
    if (!placed) {
      node_of[s] = node_of[children.placing(childOf(segment), s)];
      loose.push_back(static_cast<std::uint32_t>(starts.size()));
      starts.push_back(s);
      continue;
    }
    if (!follows) {
      starts.push_back(s);
      strips.push_back(static_cast<std::uint32_t>(points.size()));
      if (segment.parent_sample != UINT32_MAX && segment.parent_sample + 1 == segment.child_sample &&
          children.placing(parentOf(segment), s) == kNoSegment) {
        lead[s] = true;
        points.push_back(&segment.parent);
      }
    }
    node_of[s] = static_cast<std::uint32_t>(points.size());
    points.push_back(&segment.child);
  }

  std::vector<std::pair<NodeId, const GridPoint*>> strays;
  // The segment whose fragment placed this node as its lead, or kNoSegment.
  const auto leadOf = [&](NodeId node, std::uint32_t near) {
    const std::uint32_t s = children.placing({node.cell, node.sample + 1}, near);
    return s != kNoSegment && lead[s] ? s : kNoSegment;
  };
  for (const std::uint32_t s : starts) {
    const NodeId parent = parentOf(segments[s]);
    if (!lead[s] && children.placing(parent, s) == kNoSegment && leadOf(parent, s) == kNoSegment)
      strays.emplace_back(parent, &segments[s].parent);
  }
  std::sort(strays.begin(), strays.end());
  strays.erase(
      std::unique(strays.begin(), strays.end(), [](const auto& a, const auto& b) { return a.first == b.first; }),
      strays.end());
  const auto strays_begin = static_cast<std::uint32_t>(points.size());
  for (const auto& [node, p] : strays) {
    strays_.push_back(node);
    points.push_back(p);
  }

  fragments_.reserve(starts.size());
  bool named = true;
  for (const std::uint32_t s : starts) {
    const NodeId parent = parentOf(segments[s]);
    std::uint32_t parent_node = node_of[s];
    if (lead[s]) {
      --parent_node;
    } else if (parent != childOf(segments[s])) {
      std::uint32_t at = children.placing(parent, s);
      if (at != kNoSegment) {
        parent_node = node_of[at];
      } else if (at = leadOf(parent, s); at != kNoSegment) {
        parent_node = node_of[at] - 1;
      } else {
        parent_node = strays_begin + static_cast<std::uint32_t>(
                                         std::lower_bound(strays_.begin(), strays_.end(), parent) - strays_.begin());
      }
    }
    fragments_.push_back({segments[s].id.cell, segments[s].id.segment, s, node_of[s], parent_node});
    named = named && segments[s].id.segment == segments[s].child_sample;
  }
  if (!named)
    for (const std::uint32_t s : starts) first_samples_.push_back(segments[s].child_sample);
  if (!loose.empty()) {
    loose_.assign((starts.size() + 31) / 32, 0);
    for (const std::uint32_t f : loose) setBits(loose_, f);
  }

  GridBox bounds;
  for (const GridPoint* p : points) bounds.extend(*p);
  if (!points.empty()) origin_ = bounds.lo;
  node_count_ = static_cast<std::uint32_t>(points.size());
  const std::uint64_t extent = points.empty() ? 0 : static_cast<std::uint64_t>((bounds.hi - bounds.lo).maxCoeff());
  offset_bits_ = std::bit_width(extent);
  fillOffsets([&](const auto& offsets) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const GridPoint p = *points[i] - origin_;
      offsets.put(
          i, {static_cast<std::uint64_t>(p[0]), static_cast<std::uint64_t>(p[1]), static_cast<std::uint64_t>(p[2])});
    }
  });

  for (std::size_t f = 0; f < fragments_.size(); ++f)
    internal::forEachRun(fragments_[f].begin, fragmentEnd(static_cast<std::uint32_t>(f)) - fragments_[f].begin,
                         [this](SegmentRun run) { runs_.push_back(run); });
  std::vector<GridPoint> centres;
  centres.reserve(runs_.size());
  for (const SegmentRun run : runs_) {
    GridBox box;
    box.extend(segments[run.begin()].parent);
    for (std::uint32_t i = 0; i < run.count(); ++i) box.extend(segments[run.begin() + i].child);
    centres.push_back(box.lo + box.hi);
  }
  const std::vector<SegmentRun> canonical = runs_;
  std::size_t at = 0;
  for (const std::uint32_t r : internal::orderRuns(centres)) runs_[at++] = canonical[r];

  std::vector<std::uint32_t> owned((n + 31) / 32, 0);
  for (std::uint32_t s = 0; s < n; ++s) owned[s / 32] |= std::uint32_t{segments[s].owned} << (s % 32);
  setHomes();
  index(owned, strips);
}

void Tile::index(std::span<const std::uint32_t> owned, std::span<const std::uint32_t> strips) {
  const internal::DecodeScratch::Trimmed trimmed;
  origin_W_ = grid_.toWorld(origin_);
  nodes_.assign((node_count_ + 31) / 32, {});
  segments_.assign((segment_count_ + 31) / 32, {});
  for (const std::uint32_t node : strips) nodes_[node / 32].strips |= 1u << (node % 32);
  for (const Fragment& f : fragments_) segments_[f.begin / 32].starts |= 1u << (f.begin % 32);
  for (std::size_t b = 0; b < owned.size(); ++b) segments_[b].owned = owned[b];
  std::uint32_t before = 0;
  for (NodeBlock& block : nodes_) {
    block.strips_before = before;
    before += ones(block.strips);
  }
  before = 0;
  for (SegmentBlock& block : segments_) {
    block.starts_before = before;
    before += ones(block.starts);
    owned_count_ += ones(block.owned);
  }

  if (!loose_.empty() || !first_samples_.empty()) {
    std::vector<std::uint32_t> placing;
    for (std::uint32_t f = 0; f < fragments_.size(); ++f)
      if (places(f)) placing.push_back(f);
    if (!loose_.empty()) fragment_of_strip_ = placing;
    const auto key = [this](std::uint32_t f) { return NodeId{fragments_[f].cell, firstSample(f)}; };
    const auto ascends = [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); };
    std::sort(placing.begin(), placing.end(), ascends);
    strips_by_sample_ = std::move(placing);
  }
  listIncident();
  countBytes();
}

void Tile::listIncident() {
  const auto mark = [this](std::uint32_t NodeBlock::*bits, std::uint32_t from, std::uint32_t to) {
    for (; from < to; from = (from / 32 + 1) * 32) {
      std::uint32_t mask = ~0u << (from % 32);
      if (to / 32 == from / 32) mask &= (1u << (to % 32)) - 1;
      nodes_[from / 32].*bits |= mask;
    }
  };
  // (node, segment) pairs that do not follow from a strip, ascending by segment.
  internal::DecodeScratch& scratch = internal::DecodeScratch::here();
  std::vector<std::pair<std::uint32_t, std::uint32_t>>& extra = scratch.extra;
  extra.clear();
  for (std::uint32_t f = 0; f < fragments_.size(); ++f) {
    const Fragment& fragment = fragments_[f];
    const bool self = fragment.parent_node == fragment.child_node;
    if (places(f)) {
      const std::uint32_t count = fragmentEnd(f) - fragment.begin, lead = hasLead(f) ? 1 : 0;
      mark(&NodeBlock::prev, fragment.child_node, fragment.child_node + count);
      mark(&NodeBlock::next, fragment.child_node - lead, fragment.child_node + count - 1);
      if (lead == 0 && !self) extra.emplace_back(fragment.parent_node, fragment.begin);
    } else {
      extra.emplace_back(fragment.child_node, fragment.begin);
      if (!self) extra.emplace_back(fragment.parent_node, fragment.begin);
    }
  }

  std::vector<std::uint32_t>&mask = scratch.listed, &counts = scratch.counts;
  mask.assign(nodes_.size(), 0);
  counts.clear();
  for (const auto& [node, segment] : extra) setBits(mask, node);
  for (std::size_t b = 0; b < nodes_.size(); ++b) {
    // A node without a segment occurs only in damaged bytes.
    const std::size_t left_over = node_count_ - 32 * b;
    mask[b] |= ~(nodes_[b].prev | nodes_[b].next) & (left_over >= 32 ? ~0u : (1u << left_over) - 1);
    nodes_[b].listed_before = static_cast<std::uint32_t>(counts.size());
    for (std::uint32_t left = mask[b]; left != 0; left &= left - 1) {
      const int bit = std::countr_zero(left);
      counts.push_back((nodes_[b].prev >> bit & 1) + (nodes_[b].next >> bit & 1));
    }
  }
  const auto rank = [&](std::uint32_t node) {
    return nodes_[node / 32].listed_before + ones(mask[node / 32] & ((1u << (node % 32)) - 1));
  };
  for (const auto& [node, segment] : extra) ++counts[rank(node)];
  listed_.reserve(counts.size());
  std::uint32_t size = 0;
  for (const std::uint32_t count : counts) {
    listed_.push_back(count == 1 ? 1 : 2 * size);
    if (count != 1) size += count + 1;
  }
  lists_.assign(size, 0);
  const auto add = [&](std::uint32_t at, std::uint32_t segment) {
    std::uint32_t& code = listed_[at];
    if (code % 2 == 1)
      code = 2 * segment + 1;
    else
      lists_[code / 2 + ++lists_[code / 2]] = segment;
  };
  std::uint32_t at = 0;
  for (std::uint32_t b = 0; b < nodes_.size(); ++b) {
    for (std::uint32_t left = mask[b]; left != 0; left &= left - 1, ++at) {
      const auto bit = static_cast<std::uint32_t>(std::countr_zero(left));
      const bool prev = (nodes_[b].prev >> bit & 1) != 0, next = (nodes_[b].next >> bit & 1) != 0;
      if (!prev && !next) continue;
      const Fragment& f = fragments_[fragmentOfNode(32 * b + bit)];
      const std::uint32_t own = f.begin + (32 * b + bit - f.child_node);
      if (prev) add(at, own);
      if (next) add(at, own + 1);
    }
    nodes_[b].prev &= ~mask[b];
    nodes_[b].next &= ~mask[b];
  }
  for (const auto& [node, segment] : extra) add(rank(node), segment);
  for (const std::uint32_t code : listed_) {
    if (code % 2 == 1) continue;
    const auto begin = lists_.begin() + code / 2 + 1, end = begin + lists_[code / 2];
    if (!std::is_sorted(begin, end)) std::sort(begin, end);
  }
}

void Tile::setHomes() {
  home_lo_.fill(UINT64_MAX);  // no offset is as large: the long-segment tile is no node's home
  if (is_long_) return;
  const GridBox block = key_.box();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    home_lo_[axis] = static_cast<std::uint64_t>(block.lo[i] - origin_[i]);
    home_range_[axis] = static_cast<std::uint64_t>(block.hi[i] - block.lo[i]);
  }
}

void Tile::countBytes() {
  // Of the object itself, on every processor: the format stores the sum.
  constexpr std::size_t kObjectBytes = 560;
  static_assert(sizeof(Tile) <= kObjectBytes);
  bytes_ = kObjectBytes + arrayBytes(fragments_) + arrayBytes(strays_) + arrayBytes(narrow_) + arrayBytes(words_) +
           arrayBytes(wide_) + arrayBytes(huge_) + arrayBytes(runs_) + arrayBytes(first_samples_) + arrayBytes(loose_) +
           arrayBytes(fragment_of_strip_) + arrayBytes(strips_by_sample_) + arrayBytes(nodes_) + arrayBytes(segments_) +
           arrayBytes(listed_) + arrayBytes(lists_);
}

void Tile::bound(SegmentRun run, Offset& lo, Offset& hi) const {
  const Fragment& f = fragments_[fragmentOf(run.begin())];
  const std::size_t first = f.child_node + (run.begin() - f.begin), count = run.count();
  const std::size_t before = run.begin() == f.begin ? f.parent_node : first - 1;
  withOffsets([&](const auto& offsets) {
    lo = hi = offsets.get(before);
    for (std::size_t i = first; i < first + count; ++i) {
      const Offset c = offsets.get(i);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        lo[axis] = std::min(lo[axis], c[axis]);
        hi[axis] = std::max(hi[axis], c[axis]);
      }
    }
  });
}

std::optional<std::uint32_t> Tile::findNode(NodeId id) const noexcept {
  // The first strip whose first child comes after the node: the node is in the strip before, or is this strip's lead.
  std::uint32_t low = 0, high = static_cast<std::uint32_t>(strips_by_sample_.empty() ? fragments_.size()
                                                                                     : strips_by_sample_.size());
  const auto fragmentAt = [this](std::uint32_t i) { return strips_by_sample_.empty() ? i : strips_by_sample_[i]; };
  const std::uint32_t count = high;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2, f = fragmentAt(middle);
    if (NodeId{fragments_[f].cell, firstSample(f)}.key() <= id.key()) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low > 0) {
    const std::uint32_t f = fragmentAt(low - 1);
    const Fragment& fragment = fragments_[f];
    const std::uint32_t at = id.sample - firstSample(f);
    if (fragment.cell == id.cell && at < fragmentEnd(f) - fragment.begin) return fragment.child_node + at;
  }
  if (low < count) {
    const std::uint32_t f = fragmentAt(low);
    if (fragments_[f].cell == id.cell && firstSample(f) - 1 == id.sample && hasLead(f))
      return fragments_[f].child_node - 1;
  }
  const auto stray = std::lower_bound(strays_.begin(), strays_.end(), id);
  if (stray == strays_.end() || *stray != id) return std::nullopt;
  return node_count_ - static_cast<std::uint32_t>(strays_.end() - stray);
}

std::uint32_t Tile::ownedIndex(std::uint32_t segment) const {
  std::uint32_t before = 0;
  for (std::uint32_t b = 0; b < segment / 32; ++b) before += ones(segments_[b].owned);
  return before + ones(segments_[segment / 32].owned & ((1u << (segment % 32)) - 1));
}

std::optional<std::uint32_t> Tile::findSegment(SegmentId id) const noexcept {
  const auto after =
      std::upper_bound(fragments_.begin(), fragments_.end(), id.key(), [](std::uint64_t key, const Fragment& f) {
        return key < SegmentId{f.cell, f.first_rank}.key();
      });
  if (after == fragments_.begin()) return std::nullopt;
  const auto f = static_cast<std::uint32_t>(after - fragments_.begin() - 1);
  const std::uint32_t at = id.segment - fragments_[f].first_rank;
  if (fragments_[f].cell != id.cell || at >= fragmentEnd(f) - fragments_[f].begin) return std::nullopt;
  return fragments_[f].begin + at;
}

}  // namespace filiform
