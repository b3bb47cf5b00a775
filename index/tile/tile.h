// A tile in memory: the segments of one leaf of the partition, arranged for haptics and search.
//
// A *node* is a sample of a cell (a neuron). A *segment* joins a child node to its parent node. A tile stores every
// segment that meets its closed block. A segment whose midpoint lies in the block is *owned*; any other is a *ghost*,
// owned by another tile. The tile whose block contains a node is the *home* of the node and holds all its segments.
// Node and segment indices (0, 1, ...) are local to the tile; NodeId and SegmentId are valid in the whole set.
// Requirements are not checked. Thread rule: immutable after construction; any number of threads may read.
//
// A segment that meets more than 64 blocks is owned by the set's *long-segment tile*, and is a ghost only in the tiles
// of its two ends. The block of this tile is the whole grid, and no node is at home in it.
//
// Segments lie in *fragments*. A fragment is a run of segments with consecutive ids, in which the parent node of each
// segment is the child node of the one before; its child nodes are consecutive too. So ids, ends and neighbours follow
// from a fragment's start. Only nodes where this does not tell the neighbours, such as branch nodes, list their
// segments.
#pragma once

#include "index/errors.h"
#include "index/geometry/grid.h"
#include "index/geometry/morton.h"
#include "index/geometry/offsets.h"
#include "index/tile/segment_run.h"
#include "index/tile/type_mask.h"

#include <compare>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <span>
#include <vector>

namespace filiform {

using TileId = std::uint32_t;  // rank of the leaf in key order; the long-segment tile, if any, comes last
inline constexpr TileId kNoTile = UINT32_MAX;

struct NodeId {  // a sample: index of the neuron in the set, and rank among the samples that the set keeps of it
  std::uint32_t cell, sample;
  auto operator<=>(const NodeId&) const = default;
  std::uint64_t key() const { return std::uint64_t{cell} << 32 | sample; }
};
struct SegmentId {  // neuron, and rank of the child sample; in neurons with loops, rank of the link
  std::uint32_t cell, segment;
  auto operator<=>(const SegmentId&) const = default;
  std::uint64_t key() const { return std::uint64_t{cell} << 32 | segment; }
};

// A segment as the tiler passes it. An isolated sample is a segment from itself to itself (child_sample ==
// parent_sample). Several segments may have the same child. A segment may close a loop.
struct StoredSegment {
  SegmentId id;
  std::uint32_t child_sample, parent_sample;
  GridPoint child, parent;
  bool owned;
};

class Tile {
 public:
  static constexpr std::uint32_t kMaxSegments = 1u << 28;

  // Builds a tile from segments in any order. Requires that each id comes once and that every segment meets the block.
  // `is_long`: the long-segment tile; its `key` has depth 0. Throws InputError for more than kMaxSegments segments. O(n
  // log n).
  Tile(TileId id, const BlockKey& key, bool is_long, const Grid& grid, std::span<const StoredSegment> segments);
  // The tile of the segments of both. Requires that both have the same block and segments, and that all cells of
  // `patch` come after those of `base`. Equal to a tile built from the segments but for the order of runs(), those of
  // `base`, then those of `patch`. Throws InputError for more than kMaxSegments segments. O(n).
  Tile(const Tile& base, const Tile& patch);

  TileId id() const { return id_; }
  const Grid& grid() const { return grid_; }
  const BlockKey& key() const { return key_; }
  bool isLong() const { return is_long_; }
  std::uint32_t node_count() const { return node_count_; }
  std::uint32_t segment_count() const { return segment_count_; }  // owned and ghosts
  std::uint32_t owned_count() const { return owned_count_; }
  // Heap and object bytes; counted against byte budgets. Depends only on the tile's content.
  std::size_t bytes() const { return bytes_; }
  // Makes bytes() larger, for a tile whose size was only estimated beforehand. Requires at least bytes().
  void countAs(std::size_t bytes) { bytes_ = bytes; }

  // Nodes, in an order that depends only on the tile's content. Requires node < node_count(). All functions O(1) except
  // findNode().
  NodeId nodeId(std::uint32_t node) const;
  GridPoint gridPoint(std::uint32_t node) const;
  // Calls use(node, position) for all nodes, or use(segment, child, parent) for all segments, ascending. Faster than a
  // call for each.
  template <class Use>
  void forEachNode(const Use& use) const;
  template <class Use>
  void forEachSegment(const Use& use) const;
  Vector3d position_W(std::uint32_t node) const;  // um, frame W; the grid point without rounding
  bool isHome(std::uint32_t node) const;          // its position is in the block; false in the long-segment tile
  // Segments at the node, in the order of their ids. They are complete if and only if isHome(node). Valid while the
  // tile lives.
  class Incident;
  Incident incident(std::uint32_t node) const;
  std::optional<std::uint32_t> findNode(NodeId id) const noexcept;  // O(log n)

