// SampleRadii: the radius of any sample, by its place. A tile states the radii of the children of its own segments; the
// radius of a parent may be that of another tile, or of its cell.
#pragma once

#include "index/query/kept_tiles.h"

#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

namespace filiform::internal {

// Thread rule: internally synchronised.
class SampleRadii {
 public:
  // Keeps tiles up to this many bytes. The store must outlive this object.
  SampleRadii(const TileStore& store, std::uint64_t budget_bytes) : tiles_(store, budget_bytes) {}

  const TileStore& tiles() const { return tiles_; }  // reads through what is kept
  // kUnknownRadius if it is not known. Throws what the store throws. At most three tiles are read.
  float of(NodeId sample, const GridPoint& at);

 private:
  using Roots = std::vector<CellDetail::Root>;
  static constexpr std::size_t kMostCells = 4096;
  std::shared_ptr<const Roots> rootsOf(std::uint32_t cell);

  KeptTiles tiles_;
  std::mutex mutex_;
  std::unordered_map<std::uint32_t, std::shared_ptr<const Roots>> roots_;  // by cell
};

}  // namespace filiform::internal
