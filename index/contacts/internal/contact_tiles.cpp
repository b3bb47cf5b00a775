#include "index/contacts/internal/contact_tiles.h"

#include "index/geometry/partition.h"
#include "index/workers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace filiform::internal {
namespace {

WorldBox emptyWorldBox() {
  return {Vector3d::Constant(std::numeric_limits<double>::infinity()),
          Vector3d::Constant(-std::numeric_limits<double>::infinity())};
}

}  // namespace

ContactTiles::ContactTiles(const TileStore& store, const ContactOptions& options)
    : store_(store),
      surface_(options.surface),
      budget_bytes_(options.memory_bytes / 8 * 3),
      sides_by_cell_(store.cell_count(), 0),
      sides_by_type_(std::size_t{1} << 16, 0) {
  const auto add = [&](std::size_t side, const std::vector<std::uint32_t>& cells,
                       const std::vector<std::uint16_t>& types) {
    const auto bit = static_cast<std::uint8_t>(1 << side);
    for (const std::uint32_t cell : cells) sides_by_cell_[cell] |= bit;
    for (const std::uint16_t type : types) sides_by_type_[type] |= bit;
    if (types.empty())
      for (std::uint8_t& sides : sides_by_type_) sides |= bit;
  };
  add(kFromSide, options.from, options.from_types);
  if (!options.sidesAreAlike()) add(kToSide, options.to, options.to_types);
  if (surface_) radii_.emplace(store, options.memory_bytes / 8);
}

void ContactTiles::findLargestRadius(unsigned threads, const std::function<void()>& check) {
  std::mutex mutex;
  const auto offer = [&](double radius_um) {
    const std::lock_guard lock(mutex);
    largest_radius_um_ = std::max(largest_radius_um_, radius_um);
  };
  std::atomic<std::size_t> next{0};
  const std::size_t tiles = store_.tile_count(), items = tiles + store_.cell_count();
  runWorkers(threads, [&](std::size_t worker, const std::atomic<bool>& failed) {
    double largest_um = 0;
    for (std::size_t i = next++; i < items && !failed; i = next++) {
      if (worker == 0 && check) check();
      if (i < tiles) {
        for (const float radius_um : store_.loadAppearance(static_cast<TileId>(i)).radii_um)
          largest_um = std::max(largest_um, countedRadius_um(radius_um));
      } else if (const auto cell = static_cast<std::uint32_t>(i - tiles); sides_by_cell_[cell] != 0) {
        for (const CellDetail::Root& root : store_.loadCellDetail(cell).roots)
          largest_um = std::max(largest_um, countedRadius_um(root.radius_um));
      }
    }
    offer(largest_um);
  });
}

std::shared_ptr<const ContactTile> ContactTiles::get(TileId id) {
  std::shared_ptr<Kept> kept;
  {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<Kept>& known = kept_[id];
    if (known == nullptr) {
      known = std::make_shared<Kept>();
      order_.push_front(id);
      known->place = order_.begin();
    } else {
      order_.splice(order_.begin(), order_, known->place);
    }
    kept = known;
  }
  const std::lock_guard making(kept->mutex);
  if (kept->tile != nullptr) return kept->tile;
  kept->tile = make(id);
  const std::lock_guard lock(mutex_);
  const auto known = kept_.find(id);
  if (known == kept_.end() || known->second != kept) return kept->tile;  // dropped while it was made
  kept->bytes = kept->tile->bytes();
  bytes_ += kept->bytes;
  while (bytes_ > budget_bytes_ && order_.size() > 1) {
    const auto last = kept_.find(order_.back());
    bytes_ -= last->second->bytes;
    kept_.erase(last);
    order_.pop_back();
  }
  return kept->tile;
}

std::shared_ptr<const ContactTile> ContactTiles::make(TileId id) const {
  const TileStore& store = surface_ ? radii_->tiles() : store_;
  const std::shared_ptr<const Tile> loaded = store.load(id);
  const TileAppearance appearance = store.loadAppearance(id);
  const Tile& tile = *loaded;
  const auto made = std::make_shared<ContactTile>(loaded);
  std::vector<std::uint32_t> place_of(tile.segment_count());  // among the owned
  std::vector<float> radii_um(surface_ ? tile.node_count() : 0, kUnknownRadius);
  std::vector<bool> has_radius(radii_um.size());
  std::uint32_t owned = 0;
  TileId owner = kNoTile;  // of the last ghost, with its block
  GridBox block;
  ContactTile::Owner* last = nullptr;
  tile.forEachSegment([&](std::uint32_t segment, std::uint32_t child, std::uint32_t parent) {
    if (tile.owned(segment)) {
      if (surface_) radii_um[child] = appearance.radii_um[owned], has_radius[child] = true;
      place_of[segment] = owned++;
      return;
    }
    if (tile.isLong() || sides_by_cell_[tile.segmentId(segment).cell] == 0) return;
    const GridPoint a = tile.gridPoint(child), b = tile.gridPoint(parent);
    if (const GridPoint middle = midpoint(a, b); !block.contains(middle)) {
      owner = store.home(middle);
      block = owner == kNoTile ? GridBox{} : store.entry(owner).key.box();
    }
    if (owner == kNoTile || owner == id) return;
    if (last == nullptr || last->tile != owner) {
      const auto known = std::find_if(made->owners.begin(), made->owners.end(),
                                      [&](const ContactTile::Owner& o) { return o.tile == owner; });
      last = known != made->owners.end() ? &*known
                                         : &made->owners.emplace_back(ContactTile::Owner{owner, emptyWorldBox()});
    }
    const Vector3d a_W = store.grid().toWorld(a), b_W = store.grid().toWorld(b);
    last->box = {last->box.lo_W.cwiseMin(a_W).cwiseMin(b_W), last->box.hi_W.cwiseMax(a_W).cwiseMax(b_W)};
  });
  for (const SegmentRun run : tile.runs()) {
    const Tile::Link first = tile.link(run.begin());
    if (sides_by_cell_[first.id.cell] == 0) continue;
    for (std::uint32_t i = 0; i < run.count(); ++i) {
      const std::uint32_t segment = run.begin() + i;
      if (!tile.owned(segment)) continue;
      const std::uint16_t type = appearance.types[place_of[segment]];
      const std::uint8_t sides = sidesOf(first.id.cell, type);
      if (sides == 0) continue;
      const std::uint32_t child = first.child + i, parent = i == 0 ? first.parent : child - 1;
      std::array<float, 2> ends_um{};
      if (surface_)
        ends_um = {radii_um[child],
                   has_radius[parent] ? radii_um[parent] : radii_->of(tile.nodeId(parent), tile.gridPoint(parent))};
      for (const std::size_t side : {kFromSide, kToSide}) {
        if ((sides >> side & 1) == 0) continue;
        ContactTile::Side& to = made->sides[side];
        to.items.push_back({segment, child, parent, type});
        if (surface_) to.radii_um.push_back(ends_um);
        to.row.add(first.id.cell, made->ends(to, to.row.size));
      }
    }
  }
  for (ContactTile::Side& side : made->sides) {
    side.row.finish();
    side.items.shrink_to_fit(), side.radii_um.shrink_to_fit();
  }
  return made;
}

}  // namespace filiform::internal
