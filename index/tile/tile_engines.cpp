#include "index/errors.h"
#include "index/text.h"
#include "index/tile/packed_tree.h"
#include "index/tile/reference_tree.h"
#include "index/tile/tile_engine.h"

#include <utility>

namespace filiform {

void requireTileEngine(const std::string& name) {
  if (name != "packed" && name != "cgal")
    throw UsageError("search engine \"" + inShort(name) + "\" is not in this build; use packed or cgal");
}

std::unique_ptr<TileEngine> makeTileEngine(const std::string& name, std::shared_ptr<const Tile> tile, SomeRuns some) {
  requireTileEngine(name);
  return name == "cgal" ? makeReferenceTree(std::move(tile), std::move(some))
                        : makePackedTree(std::move(tile), "", std::move(some));
}

}  // namespace filiform
