#include "tools/serve/sets/served_set.h"

#include "index/tile/box_region.h"

#include <utility>

namespace filiform::tools {

ServedSet::ServedSet(std::string name, const std::string& path, std::uint64_t budget_bytes, const RemoteOptions& remote)
    : name_(std::move(name)),
      set_(TileSet::open(path, remote)),
      levels_(Levels::open(*set_)),
      attributes_(*set_),
      store_(*set_),
      kept_(store_, budget_bytes / 16 * 3),
      nearest_(kept_, {.budget_bytes = budget_bytes / 8 * 3}),
      filtered_(kept_, budget_bytes / 8),
      finder_(store_),
      sample_ids_(store_, budget_bytes / 4),
      looks_(nearest_.tiles(), budget_bytes / 16) {}

const CellNumbers& ServedSet::cellNumbers() const {
  const std::lock_guard lock(late_mutex_);
  if (!numbers_) numbers_.emplace(store_, TimedStore::check);
  return *numbers_;
}

const CatmaidSpace& ServedSet::catmaidSpace() const {
  const std::lock_guard lock(late_mutex_);
  if (!catmaid_) catmaid_.emplace(*set_, levels_.get(), TimedStore::check);
  return *catmaid_;
}

std::uint64_t ServedSet::segmentsAround(const Vector3d& lo_W, const Vector3d& hi_W) const {
  std::uint64_t segments = 0;
  for (const auto& [tile, box] : finder_.meeting(BoxRegion({lo_W, hi_W}))) segments += store_.entry(tile).stored;
  return segments;
}

}  // namespace filiform::tools
