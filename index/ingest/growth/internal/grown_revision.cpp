#include "index/ingest/growth/internal/grown_revision.h"

#include "index/set/internal/patches_file.h"
#include "index/set/internal/tile_entry.h"
#include "index/tile/internal/merged_tile.h"
#include "index/tile/tile_codec.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kBaseOfPatch = 3;  // a patch holds at most a third of the segments of its tile

std::uint32_t packsOf(const TileSet& set) {
  std::uint32_t packs = 0;
  for (const SetFile& file : set.files()) packs += file.name.starts_with("tiles-") ? 1 : 0;
  return packs;
}

}  // namespace

GrownRevision::GrownRevision(const TileSet& base, std::string folder, const GridBox& bounds, std::uint64_t pack_bytes)
    : base_(base),
      bounds_(bounds),
      writer_(std::move(folder), base.grid(), base.capacity(), pack_bytes),
      now_(base.tile_count(), kNoTile) {
  writer_.growFrom(packsOf(base));
  for (SetFile file : base.files()) {
    if (!file.name.starts_with("tiles-")) continue;
    if (file.revision.empty()) file.revision = base.revision();
    writer_.refer(file);
  }
}

GrownRevision::Item GrownRevision::place(const Placed& placed) {
  items_.push_back(placed);
  return static_cast<Item>(items_.size() - 1);
}

GrownRevision::Item GrownRevision::keep(TileId tile) {
  ++counts_.kept;
  const Patch* const patch = base_.patch(tile);
  return place({base_.entry(tile), base_.location(tile), tile == base_.long_tile(), tile,
                patch != nullptr ? std::optional(*patch) : std::nullopt});
}

GrownRevision::Item GrownRevision::write(std::optional<TileId> was, const BlockKey& key, bool is_long,
                                         std::vector<StoredSegment> segments, const TileAppearance& look,
                                         TypeMask types) {
  ++counts_.written;
  const Tile tile(0, key, is_long, base_.grid(), segments);
  TileEntry entry = entryOf(tile);
  entry.types = types;
  return place(
      {entry, writer_.append(encodeTile(tile), encodeAppearance(look)), is_long, was.value_or(kNoTile), std::nullopt});
}

GrownRevision::Item GrownRevision::add(TileId id, std::vector<StoredSegment> segments, const TileAppearance& look,
                                       TypeMask types) {
  const TileEntry& entry = base_.entry(id);
  const bool is_long = id == base_.long_tile();
  const Patch* const before = base_.patch(id);
  const std::uint32_t base_stored = before != nullptr ? before->stored : entry.stored;
  const std::uint32_t base_owned = before != nullptr ? before->owned : entry.owned;
  const std::uint64_t base_bytes = before != nullptr ? before->decoded_bytes : entry.decoded_bytes;
  std::vector<StoredSegment> all;
  TileAppearance looks;
  if ((entry.stored - base_stored + segments.size()) * kBaseOfPatch > base_stored) {
    appendSegments(*base_.load(id), all);
    looks = base_.loadAppearance(id);
    all.insert(all.end(), segments.begin(), segments.end());
    appendAppearance(look, looks);
    return write(id, entry.key, is_long, std::move(all), looks, entry.types | types);
  }
  if (before != nullptr) {
    const auto [tile, old_look] = base_.loadPatch(id);
    appendSegments(tile, all);
    looks = old_look;
  }
  const Tile added(0, entry.key, is_long, base_.grid(), segments);
  const TileEntry more = entryOf(added);
  all.insert(all.end(), segments.begin(), segments.end());
  appendAppearance(look, looks);
  const Tile patch(0, entry.key, is_long, base_.grid(), std::move(all));
  TileEntry whole = entry;
  whole.content.extend(more.content);
  whole.owned += more.owned;
  whole.stored += more.stored;
  whole.isolated += more.isolated;
  whole.types |= types;
  whole.decoded_bytes = mergedBytesBound(base_bytes, base_stored, patch, bounds_);
  ++counts_.patched;
  return place(
      {whole, base_.location(id), is_long, id,
       Patch{0, base_stored, base_owned, base_bytes, writer_.append(encodeTile(patch), encodeAppearance(looks))}});
}

void GrownRevision::number() {
  std::vector<Item> order(items_.size());
  for (Item i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [this](Item a, Item b) {
    const Placed &x = items_[a], &y = items_[b];
    return x.is_long != y.is_long ? y.is_long : x.entry.key.low < y.entry.key.low;
  });
  DirectoryContents directory;
  std::vector<Patch> patches;
  id_of_item_.resize(items_.size());
  for (TileId id = 0; id < order.size(); ++id) {
    Placed& placed = items_[order[id]];
    id_of_item_[order[id]] = id;
    if (placed.was != kNoTile) now_[placed.was] = id;
    if (placed.is_long) directory.long_tile = id;
    directory.entries.push_back(placed.entry);
    directory.locations.push_back(placed.at);
    if (!placed.patch) continue;
    placed.patch->tile = id;
    patches.push_back(*placed.patch);
  }
  items_ = {};
  writer_.setTiles(std::move(directory), patches);
}

std::optional<TileId> GrownRevision::tileNow(TileId of_base) const {
  return now_[of_base] != kNoTile ? std::optional(now_[of_base]) : std::nullopt;
}

}  // namespace filiform::internal
