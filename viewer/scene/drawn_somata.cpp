#include "viewer/scene/drawn_somata.h"

#include <utility>
#include <vector>

namespace filiform {

namespace {

void putSoma(SomaTable& table, std::uint32_t cell, const std::shared_ptr<const Soma>& soma) {
  table[{cell, soma->root}] = soma;
  for (const std::uint32_t sample : soma->samples) table[{cell, sample}] = soma;
}

}  // namespace

void addRoots(const TileStore& store, std::uint32_t cell, RootTable& roots) {
  for (const CellDetail::Root& root : store.loadCellDetail(cell).roots) roots[{cell, root.rank}] = root;
}

SomaTable somataIn(const Tile& tile, const TileAppearance& appearance, const RootTable& roots, SomaFinder& finder) {
  SomaTable table;
  std::vector<bool> is_soma(tile.node_count(), false), has_own(tile.node_count(), false);
  std::size_t owned = 0;
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    has_own[tile.child(s)] = true;
    is_soma[tile.child(s)] = appearance.types[owned++] == kSomaType;
  }
  owned = 0;
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
    if (!tile.owned(s)) continue;
    const std::uint16_t type = appearance.types[owned++];
    if (tile.isolated(s)) continue;
    const std::uint32_t parent = tile.parent(s);
    const NodeId id = tile.nodeId(parent);
    if (!has_own[parent]) {  // a root, or a sample whose own segment another tile owns
      const auto root = roots.find(id);
      if (root != roots.end() ? root->second.type != kSomaType : type != kSomaType) continue;
    } else if (!is_soma[parent]) {
      continue;
    }
    if (table.contains(id)) continue;
    if (const auto soma = finder.ofIfReadable(id, tile.gridPoint(parent))) putSoma(table, id.cell, soma);
  }
  return table;
}

}  // namespace filiform
