#include "index/contacts/contacts.h"

#include "index/contacts/internal/contact_tiles.h"
#include "index/contacts/internal/pair_sorter.h"
#include "index/contacts/internal/site_merger.h"
#include "index/contacts/internal/site_places.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/query/segment_pass.h"
#include "index/query/tile_finder.h"
#include "index/tile/box_region.h"
#include "index/workers.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace filiform {
namespace {

using internal::ContactPair;
using internal::ContactSegment;
using internal::ContactTile;
using internal::kFromSide;
using internal::kToSide;

std::uint64_t segmentsOf(const TileStore& store, std::uint32_t cell) {
  return store.cell(cell).segments + store.cell(cell).isolated;
}

std::uint64_t segmentsOf(const TileStore& store, const std::vector<std::uint32_t>& cells) {
  std::uint64_t sum = 0;
  for (const std::uint32_t cell : cells) sum += segmentsOf(store, cell);
  return sum;
}

bool bothSidesAreAlike(const ContactOptions& options) {
  return options.from == options.to && options.from_types == options.to_types;
}

void refuseDistance(const TileStore& store, const ContactOptions& options) {
  if (!(options.within_um > 0) || !std::isfinite(options.within_um))
    throw UsageError("the distance of contacts must be a number above 0 um");
  GridBox bounds;
  std::vector<std::uint32_t> both;
  std::set_intersection(options.from.begin(), options.from.end(), options.to.begin(), options.to.end(),
                        std::back_inserter(both));
  for (const auto* cells : {&options.from, &options.to})
    for (const std::uint32_t cell : *cells) bounds.extend(store.cell(cell).bounds);
  if (bounds.empty()) return;
  const double size_um = store.grid().toWorld(bounds.hi - bounds.lo).norm();
  if (options.within_um < size_um) return;
  std::uint64_t pairs = segmentsOf(store, options.from) * segmentsOf(store, options.to);
  for (const std::uint32_t cell : both) pairs -= segmentsOf(store, cell) * segmentsOf(store, cell);
  if (bothSidesAreAlike(options)) pairs /= 2;
  if (pairs == 0) return;
  const bool some_types = !options.from_types.empty() || !options.to_types.empty();
  throw UsageError("the cells are " + formatCount(static_cast<std::uint64_t>(std::ceil(size_um))) +
                   " um across, so every segment would touch every other: " + (some_types ? "up to " : "") +
                   counted(pairs, "pair") + "; give a smaller distance");
}

// The segments of a tile from which the search sets out.
struct OutgoingSegments {
  std::vector<std::uint32_t> segments;  // of the tile
  internal::BoxRow boxes;               // widened by the distance
  WorldBox box{};                       // of all; only if there are some

  OutgoingSegments(const ContactTile& tile, std::uint8_t sides, double widen_um) {
    for (std::uint32_t i = 0; i < tile.segments.size(); ++i) {
      if ((tile.segments[i].sides & sides) == 0) continue;
      const WorldBox own = tile.segments[i].box();
      box = segments.empty() ? own : WorldBox{box.lo_W.cwiseMin(own.lo_W), box.hi_W.cwiseMax(own.hi_W)};
      segments.push_back(i);
      boxes.add(internal::RoundedBox(own, widen_um));
    }
    boxes.finish();
  }
};

class ContactSearch {
 public:
  ContactSearch(const TileStore& store, const ContactOptions& options)
      : store_(store),
        options_(options),
        is_symmetric_(bothSidesAreAlike(options)),
        sets_out_(is_symmetric_                                                      ? kFromSide | kToSide
                  : segmentsOf(store, options.from) <= segmentsOf(store, options.to) ? kFromSide
                                                                                     : kToSide),
        // Rounding in closest_places.h is less than a quantum.
        widen_um_(options.within_um + store.grid().quantum_um()),
        tiles_(store, options),
        finder_(store) {}

  // Returns the number of tiles from which it set out.
  std::uint64_t run(internal::PairSorter& pairs) {
    const std::vector<TileId> tiles = tilesOf(store_, sets_out_ == kToSide ? options_.to : options_.from);
    const auto check = [&](std::uint64_t done) {
      if (options_.check) options_.check(done, tiles.size());
    };
    if (options_.surface) tiles_.findLargestRadius(options_.threads, [&] { check(0); });
    std::atomic<std::size_t> next{0};
    runWorkers(options_.threads, [&](std::size_t worker, const std::atomic<bool>& failed) {
      for (std::size_t i = next++; i < tiles.size() && !failed; i = next++) {
        if (worker == 0) check(i);
        search(tiles[i], [&](const ContactPair& pair) { pairs.add(worker, pair); });
      }
    });
    return tiles.size();
  }

