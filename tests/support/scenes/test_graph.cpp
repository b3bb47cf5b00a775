#include "tests/support/scenes/test_graph.h"

#include <algorithm>
#include <stdexcept>

namespace filiform::test {

namespace {

constexpr std::uint32_t kFirstLoopRank = 1000000;

struct Leaf {
  BlockKey key;
  std::vector<StoredSegment> segments;
};

void split(const BlockKey& key, std::vector<StoredSegment> segments, std::uint32_t capacity,
           std::vector<Leaf>& leaves) {
  if (segments.empty()) return;
  if (segments.size() <= capacity || key.depth == kMortonBits) {
    leaves.push_back({key, std::move(segments)});
    return;
  }
  std::vector<StoredSegment> halves[2];
  for (int bit = 0; bit < 2; ++bit) {
    const GridBox box = key.half(bit).box();
    for (const StoredSegment& s : segments)
      if (segmentMeetsBox(s.child, s.parent, box)) halves[bit].push_back(s);
  }
  // Coincident nodes cannot be separated, and halving down to single grid points would only cost time.
  const bool futile = key.depth > 100 && halves[0].size() + halves[1].size() >= 2 * segments.size();
  if (futile) {
    leaves.push_back({key, std::move(segments)});
    return;
  }
  segments = {};
  for (int bit = 0; bit < 2; ++bit) split(key.half(bit), std::move(halves[bit]), capacity, leaves);
}

}  // namespace

std::uint32_t TestGraphBuilder::node(std::uint32_t cell, const Vector3d& p_W) {
  const auto number = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({{cell, number}, graph_.grid.snap(p_W), false});
  return number;
}

std::uint32_t TestGraphBuilder::link(std::uint32_t child, std::uint32_t parent) { return add(child, parent, child); }

std::uint32_t TestGraphBuilder::loop(std::uint32_t child, std::uint32_t parent) {
  return add(child, parent, kFirstLoopRank + loops_++);
}

std::uint32_t TestGraphBuilder::add(std::uint32_t child, std::uint32_t parent, std::uint32_t rank) {
  // Both nodes of a segment belong to one cell, by which their tile identifies them.
  if (nodes_[child].id.cell != nodes_[parent].id.cell) throw std::logic_error("segment between two cells");
  nodes_[child].linked = nodes_[parent].linked = true;
  graph_.segments.push_back({{nodes_[child].id.cell, rank},
                             nodes_[child].id.sample,
                             nodes_[parent].id.sample,
                             nodes_[child].point,
                             nodes_[parent].point,
                             true});
  return static_cast<std::uint32_t>(graph_.segments.size() - 1);
}

TestGraph TestGraphBuilder::build() const {
  TestGraph graph = graph_;
  for (const Node& n : nodes_)
    if (!n.linked)
      graph.segments.push_back({{n.id.cell, n.id.sample}, n.id.sample, n.id.sample, n.point, n.point, true});
  return graph;
}

TestGraph randomGraph(std::mt19937_64& random, std::uint32_t nodes, bool loops, const Vector3d& centre_W) {
  TestGraphBuilder builder;
  std::uniform_real_distribution<double> unit(-1.0, 1.0), chance(0.0, 1.0);
  const auto direction = [&] { return Vector3d{unit(random), unit(random), unit(random)}; };
  const std::uint32_t cells = 1 + static_cast<std::uint32_t>(random() % 3);
  for (std::uint32_t cell = 0; cell < cells; ++cell) {
    std::vector<std::uint32_t> own{builder.node(cell, centre_W + 3.0 * direction())};
    Vector3d heading = direction();
    std::uint32_t tip = own[0];
    while (own.size() < std::max(1u, nodes / cells)) {
      const double what = chance(random);
      if (what < 0.12) tip = own[random() % own.size()];  // a branch
      if (what < 0.02) {                                  // a hub
        for (int i = 0; i < 12; ++i) {
          own.push_back(builder.node(cell, builder.position_W(tip) + direction()));
          builder.link(own.back(), tip);
        }
        continue;
      }
      heading = 0.7 * heading + 0.8 * direction();
      Vector3d p_W = builder.position_W(tip);
      if (what > 0.08) p_W += heading * (what > 0.97 ? 8.0 : 0.8);  // otherwise a segment of length zero
      if (what > 0.90 && what < 0.92) p_W = builder.position_W(own[random() % own.size()]);  // on another node
      const std::uint32_t next = builder.node(cell, p_W);
      builder.link(next, tip);
      own.push_back(next);
      tip = next;
    }
    if (loops)
      for (std::size_t i = 0; i < own.size() / 8; ++i)
        builder.loop(own[random() % own.size()], own[random() % own.size()]);
    if (chance(random) < 0.3) builder.node(cell, centre_W + 3.0 * direction());  // isolated
  }
  return builder.build();
}

TiledGraph::TiledGraph(const TestGraph& graph, std::uint32_t capacity) : table_(0) {
  std::vector<Leaf> leaves;
  split(BlockKey{}, graph.segments, capacity, leaves);
  std::vector<BlockKey> keys;
  for (Leaf& leaf : leaves) {
    keys.push_back(leaf.key);
    tiles_.push_back(std::make_unique<Tile>(static_cast<TileId>(tiles_.size()), leaf.key, false, graph.grid,
                                            std::move(leaf.segments)));
  }
  leaves_ = LeafIndex(std::move(keys));
  table_ = TileTable(tiles_.size());
  for (const auto& tile : tiles_) table_.add(*tile);
}

TileId TiledGraph::tileOf(SegmentId id) const {
  for (const auto& tile : tiles_)
    if (tile->findSegment(id)) return tile->id();
  return kNoTile;
}

}  // namespace filiform::test
