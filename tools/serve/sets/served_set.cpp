#include "tools/serve/sets/served_set.h"

#include <utility>

namespace filiform::tools {

namespace {

struct TilesInBox final : Region {
  WorldBox box;
  explicit TilesInBox(const WorldBox& b) : box(b) {}
  bool mayMeet(const WorldBox& other) const noexcept override {
    return (box.lo_W.array() <= other.hi_W.array()).all() && (box.hi_W.array() >= other.lo_W.array()).all();
  }
};

}  // namespace

ServedSet::ServedSet(std::string name, const std::string& path, std::uint64_t budget_bytes, const RemoteOptions& remote)
    : name_(std::move(name)),
      set_(TileSet::open(path, remote)),
      levels_(Levels::open(*set_)),
      attributes_(*set_),
      store_(*set_),
      nearest_(store_, {.budget_bytes = budget_bytes / 4 * 3}),
      finder_(store_),
      sample_ids_(store_, budget_bytes / 4) {}

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
  for (const auto& [tile, box] : finder_.meeting(TilesInBox({lo_W, hi_W}))) segments += store_.entry(tile).stored;
  return segments;
}

}  // namespace filiform::tools
