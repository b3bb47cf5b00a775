#include "tests/support/scenes/tile_invariants.h"

#include "index/geometry/partition.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

bool sameFloat(float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }

bool meetsBox(const StoredSegment& s, const GridBox& box) {
  for (int i = 0; i < 3; ++i)  // most are far away, so this test is quick
    if (std::max(s.child[i], s.parent[i]) < box.lo[i] || std::min(s.child[i], s.parent[i]) > box.hi[i]) return false;
  return segmentMeetsBox(s.child, s.parent, box);
}

Partition partitionOf(const std::vector<StoredSegment>& segments, std::uint32_t capacity) {
  std::vector<MortonKey> midpoints;
  for (const StoredSegment& s : segments) midpoints.push_back(mortonKey(midpoint(s.child, s.parent)));
  std::sort(midpoints.begin(), midpoints.end());
  return Partition::split(midpoints, capacity);
}

void expectCellTable(const TileStore& store, const std::vector<Cell>& cells) {
  ASSERT_EQ(store.cell_count(), cells.size());
  for (std::uint32_t c = 0; c < cells.size(); ++c) {
    const Cell& cell = cells[c];
    const CellRecord& record = store.cell(c);
    EXPECT_EQ(record.source, cell.source);
    EXPECT_EQ(store.findCell(record.name), c) << record.name;
    EXPECT_EQ(record.samples, cell.samples());
    std::set<std::uint32_t> parents(cell.parents.begin(), cell.parents.end());
    std::uint64_t isolated = 0, roots = 0;
    GridBox bounds;
    std::vector<std::uint32_t> root_ranks;
    for (std::uint32_t i = 0; i < cell.samples(); ++i) {
      bounds.extend(store.grid().snap(cell.positions_um[i]));
      if (cell.parents[i] != kNoParent) continue;
      ++roots;
      isolated += parents.count(i) == 0;
      root_ranks.push_back(i);
    }
    EXPECT_EQ(record.roots, roots);
    EXPECT_EQ(record.isolated, isolated);
    EXPECT_EQ(record.segments, cell.samples() - roots);
    EXPECT_EQ(record.bounds.lo, bounds.lo);
    EXPECT_EQ(record.bounds.hi, bounds.hi);
    const CellDetail detail = store.loadCellDetail(c);
    EXPECT_EQ(detail.sample_ids.all(), cell.sample_ids);
    EXPECT_EQ(detail.block_starts, cell.block_starts);
    ASSERT_EQ(detail.roots.size(), root_ranks.size());
    for (std::size_t i = 0; i < root_ranks.size(); ++i) {
      EXPECT_EQ(detail.roots[i].rank, root_ranks[i]);
      EXPECT_TRUE(sameFloat(detail.roots[i].radius_um, cell.radii_um[root_ranks[i]]));
      EXPECT_EQ(detail.roots[i].type, cell.types[root_ranks[i]]);
    }
  }
}

}  // namespace

std::vector<StoredSegment> snappedSegments(const std::vector<Cell>& cells, const Grid& grid) {
  std::vector<StoredSegment> all;
  for (std::uint32_t c = 0; c < cells.size(); ++c) {
    const Cell& cell = cells[c];
    const std::set<std::uint32_t> parents(cell.parents.begin(), cell.parents.end());
    for (std::uint32_t i = 0; i < cell.samples(); ++i) {
      std::uint32_t parent = cell.parents[i];
      if (parent == kNoParent) {
        if (parents.count(i)) continue;
        parent = i;
      }
      all.push_back({{c, i}, i, parent, grid.snap(cell.positions_um[i]), grid.snap(cell.positions_um[parent]), true});
    }
  }
  return all;
}