  // True: exactly two segments of the tile meet at the node. They lead to node - 1 and node + 1, and the segment at
  // node + 1 has the index after that at node - 1. False at branches, tips and strays, and at the first node of a
  // strip.
  bool isBetween(std::uint32_t node) const {
    const NodeBlock& block = nodes_[node / 32];
    return (block.prev & block.next & ~block.strips) >> (node % 32) & 1;
  }

  // Segments, in the order of their ids. Requires segment < segment_count(). All functions O(1) except findSegment().
  SegmentId segmentId(std::uint32_t segment) const {
    const Fragment& f = fragments_[fragmentOf(segment)];
    return {f.cell, f.first_rank + (segment - f.begin)};
  }
  std::uint32_t child(std::uint32_t segment) const {
    const Fragment& f = fragments_[fragmentOf(segment)];
    return f.child_node + (segment - f.begin);
  }
  std::uint32_t parent(std::uint32_t segment) const {
    const Fragment& f = fragments_[fragmentOf(segment)];
    return segment == f.begin ? f.parent_node : f.child_node + (segment - f.begin) - 1;
  }
  // A segment's id, its ends and their ids in one call, which costs about as much as child().
  struct Link {
    SegmentId id;
    std::uint32_t child, parent;
    NodeId child_id, parent_id;
  };
  Link link(std::uint32_t segment) const;
  // Calls visit(segment, link) for each segment at the node, in the order of their ids, and returns their number. If
  // the node has more than `most` segments, makes no call. Requires most >= 2. At a node without branches, costs about
  // one link().
  template <class Visit>
  std::uint32_t visitIncident(std::uint32_t node, std::uint32_t most, Visit&& visit) const;
  bool owned(std::uint32_t segment) const { return (segments_[segment / 32].owned >> (segment % 32) & 1) != 0; }
  // Position of an owned segment in TileAppearance: the number of owned segments before it. O(segments / 32).
  std::uint32_t ownedIndex(std::uint32_t segment) const;
  bool isolated(std::uint32_t segment) const { return child(segment) == parent(segment); }
  std::optional<std::uint32_t> findSegment(SegmentId id) const noexcept;  // O(log n)

  // All segments, in runs ordered by position in space. Groups of 8, 64, ... consecutive runs lie close together.
  std::span<const SegmentRun> runs() const { return runs_; }
  // Offset: a node's position minus origin(), the lowest corner of all nodes, in quanta. offset_bits(): bits that the
  // largest coordinate of an offset needs.
  using Offset = Coordinates;
  const GridPoint& origin() const { return origin_; }
  int offset_bits() const { return offset_bits_; }
  // The offsets of all nodes in one of two arrays. Each array has room for 8 more nodes at its end, so that 8 nodes can
  // be read from any node on. narrowOffsets() is empty if offset_bits() > 16; wordOffsets() is empty unless
  // offset_bits() is 17 to 21.
  const std::uint16_t* narrowOffsets() const { return narrow_.data(); }  // x, y, z of each node
  const std::uint64_t* wordOffsets() const { return words_.data(); }     // see WordOffsets
  // The box of a run's segments, as offsets. O(1).
  void bound(SegmentRun run, Offset& lo, Offset& hi) const;

 private:
  friend class TileCodec;

  // A fragment *places* a node if it is the first to give the node its index. A *strip* is the run of nodes that one
  // fragment places: its child nodes, and sometimes its first parent just before them (the *lead*). In neurons with
  // loops, a fragment may place no node (it is *loose*). Parents that no fragment places are *strays*, the last nodes.
  struct Fragment {
    std::uint32_t cell, first_rank;         // of its first segment
    std::uint32_t begin;                    // its first segment
    std::uint32_t child_node, parent_node;  // of its first segment
  };
  struct NodeBlock {                   // 32 nodes, one bit each
    std::uint32_t strips = 0;          // set for the first node of a strip
    std::uint32_t prev = 0, next = 0;  // the strip's fragment has a segment with this child; with this parent. If
                                       // neither is set, the node's segments are listed
    std::uint32_t strips_before = 0, listed_before = 0;
  };
  struct SegmentBlock {  // 32 segments, one bit each
    std::uint32_t starts = 0, owned = 0;
    std::uint32_t starts_before = 0;
  };

