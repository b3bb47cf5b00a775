// A tile in memory: the segments of one leaf of the partition, as the hand and the search need them.
//
// A tile stores every segment that meets its closed cell: those whose midpoint lies in the cell are *owned*, the others
// are *ghosts* (stored again here, owned elsewhere). The tile whose cell contains a node is that node's *home* and
// holds all segments at it. Node and segment indices are local to the tile; NodeId and SegmentId are the same
// everywhere. Immutable after construction: any number of threads may read.
#pragma once

#include "index/grid.h"
#include "index/morton.h"

#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace filiform {

using TileId = std::uint32_t;  // rank of the leaf in key order; the long-segment tile, where there is one, comes last
inline constexpr TileId kNoTile = UINT32_MAX;

struct NodeId {  // a sample: cell, and rank among the samples kept of it
  std::uint32_t cell, sample;
  auto operator<=>(const NodeId&) const = default;
  std::uint64_t key() const { return std::uint64_t{cell} << 32 | sample; }
};
struct SegmentId {  // cell, and rank of the child among the samples kept of it
  std::uint32_t cell, segment;
  auto operator<=>(const SegmentId&) const = default;
  std::uint64_t key() const { return std::uint64_t{cell} << 32 | segment; }
};

// One segment as the tiler hands it over. An isolated sample is a segment from itself to itself (child_sample ==
// parent_sample).
struct StoredSegment {
  SegmentId id;
  std::uint32_t child_sample, parent_sample;
  GridPoint child, parent;
  bool owned;
};

class Tile {
 public:
  // Takes segments in any order. Requires every segment to meet the cell, or, for the long-segment tile (`key.depth` 0
  // beside other leaves), anything. Nothing is a home in the long-segment tile. O(n log n).
  Tile(TileId id, const CellKey& key, bool is_long, const Grid& grid, std::vector<StoredSegment> segments);

  TileId id() const { return id_; }
  const CellKey& key() const { return key_; }
  bool isLong() const { return is_long_; }
  std::uint32_t node_count() const { return static_cast<std::uint32_t>(node_ids_.size()); }
  std::uint32_t segment_count() const { return static_cast<std::uint32_t>(children_.size()); }  // owned and ghosts
  std::uint32_t owned_count() const { return owned_count_; }
  // Heap and object bytes: what a byte budget counts. A pure function of the tile's content.
  std::size_t bytes() const { return bytes_; }

  NodeId nodeId(std::uint32_t node) const { return node_ids_[node]; }
  GridPoint gridPoint(std::uint32_t node) const;
  Vector3d position_W(std::uint32_t node) const { return grid_.toWorld(gridPoint(node)); }  // exact, O(1)
  bool isHome(std::uint32_t node) const { return (incident_begin_[node] & kHomeBit) != 0; }
  // Segments at the node in the order of their ids. All of them iff isHome(node); else those that this tile happens to
  // hold.
  std::span<const std::uint32_t> incident(std::uint32_t node) const {
    return {incident_.data() + (incident_begin_[node] & ~kHomeBit),
            incident_.data() + (incident_begin_[node + 1] & ~kHomeBit)};
  }
  std::optional<std::uint32_t> findNode(NodeId id) const noexcept;  // O(log n)

  // Segments are in the order of their ids.
  SegmentId segmentId(std::uint32_t segment) const {
    return {node_ids_[children_[segment]].cell, segment_ranks_[segment]};
  }
  std::uint32_t child(std::uint32_t segment) const { return children_[segment]; }
  std::uint32_t parent(std::uint32_t segment) const { return parents_[segment]; }
  bool owned(std::uint32_t segment) const { return owned_[segment] != 0; }
  bool isolated(std::uint32_t segment) const { return children_[segment] == parents_[segment]; }
  std::optional<std::uint32_t> findSegment(SegmentId id) const noexcept;  // O(log n)

 private:
  TileId id_;
  CellKey key_;
  bool is_long_;
  Grid grid_;
  GridPoint origin_;
  std::uint32_t owned_count_ = 0;
  std::size_t bytes_ = 0;
  std::vector<NodeId> node_ids_;                            // ascending
  std::vector<Eigen::Matrix<std::int32_t, 3, 1>> offsets_;  // from origin_; empty in a wide tile
  std::vector<GridPoint> wide_;                             // absolute, only where offsets do not fit 32 bits
  std::vector<std::uint32_t> children_, parents_, segment_ranks_;
  std::vector<std::uint8_t> owned_;
  // incident_begin_ of a node whose home this is carries the bit, so that the solver need not compute a Morton key.
  static constexpr std::uint32_t kHomeBit = std::uint32_t{1} << 31;
  std::vector<std::uint32_t> incident_begin_, incident_;
};

// What only the eye and the exporter need, per stored segment in the order of the tile's segments: the child's
// attributes.
struct TileAppearance {
  std::vector<float> radii_um;
  std::vector<std::uint16_t> types;
};

}  // namespace filiform
