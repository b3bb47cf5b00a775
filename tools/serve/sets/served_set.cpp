#include "tools/serve/sets/served_set.h"

#include "index/errors.h"
#include "index/remote/http_source.h"
#include "index/tile/box_region.h"

#include <algorithm>
#include <utility>

namespace filiform::tools {

namespace {

std::unique_ptr<TileSet> openedSet(const std::string& path, const RemoteOptions& remote, std::size_t open_files) {
  if (open_files == 0 || isAddress(path)) return TileSet::open(path, remote);
  const std::size_t kept = open_files - std::min<std::size_t>(open_files - 1, 2);  // beside the folder, and one in use
  try {
    return TileSet::open(openFolder(path, kept));
  } catch (const IoError&) {  // a new revision may have been published meanwhile
    return TileSet::open(openFolder(path, kept));
  }
}

}  // namespace

ServedSet::ServedSet(std::string name, const std::string& path, std::uint64_t budget_bytes, const RemoteOptions& remote,
                     std::size_t open_files)
    : name_(std::move(name)),
      set_(openedSet(path, remote, open_files)),
      levels_(Levels::open(*set_)),
      attributes_(*set_),
      store_(*set_),
      kept_(store_, 0),
      nearest_(kept_, {.budget_bytes = 0}),
      filtered_(kept_, 0),
      finder_(store_),
      sample_ids_(store_, 0),
      looks_(nearest_.tiles(), budget_bytes / 16) {
  setBudget(budget_bytes);
}

void ServedSet::setBudget(std::uint64_t budget_bytes) const {
  kept_.setBudget(budget_bytes / 16 * 3);
  nearest_.setBudget(budget_bytes / 8 * 3);
  filtered_.setBudget(budget_bytes / 8);
  sample_ids_.setBudget(budget_bytes / 4);
}

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