  Tile(TileId id, const BlockKey& key, bool is_long, const Grid& grid);

  static std::uint32_t ones(std::uint32_t v) {  // population count: baseline x86-64 has no instruction for it
    v -= v >> 1 & 0x55555555u;
    v = (v & 0x33333333u) + (v >> 2 & 0x33333333u);
    return ((v + (v >> 4)) & 0x0F0F0F0Fu) * 0x01010101u >> 24;
  }
  std::uint32_t fragmentOf(std::uint32_t segment) const {
    const SegmentBlock& block = segments_[segment / 32];
    return block.starts_before + ones(block.starts & (~0u >> (31 - segment % 32))) - 1;
  }
  std::uint32_t fragmentOfNode(std::uint32_t node) const {  // the fragment that placed the node; not for strays
    const NodeBlock& block = nodes_[node / 32];
    const std::uint32_t strip = block.strips_before + ones(block.strips & (~0u >> (31 - node % 32))) - 1;
    return fragment_of_strip_.empty() ? strip : fragment_of_strip_[strip];
  }
  std::uint32_t fragmentEnd(std::uint32_t fragment) const {
    return fragment + 1 < fragments_.size() ? fragments_[fragment + 1].begin : segment_count_;
  }
  std::uint32_t firstSample(std::uint32_t fragment) const {  // sample of its first child
    return first_samples_.empty() ? fragments_[fragment].first_rank : first_samples_[fragment];
  }
  bool places(std::uint32_t fragment) const {  // false: its children were placed before (loops)
    return loose_.empty() || (loose_[fragment / 32] >> (fragment % 32) & 1) == 0;
  }
  bool hasLead(std::uint32_t fragment) const {  // it also placed its first parent, just before the first child
    const std::uint32_t node = fragments_[fragment].child_node;
    return places(fragment) && (nodes_[node / 32].strips >> (node % 32) & 1) == 0;
  }
  // Calls f(get) with a function object that reads a node's stored offset.
  template <class Visit>
  auto withOffsets(Visit&& f) const;
  GridPoint offset(std::uint32_t node) const;
  // Allocates node_count_ offsets of offset_bits_ and calls f(put).
  template <class Visit>
  void fillOffsets(Visit&& f);

  // Sets the origin and the offsets of a tile that joins two. `..._placed`: the nodes that are no strays.
  void joinOffsets(const Tile& base, std::uint32_t base_placed, const Tile& patch, std::uint32_t patch_placed);
  // Computes the members after `Derived:` below. Requires that all members before are set. `owned`: one bit a segment;
  // `strips`: the first node of each strip.
  void index(std::span<const std::uint32_t> owned, std::span<const std::uint32_t> strips);
  // One bit a segment: its midpoint lies in the block. Requires setHomes().
  std::vector<std::uint32_t> midpointsInside() const;
  bool midpointInside(std::uint32_t a, std::uint32_t b) const;  // of two nodes; requires setHomes()
  void listIncident();
  void setHomes();
  void countBytes();

  TileId id_;
  BlockKey key_;
  bool is_long_;
  Grid grid_;
  GridPoint origin_ = GridPoint::Zero();
  Vector3d origin_W_ = Vector3d::Zero();
  int offset_bits_ = 0;
  std::uint32_t node_count_ = 0, segment_count_ = 0, owned_count_ = 0;
  std::vector<Fragment> fragments_;  // in the order of segments
  std::vector<NodeId> strays_;       // the last nodes, ascending: parents that no fragment placed
  // Positions minus the origin, followed by room for kSlack nodes; see withOffsets().
  static constexpr std::size_t kSlack = 8;
  std::vector<std::uint16_t> narrow_;
  std::vector<std::uint64_t> words_;
  std::vector<std::uint32_t> wide_;
  std::vector<std::uint64_t> huge_;
  std::vector<SegmentRun> runs_;
  // Only in tiles of graphs:
  std::vector<std::uint32_t> first_samples_;      // by fragment, if different from first_rank
  std::vector<std::uint32_t> loose_;              // one bit a fragment; empty if every fragment places its nodes
  std::vector<std::uint32_t> fragment_of_strip_;  // empty if every fragment places its nodes
  std::vector<std::uint32_t>
      strips_by_sample_;  // fragments that place nodes, by (cell, first sample); empty if already so ordered
  // Derived:
  Offset home_lo_{}, home_range_{};  // a node is at home if its offset - home_lo_, modulo 2^64, is in the range
  std::vector<NodeBlock> nodes_;
  std::vector<SegmentBlock> segments_;
  std::vector<std::uint32_t> listed_;  // 2 s + 1: only segment s; else 2 * position in lists_
  std::vector<std::uint32_t> lists_;   // count, then segments
  std::size_t bytes_ = 0;
};

// A short list of segments: consecutive ones or a stored list. Thread rule: immutable value.
class Tile::Incident {
 public:
  class Iterator {
   public:
    using iterator_category = std::forward_iterator_tag;
    using value_type = std::uint32_t;
    using difference_type = std::ptrdiff_t;
    using pointer = const std::uint32_t*;
    using reference = std::uint32_t;

