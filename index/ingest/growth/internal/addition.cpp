#include "index/ingest/growth/internal/addition.h"

#include "index/geometry/internal/grown_leaves.h"
#include "index/ingest/tiling/internal/crowded_leaves.h"
#include "index/tile/internal/merged_tile.h"

#include <algorithm>

namespace filiform::internal {
namespace {

constexpr std::uint32_t kNoLook = UINT32_MAX;

std::vector<BlockKey> leafKeys(const TileSet& set) {
  std::vector<BlockKey> keys;
  for (TileId t = 0; t < set.tile_count(); ++t)
    if (t != set.long_tile()) keys.push_back(set.entry(t).key);
  return keys;
}

}  // namespace

Addition::Addition(const TileSet& base, const TileSet& added, const TilesWithout& without, GrownRevision& to)
    : base_(base),
      added_(added),
      without_(without),
      to_(to),
      partition_(grownLeaves(leafKeys(base), leafKeys(added))),
      base_of_(partition_.leaves().size(), kNoTile),
      done_(base.tile_count(), false) {
  std::size_t leaf = 0;
  for (TileId t = 0; t < base.tile_count(); ++t) {
    if (t == base.long_tile()) continue;
    while (partition_.leaves()[leaf].low != base.entry(t).key.low) ++leaf;
    base_of_[leaf] = t;
  }
}

void Addition::run(const std::function<void(std::uint64_t, std::uint64_t)>& step) {
  addLong();
  for (TileId t = 0; t < added_.tile_count(); ++t) {
    step(t, added_.tile_count());
    if (t != added_.long_tile()) place(t);
  }
  flush();
  for (TileId t = 0; t < base_.tile_count(); ++t) {
    if (done_[t]) continue;
    if (!without_.touches(t)) {
      to_.keep(t);
    } else if (auto [left, look] = without_.left(t); !left.empty()) {
      to_.write(t, base_.entry(t).key, t == base_.long_tile(), std::move(left), look, base_.entry(t).types);
    }
  }
  to_.number();
  for (auto& [cell, item] : owners_) item = to_.tileOf(item);
  std::sort(owners_.begin(), owners_.end());
}

std::vector<TileId> Addition::tilesOf(std::uint32_t added_cell) const {
  std::vector<TileId> tiles;
  for (auto at = std::lower_bound(owners_.begin(), owners_.end(), std::pair(added_cell, std::uint32_t{0}));
       at != owners_.end() && at->first == added_cell; ++at)
    tiles.push_back(at->second);
  return tiles;
}

bool Addition::isLong(const SegmentId& id) const { return std::binary_search(long_.begin(), long_.end(), id); }

// Gathers a tile of the added set. A leaf that contains several such tiles is finished after the last of them.
void Addition::place(TileId id) {
  const std::vector<BlockKey>& leaves = partition_.leaves();
  const BlockKey block = added_.entry(id).key;
  const std::uint32_t begin = partition_.home(mortonPoint(block.low));
  std::uint32_t end = begin + 1;
  while (end < leaves.size() && leaves[end].low <= block.high()) ++end;
  if (begin != open_begin_ || end != open_end_) flush();
  open_begin_ = begin;
  open_end_ = end;

  types_ |= added_.entry(id).types;
  const auto tile = added_.load(id);
  const std::size_t first = segments_.size();
  appendSegments(*tile, segments_);
  auto look = static_cast<std::uint32_t>(looks_.types.size());
  appendAppearance(added_.loadAppearance(id), looks_);
  for (std::size_t s = first; s < segments_.size(); ++s) {
    const std::uint32_t look_of = segments_[s].owned ? look++ : kNoLook;
    met_.clear();
    meet(segments_[s], begin, end);
    for (const std::uint32_t leaf : met_)
      if (leaf >= begin && leaf < end) entries_.push_back({leaf, static_cast<std::uint32_t>(s), look_of});
  }
}

// Finds the leaves that store a segment of the added tile, at least those of [begin, end).
void Addition::meet(const StoredSegment& s, std::uint32_t begin, std::uint32_t end) {
  if (!long_.empty() && isLong(s.id)) {
    met_.push_back(partition_.home(s.child));
    if (const std::uint32_t other = partition_.home(s.parent); other != met_[0]) met_.push_back(other);
  } else if (end == begin + 1) {
    met_.push_back(begin);
  } else if (const std::uint32_t home = partition_.home(s.child);
             strictlyInside(closedBlock(partition_.leaves()[home]), s.child, s.parent)) {
    met_.push_back(home);
  } else if (!partition_.leavesMet(s.child, s.parent, met_)) {
    met_.clear();  // many leaves: a long segment, had the set been made at once. It stays what it is in the added set
    for (std::uint32_t leaf = begin; leaf < end; ++leaf)
      if (segmentMeetsBox(s.child, s.parent, closedBlock(partition_.leaves()[leaf]))) met_.push_back(leaf);
  }
}

// Finishes the leaves that are being gathered.
void Addition::flush() {
  std::sort(entries_.begin(), entries_.end(), [this](const Entry& a, const Entry& b) {
    if (a.leaf != b.leaf) return a.leaf < b.leaf;
    const SegmentId x = segments_[a.segment].id, y = segments_[b.segment].id;
    return x != y ? x < y : a.look < b.look;
  });
  std::vector<StoredSegment> segments;
  TileAppearance look;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    const Entry& e = entries_[i];
    const StoredSegment& s = segments_[e.segment];
    // Several tiles of the added set may hold the same segment. The first entry is that of the segment's owner, if the
    // owner is among them. It is if this leaf owns the segment, for then the midpoint lies in both blocks.
    if (segments.empty() || segments.back().id != SegmentId{s.id.cell + base_.cell_count(), s.id.segment}) {
      segments.push_back(s);
      segments.back().id.cell += base_.cell_count();
      segments.back().owned = (long_.empty() || !isLong(s.id)) &&
                              partition_.leaves()[e.leaf].contains(mortonKey(midpoint(s.child, s.parent)));
      if (segments.back().owned) {
        look.radii_um.push_back(looks_.radii_um[e.look]);
        look.types.push_back(looks_.types[e.look]);
      }
    }
    if (i + 1 < entries_.size() && entries_[i + 1].leaf == e.leaf) continue;
    finishLeaf(e.leaf, std::move(segments), look);
    segments = {};
    look = {};
  }
  entries_.clear();
  segments_.clear();
  looks_ = {};
  types_ = 0;
}

