#include "viewer/scene/drawn_somata.h"

#include <cmath>
#include <utility>
#include <vector>

namespace filiform {

namespace {

constexpr double kCoarseRadius = 0.04;  // levels store radii in few bits

void putSoma(SomaTable& table, std::uint32_t cell, const std::shared_ptr<const Soma>& soma) {
  table[{cell, soma->root}] = soma;
  for (const std::uint32_t sample : soma->samples) table[{cell, sample}] = soma;
}

// Finds three-point somata by their shape: nodes of level tiles are no samples.
SomaTable threePointsInLevel(const Tile& tile, const TileAppearance& appearance) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> arms;  // outer nodes, by the node at which they end
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (appearance.types[s] != kSomaType || tile.isolated(s)) continue;
    const std::uint32_t child = tile.child(s), parent = tile.parent(s);
    const bool child_ends = tile.incident(child).size() == 1, parent_ends = tile.incident(parent).size() == 1;
    if (child_ends == parent_ends) continue;
    const double length_um = (tile.position_W(child) - tile.position_W(parent)).norm();
    const double off_um = std::abs(static_cast<double>(appearance.radii_um[s]) - length_um);
    if (!(off_um <= (kCoarseRadius + kThreePointTolerance) * length_um)) continue;
    arms[child_ends ? parent : child].push_back(child_ends ? child : parent);
  }
  SomaTable table;
  for (const auto& [node, outer] : arms) {
    if (outer.size() > 2) continue;
    const Vector3d centre_W = tile.position_W(node), a_W = tile.position_W(outer.front());
    // If the other outer sample is in another tile, assume that it lies opposite.
    const Vector3d b_W = outer.size() == 2 ? tile.position_W(outer.back()) : Vector3d(2 * centre_W - a_W);
    const NodeId id = tile.nodeId(node);
    const SomaSample samples[] = {{id.sample, 0, centre_W, static_cast<float>((a_W - b_W).norm() / 2), true},
                                  {tile.nodeId(outer.front()).sample, 0, a_W, 0, false},
                                  {tile.nodeId(outer.back()).sample, 0, b_W, 0, false}};
    if (threePointOf(samples, tile.grid().quantum_um()) != ThreePoint::kYes) continue;
    if (std::optional<Soma> soma = somaOf(samples, tile.grid().quantum_um()))
      putSoma(table, id.cell, std::make_shared<const Soma>(std::move(*soma)));
  }
  return table;
}

}  // namespace

void addRoots(const TileStore& store, std::uint32_t cell, RootTable& roots) {
  for (const CellDetail::Root& root : store.loadCellDetail(cell).roots) roots[{cell, root.rank}] = root;
}

SomaTable somataIn(const Tile& tile, const TileAppearance& appearance, const RootTable& roots, SomaFinder& finder) {
  SomaTable table;
  std::vector<bool> is_soma(tile.node_count(), false), has_own(tile.node_count(), false);
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    has_own[tile.child(s)] = true;
    is_soma[tile.child(s)] = appearance.types[s] == kSomaType;
  }
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s) || tile.isolated(s)) continue;
    const std::uint32_t parent = tile.parent(s);
    const NodeId id = tile.nodeId(parent);
    if (!has_own[parent]) {  // a root, or a sample whose own segment is in another tile
      const auto root = roots.find(id);
      if (root != roots.end() ? root->second.type != kSomaType : appearance.types[s] != kSomaType) continue;
    } else if (!is_soma[parent]) {
      continue;
    }
    if (table.contains(id)) continue;
    if (const auto soma = finder.ofIfReadable(id, tile.gridPoint(parent))) putSoma(table, id.cell, soma);
  }
  return table;
}

SomaTable somataInLevel(const Tile& tile, const TileAppearance& appearance, SomaFinder& finder) {
  SomaTable table = threePointsInLevel(tile, appearance);
  std::vector<bool> looked_up(tile.node_count(), false);
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (appearance.types[s] != kSomaType || tile.isolated(s)) continue;
    for (const std::uint32_t node : {tile.child(s), tile.parent(s)}) {
      const NodeId id = tile.nodeId(node);
      if (looked_up[node] || table.contains(id)) continue;
      looked_up[node] = true;
      const auto soma = finder.atIfReadable(id.cell, tile.gridPoint(node));
      if (soma && soma->form == Soma::Form::kContour) table[id] = soma;
    }
  }
  return table;
}

}  // namespace filiform