    Iterator() = default;
    Iterator(const std::uint32_t* list, std::uint32_t first, std::uint32_t at) : list_(list), first_(first), at_(at) {}
    std::uint32_t operator*() const { return list_ != nullptr ? list_[at_] : first_ + at_; }
    Iterator& operator++() { return ++at_, *this; }
    Iterator operator++(int) { return {list_, first_, at_++}; }
    bool operator==(const Iterator& other) const { return at_ == other.at_; }  // requires the same list

   private:
    const std::uint32_t* list_ = nullptr;
    std::uint32_t first_ = 0, at_ = 0;
  };

  Incident(const std::uint32_t* list, std::uint32_t first, std::uint32_t count)
      : list_(list), first_(first), count_(count) {}
  std::size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  std::uint32_t operator[](std::size_t i) const {
    return list_ != nullptr ? list_[i] : first_ + static_cast<std::uint32_t>(i);
  }
  Iterator begin() const { return {list_, first_, 0}; }
  Iterator end() const { return {list_, first_, count_}; }

 private:
  const std::uint32_t* list_;  // null: first_, first_ + 1, ...
  std::uint32_t first_, count_;
};

inline NodeId Tile::nodeId(std::uint32_t node) const {
  const auto strays_begin = node_count_ - static_cast<std::uint32_t>(strays_.size());
  if (node >= strays_begin) return strays_[node - strays_begin];
  const std::uint32_t fragment = fragmentOfNode(node);
  const Fragment& f = fragments_[fragment];
  return {f.cell, firstSample(fragment) + (node - f.child_node)};  // modulo 2^32, since the lead precedes by one
}

[[gnu::always_inline]] inline Tile::Link Tile::link(std::uint32_t segment) const {
  const std::uint32_t fragment = fragmentOf(segment);
  const Fragment& f = fragments_[fragment];
  const std::uint32_t at = segment - f.begin, child = f.child_node + at, sample = firstSample(fragment) + at;
  const SegmentId id{f.cell, f.first_rank + at};
  if (at > 0) return {id, child, child - 1, {f.cell, sample}, {f.cell, sample - 1}};
  return {id, child, f.parent_node, {f.cell, sample}, nodeId(f.parent_node)};
}

// Four layouts, chosen by the bits of the largest coordinate.
template <class Visit>
auto Tile::withOffsets(Visit&& f) const {
  if (offset_bits_ <= 16) return f(PlainOffsets<const std::uint16_t>{narrow_.data()});
  if (offset_bits_ <= WordOffsets<std::uint64_t>::kBits) return f(WordOffsets<const std::uint64_t>{words_.data()});
  if (offset_bits_ <= 32) return f(PlainOffsets<const std::uint32_t>{wide_.data()});
  return f(PlainOffsets<const std::uint64_t>{huge_.data()});
}

inline GridPoint Tile::offset(std::uint32_t node) const {
  return withOffsets([node](const auto& offsets) -> GridPoint {
    const Offset c = offsets.get(node);
    return {static_cast<std::int64_t>(c[0]), static_cast<std::int64_t>(c[1]), static_cast<std::int64_t>(c[2])};
  });
}

inline GridPoint Tile::gridPoint(std::uint32_t node) const { return origin_ + offset(node); }

template <class Use>
void Tile::forEachNode(const Use& use) const {
  withOffsets([&](const auto& offsets) {
    for (std::uint32_t node = 0; node < node_count_; ++node) {
      const Offset c = offsets.get(node);
      use(node, GridPoint(origin_[0] + static_cast<std::int64_t>(c[0]), origin_[1] + static_cast<std::int64_t>(c[1]),
                          origin_[2] + static_cast<std::int64_t>(c[2])));
    }
  });
}

template <class Use>
void Tile::forEachSegment(const Use& use) const {
  for (std::uint32_t f = 0; f < fragments_.size(); ++f) {
    const Fragment& fragment = fragments_[f];
    const std::uint32_t end = fragmentEnd(f);
    std::uint32_t child = fragment.child_node;
    use(fragment.begin, child, fragment.parent_node);
    for (std::uint32_t s = fragment.begin + 1; s < end; ++s, ++child) use(s, child + 1, child);
  }
}

template <class Visit>
void Tile::fillOffsets(Visit&& f) {
  const std::size_t room = node_count_ + kSlack;
  if (offset_bits_ <= 16) {
    narrow_.resize(3 * room);
    f(PlainOffsets<std::uint16_t>{narrow_.data()});
  } else if (offset_bits_ <= WordOffsets<std::uint64_t>::kBits) {
    words_.resize(room);
    f(WordOffsets<std::uint64_t>{words_.data()});
  } else if (offset_bits_ <= 32) {
    wide_.resize(3 * room);
    f(PlainOffsets<std::uint32_t>{wide_.data()});
  } else {
    huge_.resize(3 * room);
    f(PlainOffsets<std::uint64_t>{huge_.data()});
  }
}

// Exact: the origin, the offset and their sum are multiples of the quantum that fit a double.
inline Vector3d Tile::position_W(std::uint32_t node) const {
  return withOffsets([this, node](const auto& offsets) -> Vector3d {
    const Offset c = offsets.get(node);
    // Signed numbers convert to double in one instruction.
    return origin_W_ + grid_.quantum_um() * Vector3d(static_cast<double>(static_cast<std::int64_t>(c[0])),
                                                     static_cast<double>(static_cast<std::int64_t>(c[1])),
                                                     static_cast<double>(static_cast<std::int64_t>(c[2])));
  });
}

inline bool Tile::isHome(std::uint32_t node) const {
  return withOffsets([this, node](const auto& offsets) {
    const Offset c = offsets.get(node);
    return c[0] - home_lo_[0] <= home_range_[0] && c[1] - home_lo_[1] <= home_range_[1] &&
           c[2] - home_lo_[2] <= home_range_[2];
  });
}

inline Tile::Incident Tile::incident(std::uint32_t node) const {
  const NodeBlock& block = nodes_[node / 32];
  const std::uint32_t bit = 1u << (node % 32);
  const bool prev = (block.prev & bit) != 0, next = (block.next & bit) != 0;
  if (!prev && !next) {
    const std::uint32_t code = listed_[block.listed_before + ones(~(block.prev | block.next) & (bit - 1))];
    if (code % 2 == 1) return {nullptr, code / 2, 1};
    return {&lists_[code / 2 + 1], 0, lists_[code / 2]};
  }
  const Fragment& f = fragments_[fragmentOfNode(node)];
  const std::uint32_t at = f.begin + (node - f.child_node);  // the segment of which the node is the child
  return {nullptr, prev ? at : at + 1, std::uint32_t{prev} + std::uint32_t{next}};
}

template <class Visit>
[[gnu::always_inline]] inline std::uint32_t Tile::visitIncident(std::uint32_t node, std::uint32_t most,
                                                                Visit&& visit) const {
  const NodeBlock& block = nodes_[node / 32];
  const bool prev = (block.prev >> node % 32 & 1) != 0, next = (block.next >> node % 32 & 1) != 0;
  if (!prev && !next) {
    const Incident segments = incident(node);
    if (segments.size() <= most)
      for (const std::uint32_t segment : segments) visit(segment, link(segment));
    return static_cast<std::uint32_t>(segments.size());
  }
  const std::uint32_t fragment = fragmentOfNode(node);
  const Fragment& f = fragments_[fragment];
  const std::uint32_t at = node - f.child_node;  // for the lead: -1, modulo 2^32; likewise below
  const NodeId id{f.cell, firstSample(fragment) + at};
  if (prev) {
    const SegmentId segment{f.cell, f.first_rank + at};
    if (at > 0)
      visit(f.begin + at, Link{segment, node, node - 1, id, {id.cell, id.sample - 1}});
    else
      visit(f.begin, Link{segment, node, f.parent_node, id, nodeId(f.parent_node)});
  }
  if (next)
    visit(f.begin + at + 1, Link{{f.cell, f.first_rank + at + 1}, node + 1, node, {id.cell, id.sample + 1}, id});
  return std::uint32_t{prev} + std::uint32_t{next};
}

// Appearance: the radius and the SWC type of the child of each owned segment, in the order of the tile's segments. For
// drawing and export. The radius of a ghost's child comes from the tile that owns the ghost, the radius of a root from
// its cell (CellDetail).
struct TileAppearance {
  std::vector<float> radii_um;
  std::vector<std::uint16_t> types;
};

}  // namespace filiform
