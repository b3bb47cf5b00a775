#include "index/measure/internal/sample_radii.h"

#include "index/geometry/partition.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {

std::shared_ptr<const SampleRadii::Roots> SampleRadii::rootsOf(std::uint32_t cell) {
  {
    const std::lock_guard lock(mutex_);
    if (const auto known = roots_.find(cell); known != roots_.end()) return known->second;
  }
  auto roots = std::make_shared<const Roots>(tiles_.loadCellDetail(cell).roots);
  const std::lock_guard lock(mutex_);
  if (roots_.size() >= kMostCells) roots_.clear();
  return roots_[cell] = std::move(roots);
}

float SampleRadii::of(NodeId sample, const GridPoint& at) {
  const TileId home = tiles_.home(at);
  if (home == kNoTile) return kUnknownRadius;
  const std::shared_ptr<const Tile> tile = tiles_.load(home);
  const std::optional<std::uint32_t> node = tile->findNode(sample);
  if (!node) return kUnknownRadius;
  for (const std::uint32_t segment : tile->incident(*node)) {
    const Tile::Link link = tile->link(segment);
    if (link.child != *node) continue;
    for (const TileId id :
         {tile->owned(segment) ? home
                               : tiles_.home(midpoint(tile->gridPoint(link.child), tile->gridPoint(link.parent))),
          tiles_.long_tile()}) {
      if (id == kNoTile) continue;
      const std::shared_ptr<const Tile> owner = tiles_.load(id);
      const std::optional<std::uint32_t> found = owner->findSegment(link.id);
      if (found && owner->owned(*found)) return tiles_.appearance(id)->radii_um[owner->ownedIndex(*found)];
    }
  }
  const std::shared_ptr<const Roots> roots = rootsOf(sample.cell);
  const auto root = std::lower_bound(roots->begin(), roots->end(), sample.sample,
                                     [](const CellDetail::Root& r, std::uint32_t rank) { return r.rank < rank; });
  return root != roots->end() && root->rank == sample.sample ? root->radius_um : kUnknownRadius;
}

}  // namespace filiform::internal