void expectTilesHold(const TileStore& store, const std::vector<Cell>& cells) {
  expectCellTable(store, cells);
  const std::vector<StoredSegment> segments = snappedSegments(cells, store.grid());
  const Partition partition = partitionOf(segments, store.capacity());
  std::vector<GridBox> closed_leaves;
  for (const BlockKey& leaf : partition.leaves()) closed_leaves.push_back(closedBlock(leaf));
  std::map<SegmentId, const StoredSegment*> by_id;
  std::map<NodeId, std::vector<SegmentId>> incident;
  std::map<NodeId, GridPoint> nodes;
  std::set<SegmentId> long_segments;
  for (const StoredSegment& s : segments) {
    by_id[s.id] = &s;
    for (const auto& [sample, p] : {std::pair(s.child_sample, s.child), std::pair(s.parent_sample, s.parent)}) {
      const NodeId node{s.id.cell, sample};
      nodes[node] = p;
      std::vector<SegmentId>& at = incident[node];
      if (at.empty() || at.back() != s.id) at.push_back(s.id);
    }
    std::size_t met = 0;
    for (const GridBox& leaf : closed_leaves) met += meetsBox(s, leaf);
    ASSERT_GE(met, 1u);
    if (met > kMaxLeavesOfSegment) long_segments.insert(s.id);
  }
  ASSERT_EQ(store.long_tile() != kNoTile, !long_segments.empty());
  if (!long_segments.empty()) {
    ASSERT_EQ(store.long_tile() + 1, store.tile_count());
  }
  ASSERT_EQ(store.leaves().size() + !long_segments.empty(), store.tile_count());

  std::map<SegmentId, int> owners;
  std::vector<std::set<TileId>> owning(cells.size());
  for (TileId t = 0; t < store.tile_count(); ++t) {
    SCOPED_TRACE("tile " + std::to_string(t));
    const std::shared_ptr<const Tile> tile = store.load(t);
    const TileEntry& entry = store.entry(t);
    const bool is_long = t == store.long_tile();
    const GridBox closed = closedBlock(entry.key);
    ASSERT_EQ(tile->id(), t);
    ASSERT_EQ(tile->isLong(), is_long);
    ASSERT_EQ(tile->key(), entry.key);
    if (!is_long) {
      ASSERT_EQ(store.leaves().home(mortonPoint(entry.key.low)), t);
      ASSERT_TRUE(std::count(partition.leaves().begin(), partition.leaves().end(), entry.key) == 1);
      if (t > 0) {
        ASSERT_GT(entry.key.low, store.entry(t - 1).key.high());
      }
    }
    EXPECT_GT(tile->segment_count(), 0u);
    EXPECT_EQ(entry.stored, tile->segment_count());
    EXPECT_EQ(entry.owned, tile->owned_count());
    EXPECT_EQ(entry.decoded_bytes, tile->bytes());

    const TileAppearance appearance = store.loadAppearance(t);
    ASSERT_EQ(appearance.radii_um.size(), tile->owned_count());
    ASSERT_EQ(appearance.types.size(), tile->owned_count());
    std::set<SegmentId> stored;
    std::uint32_t isolated = 0, owned = 0;
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
      const SegmentId id = tile->segmentId(s);
      ASSERT_TRUE(by_id.count(id));
      const StoredSegment& expected = *by_id[id];
      ASSERT_TRUE(stored.insert(id).second);
      if (s > 0) {
        ASSERT_LT(tile->segmentId(s - 1), id);
      }
      ASSERT_EQ(tile->findSegment(id), s);
      ASSERT_EQ(tile->nodeId(tile->child(s)), (NodeId{id.cell, expected.child_sample}));
      ASSERT_EQ(tile->nodeId(tile->parent(s)), (NodeId{id.cell, expected.parent_sample}));
      ASSERT_EQ(tile->gridPoint(tile->child(s)), expected.child);
      ASSERT_EQ(tile->gridPoint(tile->parent(s)), expected.parent);
      ASSERT_EQ(tile->position_W(tile->child(s)), store.grid().toWorld(expected.child));
      ASSERT_EQ(tile->isolated(s), expected.child_sample == expected.parent_sample);
      ASSERT_EQ(tile->ownedIndex(s), owned);
      if (tile->owned(s)) {
        ASSERT_TRUE(sameFloat(appearance.radii_um[owned], cells[id.cell].radii_um[expected.child_sample]));
        ASSERT_EQ(appearance.types[owned], cells[id.cell].types[expected.child_sample]);
        ++owned;
        ++owners[id];
        isolated += tile->isolated(s);
        owning[id.cell].insert(t);
        ASSERT_EQ(is_long, long_segments.count(id) == 1);
        if (!is_long) {
          ASSERT_TRUE(entry.key.contains(mortonKey(midpoint(expected.child, expected.parent))));
        }
      }
      // Dense points of the part inside the block lie in the content box.
      for (int k = 0; k <= 8; ++k) {
        const Vector3d p = expected.child.cast<double>() + k / 8.0 * (expected.parent - expected.child).cast<double>();
        if (!is_long && ((p.array() < closed.lo.cast<double>().array()).any() ||
                         (p.array() > closed.hi.cast<double>().array()).any()))
          continue;
        ASSERT_TRUE((p.array() >= entry.content.lo.cast<double>().array()).all());
        ASSERT_TRUE((p.array() <= entry.content.hi.cast<double>().array()).all());
      }
    }
    EXPECT_EQ(entry.isolated, isolated);
    for (const StoredSegment& s : segments) {
      const bool crosses_many = long_segments.count(s.id) == 1;
      const bool wanted = is_long ? crosses_many
                          : crosses_many
                              ? entry.key.contains(mortonKey(s.child)) || entry.key.contains(mortonKey(s.parent))
                              : meetsBox(s, closed);
      ASSERT_EQ(stored.count(s.id) == 1, wanted) << "segment " << s.id.cell << ":" << s.id.segment;
    }
    for (std::uint32_t n = 0; n < tile->node_count(); ++n) {
      const NodeId node = tile->nodeId(n);
      ASSERT_EQ(tile->findNode(node), n);
      ASSERT_EQ(tile->isHome(n), !is_long && store.leaves().home(tile->gridPoint(n)) == t);
      std::vector<SegmentId> here;
      for (std::uint32_t s : tile->incident(n)) here.push_back(tile->segmentId(s));
      ASSERT_TRUE(std::is_sorted(here.begin(), here.end()));
      if (tile->isHome(n)) {
        ASSERT_EQ(here, incident[node]);
      }
    }
  }
  EXPECT_EQ(owners.size(), segments.size());
  for (const auto& [id, times] : owners) EXPECT_EQ(times, 1) << id.cell << ":" << id.segment;
  for (const auto& [node, p] : nodes) {
    const TileId home = store.leaves().home(p);
    ASSERT_NE(home, kNoTile);
    ASSERT_TRUE(store.load(home)->findNode(node));
  }
  for (std::uint32_t c = 0; c < cells.size(); ++c)
    EXPECT_EQ(store.loadCellDetail(c).tiles, std::vector<TileId>(owning[c].begin(), owning[c].end()));
}