void Addition::finishLeaf(std::uint32_t leaf, std::vector<StoredSegment> segments, const TileAppearance& look) {
  std::vector<std::uint32_t> cells;
  for (const StoredSegment& s : segments)
    if (s.owned && (cells.empty() || cells.back() != s.id.cell - base_.cell_count()))
      cells.push_back(s.id.cell - base_.cell_count());
  const TileId was = base_of_[leaf];
  GrownRevision::Item item = 0;
  if (was == kNoTile) {
    item = to_.write(std::nullopt, partition_.leaves()[leaf], false, std::move(segments), look, types_);
  } else {
    item = addTo(was, std::move(segments), look, types_);
  }
  for (const std::uint32_t cell : cells) owners_.emplace_back(cell, item);
}

// Adds segments to a tile of the base.
GrownRevision::Item Addition::addTo(TileId tile, std::vector<StoredSegment> segments, const TileAppearance& look,
                                    TypeMask types) {
  done_[tile] = true;
  if (!without_.touches(tile)) return to_.add(tile, std::move(segments), look, types);
  auto [all, looks] = without_.left(tile);
  all.insert(all.end(), segments.begin(), segments.end());
  appendAppearance(look, looks);
  return to_.write(tile, base_.entry(tile).key, tile == base_.long_tile(), std::move(all), looks,
                   base_.entry(tile).types | types);
}

void Addition::addLong() {
  if (added_.long_tile() == kNoTile) return;
  std::vector<StoredSegment> segments;
  appendSegments(*added_.load(added_.long_tile()), segments);
  const TileAppearance look = added_.loadAppearance(added_.long_tile());
  const TypeMask types = added_.entry(added_.long_tile()).types;
  std::vector<std::uint32_t> cells;
  for (StoredSegment& s : segments) {
    long_.push_back(s.id);
    if (cells.empty() || cells.back() != s.id.cell) cells.push_back(s.id.cell);
    s.id.cell += base_.cell_count();
  }
  GrownRevision::Item item = 0;
  if (base_.long_tile() == kNoTile) {
    item = to_.write(std::nullopt, BlockKey{}, true, std::move(segments), look, types);
  } else {
    item = addTo(base_.long_tile(), std::move(segments), look, types);
  }
  for (const std::uint32_t cell : cells) owners_.emplace_back(cell, item);
}

}  // namespace filiform::internal
