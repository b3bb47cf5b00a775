#include "index/errors.h"
#include "index/text.h"
#include "index/tile/packed_tree.h"
#include "index/tile/reference_tree.h"
#include "index/tile/tile_engine.h"

#include <utility>

namespace filiform {

TileEngineKind tileEngineOf(const std::string& name) {
  if (name == "packed") return TileEngineKind::packed;
  if (name == "cgal") return TileEngineKind::cgal;
  throw UsageError("search engine \"" + inShort(name) + "\" is not in this build; use packed or cgal");
}

std::unique_ptr<TileEngine> makeTileEngine(TileEngineKind kind, std::shared_ptr<const Tile> tile, SomeRuns some) {
  return kind == TileEngineKind::cgal ? makeReferenceTree(std::move(tile), std::move(some))
                                      : makePackedTree(std::move(tile), "", std::move(some));
}

}  // namespace filiform
