#include "index/tile.h"

#include <algorithm>

namespace filiform {
namespace {

struct NodeRow {
  std::uint64_t key;
  const GridPoint* p;
  bool operator<(const NodeRow& other) const { return key < other.key; }
};

NodeId nodeOf(std::uint64_t key) { return {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)}; }

template <typename T>
std::size_t heapBytes(const std::vector<T>& v) {
  return v.size() * sizeof(T);
}

}  // namespace

Tile::Tile(TileId id, const CellKey& key, bool is_long, const Grid& grid, std::vector<StoredSegment> segments)
    : id_(id), key_(key), is_long_(is_long), grid_(grid), origin_(GridPoint::Zero()) {
  const std::size_t n = segments.size();
  const auto by_id = [](const StoredSegment& a, const StoredSegment& b) { return a.id < b.id; };
  if (!std::is_sorted(segments.begin(), segments.end(), by_id)) std::sort(segments.begin(), segments.end(), by_id);

  std::vector<NodeRow> rows;
  rows.reserve(2 * n);
  for (const StoredSegment& s : segments) {
    rows.push_back({NodeId{s.id.cell, s.child_sample}.key(), &s.child});
    if (s.parent_sample != s.child_sample) rows.push_back({NodeId{s.id.cell, s.parent_sample}.key(), &s.parent});
  }
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end(), [](const NodeRow& a, const NodeRow& b) { return a.key == b.key; }),
             rows.end());

  GridBox bounds;
  for (const NodeRow& row : rows) bounds.extend(*row.p);
  const bool wide = !rows.empty() && (bounds.hi - bounds.lo).maxCoeff() > INT32_MAX;
  if (!rows.empty()) origin_ = bounds.lo;
  node_ids_.reserve(rows.size());
  (wide ? wide_.reserve(rows.size()) : offsets_.reserve(rows.size()));
  for (const NodeRow& row : rows) {
    node_ids_.push_back(nodeOf(row.key));
    if (wide) {
      wide_.push_back(*row.p);
    } else {
      offsets_.push_back((*row.p - origin_).cast<std::int32_t>());
    }
  }

  children_.reserve(n);
  parents_.reserve(n);
  segment_ranks_.reserve(n);
  owned_.reserve(n);
  incident_begin_.assign(rows.size() + 1, 0);
  for (const StoredSegment& s : segments) {
    const std::uint32_t child = *findNode({s.id.cell, s.child_sample});
    const std::uint32_t parent = s.parent_sample == s.child_sample ? child : *findNode({s.id.cell, s.parent_sample});
    children_.push_back(child);
    parents_.push_back(parent);
    segment_ranks_.push_back(s.id.segment);
    owned_.push_back(s.owned);
    owned_count_ += s.owned;
    ++incident_begin_[child + 1];
    if (parent != child) ++incident_begin_[parent + 1];
  }
  for (std::size_t i = 1; i < incident_begin_.size(); ++i) incident_begin_[i] += incident_begin_[i - 1];
  incident_.resize(incident_begin_.back());
  // Filled in the order of the segments, so each node's list is in the order of their ids.
  std::vector<std::uint32_t> next(incident_begin_.begin(), incident_begin_.end() - 1);
  for (std::uint32_t s = 0; s < n; ++s) {
    incident_[next[children_[s]]++] = s;
    if (parents_[s] != children_[s]) incident_[next[parents_[s]]++] = s;
  }

  bytes_ = sizeof(Tile) + heapBytes(node_ids_) + heapBytes(offsets_) + heapBytes(wide_) + heapBytes(children_) +
           heapBytes(parents_) + heapBytes(segment_ranks_) + heapBytes(owned_) + heapBytes(incident_begin_) +
           heapBytes(incident_);
}

GridPoint Tile::gridPoint(std::uint32_t node) const {
  if (!wide_.empty()) return wide_[node];
  return origin_ + offsets_[node].cast<std::int64_t>();
}

bool Tile::isHome(std::uint32_t node) const { return !is_long_ && key_.contains(mortonKey(gridPoint(node))); }

std::optional<std::uint32_t> Tile::findNode(NodeId id) const noexcept {
  const auto at = std::lower_bound(node_ids_.begin(), node_ids_.end(), id,
                                   [](const NodeId& a, const NodeId& b) { return a.key() < b.key(); });
  if (at == node_ids_.end() || *at != id) return std::nullopt;
  return static_cast<std::uint32_t>(at - node_ids_.begin());
}

std::optional<std::uint32_t> Tile::findSegment(SegmentId id) const noexcept {
  std::uint32_t low = 0, high = segment_count();
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (segmentId(middle).key() < id.key()) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low == segment_count() || segmentId(low) != id) return std::nullopt;
  return low;
}

}  // namespace filiform