 private:
  // A pair of two tiles is found from the lower one, if both sides are alike. Otherwise each pair is found from the
  // tile that owns the segment of one side.
  template <class Take>
  void search(TileId id, const Take& take) {
    const std::shared_ptr<const ContactTile> tile = tiles_.get(id);
    const OutgoingSegments out(*tile, sets_out_, widen_um_);
    if (out.segments.empty()) return;
    const double reach_um = widen_um_ + tiles_.largestRadius_um();
    const Vector3d reach = Vector3d::Constant(reach_um);
    const BoxRegion around({out.box.lo_W - reach, out.box.hi_W + reach});
    // A segment lies in each tile that holds a part of it. The tiles with the parts name its owner.
    std::vector<TileId> owners;
    std::vector<TileId> near;
    if (id == store_.long_tile() && is_symmetric_) {
      near.push_back(id);
    } else {
      for (const auto& hit : finder_.meeting(around)) near.push_back(hit.first);
      if (store_.long_tile() != kNoTile) near.push_back(store_.long_tile());
    }
    for (const TileId other_id : near) {
      const std::shared_ptr<const ContactTile> other = other_id == id ? tile : tiles_.get(other_id);
      if (!is_symmetric_ || other_id >= id) match(*tile, out, *other, other_id == id, take);
      for (const ContactTile::Owner& owner : other->owners)
        if ((!is_symmetric_ || owner.tile >= id) && around.mayMeet(owner.box) &&
            !std::binary_search(near.begin(), near.end(), owner.tile))
          owners.push_back(owner.tile);
    }
    std::sort(owners.begin(), owners.end());
    owners.erase(std::unique(owners.begin(), owners.end()), owners.end());
    for (const TileId owner : owners) match(*tile, out, *tiles_.get(owner), owner == id, take);
  }

  template <class Take>
  void match(const ContactTile& tile, const OutgoingSegments& out, const ContactTile& other, bool is_same,
             const Take& take) const {
    internal::forEachMeeting(out.boxes, other.boxes, [&](std::size_t i, std::size_t j) {
      const ContactSegment &a = tile.segments[out.segments[i]], &b = other.segments[j];
      if (a.cell == b.cell) return;
      if (is_symmetric_) {
        if (a.cell < b.cell) {
          offer(a, b, false, take);
        } else if (!is_same) {
          offer(b, a, false, take);
        }
        return;
      }
      const std::uint8_t arrives = sets_out_ == kFromSide ? kToSide : kFromSide;
      if ((b.sides & arrives) == 0) return;
      const bool first_is_a = a.cell < b.cell;
      offer(first_is_a ? a : b, first_is_a ? b : a, first_is_a == (sets_out_ == kToSide), take);
    });
  }

  // The lower cell first, however the search came to the pair. `swap`: the higher cell is that of `from`.
  template <class Take>
  void offer(const ContactSegment& a, const ContactSegment& b, bool swap, const Take& take) const {
    const ClosestPlaces places = options_.surface ? closestOnSurfaces(a.ends, b.ends) : closestOnAxes(a.ends, b.ends);
    if (!(places.distance_um <= options_.within_um)) return;
    const std::size_t of_a = swap ? 1 : 0, of_b = 1 - of_a;
    ContactPair pair{};
    const auto set = [&](std::size_t side, const ContactSegment& s, double t) {
      pair.cell[side] = s.cell, pair.segment[side] = s.segment;
      pair.child[side] = s.child, pair.parent[side] = s.parent;
      pair.t[side] = t, pair.length_um[side] = s.length_um, pair.type[side] = s.type;
    };
    set(of_a, a, places.t[0]);
    set(of_b, b, places.t[1]);
    pair.distance_um = places.distance_um;
    pair.has_unknown_radius = a.radius_is_unknown || b.radius_is_unknown ? 1 : 0;
    take(pair);
  }

  const TileStore& store_;
  const ContactOptions& options_;
  const bool is_symmetric_;
  const std::uint8_t sets_out_;  // the sides from whose segments the search sets out
  const double widen_um_;
  internal::ContactTiles tiles_;
  const TileFinder finder_;
};

}  // namespace

ContactCounts findContacts(const TileStore& store, const ContactOptions& options,
                           const std::function<void(const ContactSite& site)>& take) {
  refuseDistance(store, options);
  internal::PairSorter sorter(options.memory_bytes / 4, options.threads);
  const std::uint64_t tiles = ContactSearch(store, options).run(sorter);
  ContactCounts counts{.pairs = sorter.pairs(), .file_bytes = sorter.file_bytes()};
  const auto check = [&] {
    if (options.check) options.check(tiles, tiles);
  };
  internal::SiteMerger merger;
  std::vector<ContactSite> sites;
  const std::size_t most = std::max<std::uint64_t>(options.memory_bytes / 8 / (sizeof(ContactSite) + 16), 1024);
  const auto flush = [&] {
    if (options.with_places) internal::addPlaces(store, sites, options.memory_bytes / 8 * 3, options.threads, check);
    for (const ContactSite& site : sites) take(site);
    counts.sites += sites.size();
    sites.clear();
  };
  sorter.forEachCellPair([&](std::span<const ContactPair> pairs) {
    for (const ContactPair& pair : pairs) counts.unknown_radii += pair.has_unknown_radius;
    const std::span<const ContactSite> merged = merger.merge(pairs);
    if (sites.size() + merged.size() > most) flush();
    sites.insert(sites.end(), merged.begin(), merged.end());
    if (!options.with_places) flush();
  });
  flush();
  return counts;
}

}  // namespace filiform
