#include "index/contacts/internal/contact_tiles.h"

#include "index/geometry/partition.h"
#include "index/workers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace filiform::internal {
namespace {

// What surfaces count with; 0 for an unknown radius.
double countedRadius_um(float radius_um) { return radius_um > 0 && std::isfinite(radius_um) ? radius_um : 0; }

WorldBox emptyWorldBox() {
  return {Vector3d::Constant(std::numeric_limits<double>::infinity()),
          Vector3d::Constant(-std::numeric_limits<double>::infinity())};
}

}  // namespace

ContactTiles::ContactTiles(const TileStore& store, const ContactOptions& options)
    : store_(store),
      surface_(options.surface),
      budget_bytes_(options.memory_bytes / 4),
      sides_by_cell_(store.cell_count(), 0),
      sides_by_type_(std::size_t{1} << 16, 0) {
  for (const std::uint32_t cell : options.from) sides_by_cell_[cell] |= kFromSide;
  for (const std::uint32_t cell : options.to) sides_by_cell_[cell] |= kToSide;
  const auto addTypes = [&](const std::vector<std::uint16_t>& types, std::uint8_t side) {
    for (const std::uint16_t type : types) sides_by_type_[type] |= side;
    if (types.empty())
      for (std::uint8_t& sides : sides_by_type_) sides |= side;
  };
  addTypes(options.from_types, kFromSide);
  addTypes(options.to_types, kToSide);
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
  const auto made = std::make_shared<ContactTile>();
  std::vector<std::uint32_t> place_of(tile.segment_count());  // among the owned
  std::vector<float> radii_um(surface_ ? tile.node_count() : 0, kUnknownRadius);
  std::vector<bool> has_radius(radii_um.size());
  std::uint32_t owned = 0;
  ContactTile::Owner* last = nullptr;
  tile.forEachSegment([&](std::uint32_t segment, std::uint32_t child, std::uint32_t parent) {
    if (tile.owned(segment)) {
      if (surface_) radii_um[child] = appearance.radii_um[owned], has_radius[child] = true;
      place_of[segment] = owned++;
      return;
    }
    if (tile.isLong() || sides_by_cell_[tile.segmentId(segment).cell] == 0) return;
    const GridPoint a = tile.gridPoint(child), b = tile.gridPoint(parent);
    const TileId owner = store.home(midpoint(a, b));
    if (owner == kNoTile || owner == id) return;
    if (last == nullptr || last->tile != owner) {
      const auto known = std::find_if(made->owners.begin(), made->owners.end(),
                                      [&](const ContactTile::Owner& o) { return o.tile == owner; });
      last = known != made->owners.end() ? &*known : &made->owners.emplace_back(owner, emptyWorldBox());
    }
    const Vector3d a_W = store.grid().toWorld(a), b_W = store.grid().toWorld(b);
    last->box = {last->box.lo_W.cwiseMin(a_W).cwiseMin(b_W), last->box.hi_W.cwiseMax(a_W).cwiseMax(b_W)};
  });
  for (const SegmentRun run : tile.runs())
    for (std::uint32_t segment = run.begin(); segment < run.begin() + run.count(); ++segment) {
      if (!tile.owned(segment)) continue;
      const std::uint16_t type = appearance.types[place_of[segment]];
      const std::uint8_t sides = sidesOf(tile.segmentId(segment).cell, type);
      if (sides == 0) continue;
      const Tile::Link link = tile.link(segment);
      ContactSegment& s = made->segments.emplace_back();
      s.cell = link.id.cell, s.segment = link.id.segment;
      s.child = link.child_id.sample, s.parent = link.parent_id.sample;
      s.ends.child_W = tile.position_W(link.child), s.ends.parent_W = tile.position_W(link.parent);
      s.length_um = (s.ends.parent_W - s.ends.child_W).norm();
      s.type = type, s.sides = sides, s.radius_is_unknown = false;
      if (surface_) {
        const float child_um = radii_um[link.child];
        const float parent_um =
            has_radius[link.parent] ? radii_um[link.parent] : radii_->of(link.parent_id, tile.gridPoint(link.parent));
        s.ends.child_radius_um = countedRadius_um(child_um), s.ends.parent_radius_um = countedRadius_um(parent_um);
        s.radius_is_unknown = !(child_um > 0) || !(parent_um > 0);
      }
      made->boxes.add(RoundedBox(s.box(), 0));
    }
  made->boxes.finish();
  return made;
}

}  // namespace filiform::internal
