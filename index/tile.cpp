#include "index/tile.h"

#include <algorithm>

namespace filiform {
namespace {

struct NodeAt {
  std::uint64_t key;
  const GridPoint* p;
  bool operator<(const NodeAt& other) const { return key < other.key; }
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

  // Children come in the order of node ids already, but for graphs with other names; parents follow them along a run.
  // So what must be sorted is little: the parents that no child of the tile stands for.
  const auto child_key = [](const StoredSegment& s) { return NodeId{s.id.cell, s.child_sample}.key(); };
  const auto parent_key = [](const StoredSegment& s) { return NodeId{s.id.cell, s.parent_sample}.key(); };
  std::vector<NodeAt> rows, strays;
  rows.reserve(n + n / 8);
  for (std::uint32_t s = 0; s < n; ++s) {
    const bool follows = s > 0 && parent_key(segments[s]) == child_key(segments[s - 1]);
    if (!follows && segments[s].parent_sample != segments[s].child_sample)
      strays.push_back({parent_key(segments[s]), &segments[s].parent});
    rows.push_back({child_key(segments[s]), &segments[s].child});
  }
  if (!std::is_sorted(rows.begin(), rows.end())) std::sort(rows.begin(), rows.end());
  std::sort(strays.begin(), strays.end());
  const auto middle = static_cast<std::ptrdiff_t>(rows.size());
  rows.insert(rows.end(), strays.begin(), strays.end());
  std::inplace_merge(rows.begin(), rows.begin() + middle, rows.end());
  rows.erase(std::unique(rows.begin(), rows.end(), [](const NodeAt& a, const NodeAt& b) { return a.key == b.key; }),
             rows.end());

  GridBox bounds;
  for (const NodeAt& row : rows) bounds.extend(*row.p);
  const bool wide = !rows.empty() && (bounds.hi - bounds.lo).maxCoeff() > INT32_MAX;
  if (!rows.empty()) origin_ = bounds.lo;
  node_ids_.reserve(rows.size());
  (wide ? wide_.reserve(rows.size()) : offsets_.reserve(rows.size()));
  for (const NodeAt& row : rows) {
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
  std::uint32_t child = 0;
  for (std::uint32_t s = 0; s < n; ++s) {
    const StoredSegment& segment = segments[s];
    const std::uint32_t before = child;  // of the segment before
    const NodeId child_id{segment.id.cell, segment.child_sample}, parent_id{segment.id.cell, segment.parent_sample};
    while (child < node_ids_.size() && node_ids_[child].key() < child_id.key()) ++child;
    if (child == node_ids_.size() || node_ids_[child] != child_id) child = *findNode(child_id);
    std::uint32_t parent = child;
    if (parent_id != child_id) parent = s > 0 && node_ids_[before] == parent_id ? before : *findNode(parent_id);
    children_.push_back(child);
    parents_.push_back(parent);
    segment_ranks_.push_back(segment.id.segment);
    owned_.push_back(segment.owned);
    owned_count_ += segment.owned;
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

  if (!is_long_) {
    const GridBox cell = key_.box();
    for (std::uint32_t node = 0; node < node_count(); ++node) {
      const GridPoint p = gridPoint(node);
      if ((p.array() >= cell.lo.array()).all() && (p.array() <= cell.hi.array()).all())
        incident_begin_[node] |= kHomeBit;
    }
  }

  bytes_ = sizeof(Tile) + heapBytes(node_ids_) + heapBytes(offsets_) + heapBytes(wide_) + heapBytes(children_) +
           heapBytes(parents_) + heapBytes(segment_ranks_) + heapBytes(owned_) + heapBytes(incident_begin_) +
           heapBytes(incident_);
}

GridPoint Tile::gridPoint(std::uint32_t node) const {
  if (!wide_.empty()) return wide_[node];
  return origin_ + offsets_[node].cast<std::int64_t>();
}

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
