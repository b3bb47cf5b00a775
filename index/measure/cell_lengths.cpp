#include "index/measure/cell_lengths.h"

#include "index/query/segment_pass.h"
#include "index/query/soma_finder.h"
#include "index/set/tiles_ahead.h"

#include <algorithm>
#include <memory>

namespace filiform::tools {

CellLengths::CellLengths(const TileStore& store, const std::vector<std::uint32_t>& cells)
    : store_(store), lengths_um_(store.cell_count()), wanted_(store.cell_count()) {
  for (const std::uint32_t cell : cells) wanted_[cell] = true;
  tiles_ = tilesOf(store, cells);
}

void CellLengths::measure(const std::function<void(std::size_t)>& progress) {
  std::fill(lengths_um_.begin(), lengths_um_.end(), 0.0);
  SomaFinder finder(store_);
  TilesAhead ahead(store_, tiles_, true);
  for (std::size_t i = 0; i < tiles_.size(); ++i) {
    const auto [loaded, appearance] = ahead.next();
    const std::shared_ptr<const Tile>& tile = loaded;  // a lambda cannot capture a structured binding
    finder.offer(tile, appearance);
    const auto soma_of = [&](std::uint32_t node) { return finder.of(tile->nodeId(node), tile->gridPoint(node)); };
    std::size_t owned = 0;
    for (std::uint32_t segment = 0; segment < tile->segment_count(); ++segment) {
      if (!tile->owned(segment)) continue;
      const std::uint16_t type = appearance.types[owned++];
      const Tile::Link link = tile->link(segment);
      if (!wanted_[link.id.cell]) continue;
      if (type == kSomaType) {
        const auto soma = soma_of(link.child);
        if (soma && soma == soma_of(link.parent)) continue;
      }
      lengths_um_[link.id.cell] += (tile->position_W(link.child) - tile->position_W(link.parent)).norm();
    }
    progress(i + 1);
  }
}

}  // namespace filiform::tools