void expectSameTile(const Tile& a, const Tile& b) {
  EXPECT_EQ(a.id(), b.id());
  EXPECT_EQ(a.key(), b.key());
  EXPECT_EQ(a.isLong(), b.isLong());
  EXPECT_EQ(a.bytes(), b.bytes());
  EXPECT_EQ(a.owned_count(), b.owned_count());
  ASSERT_EQ(a.node_count(), b.node_count());
  ASSERT_EQ(a.segment_count(), b.segment_count());
  for (std::uint32_t n = 0; n < a.node_count(); ++n) {
    ASSERT_EQ(a.nodeId(n), b.nodeId(n));
    ASSERT_EQ(a.gridPoint(n), b.gridPoint(n));
    const auto x = a.incident(n), y = b.incident(n);
    ASSERT_TRUE(std::equal(x.begin(), x.end(), y.begin(), y.end()));
  }
  for (std::uint32_t s = 0; s < a.segment_count(); ++s) {
    ASSERT_EQ(a.segmentId(s), b.segmentId(s));
    ASSERT_EQ(a.child(s), b.child(s));
    ASSERT_EQ(a.parent(s), b.parent(s));
    ASSERT_EQ(a.owned(s), b.owned(s));
  }
}

void expectSameTiles(const TileStore& a, const TileStore& b) {
  ASSERT_EQ(a.tile_count(), b.tile_count());
  EXPECT_EQ(a.long_tile(), b.long_tile());
  for (TileId t = 0; t < a.tile_count(); ++t) {
    SCOPED_TRACE("tile " + std::to_string(t));
    expectSameTile(*a.load(t), *b.load(t));
    EXPECT_EQ(a.entry(t).content.lo, b.entry(t).content.lo);
    EXPECT_EQ(a.entry(t).content.hi, b.entry(t).content.hi);
    const TileAppearance x = a.loadAppearance(t), y = b.loadAppearance(t);
    EXPECT_EQ(x.types, y.types);
    EXPECT_TRUE(std::equal(x.radii_um.begin(), x.radii_um.end(), y.radii_um.begin(), y.radii_um.end(), sameFloat));
  }
}

}  // namespace filiform::test
