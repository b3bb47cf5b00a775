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
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <span>
#include <utility>

namespace filiform {
namespace {

using internal::ContactPair;
using internal::ContactTile;

std::uint64_t segmentsOf(const TileStore& store, std::uint32_t cell) {
  return store.cell(cell).segments + store.cell(cell).isolated;
}

std::uint64_t segmentsOf(const TileStore& store, const std::vector<std::uint32_t>& cells) {
  std::uint64_t sum = 0;
  for (const std::uint32_t cell : cells) sum += segmentsOf(store, cell);
  return sum;
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
  if (options.sidesAreAlike()) pairs /= 2;
  if (pairs == 0) return;
  const bool some_types = !options.from_types.empty() || !options.to_types.empty();
  throw UsageError("the cells are " + formatCount(static_cast<std::uint64_t>(std::ceil(size_um))) +
                   " um across, so every segment would touch every other: " + (some_types ? "up to " : "") +
                   counted(pairs, "pair") + "; give a smaller distance");
}

class ContactSearch {
 public:
  ContactSearch(const TileStore& store, const ContactOptions& options)
      : store_(store),
        options_(options),
        is_symmetric_(options.sidesAreAlike()),
        sets_out_(is_symmetric_ || segmentsOf(store, options.from) <= segmentsOf(store, options.to)
                      ? internal::kFromSide
                      : internal::kToSide),
        arrives_(is_symmetric_ || sets_out_ == internal::kToSide ? internal::kFromSide : internal::kToSide),
        tiles_(store, options),
        finder_(store) {
    GridBox bounds;
    for (const auto* cells : {&options.from, &options.to})
      for (const std::uint32_t cell : *cells) bounds.extend(store.cell(cell).bounds);
    if (bounds.empty()) return;
    const double largest_um = store.grid().toWorld(bounds.lo.cwiseAbs().cwiseMax(bounds.hi.cwiseAbs())).maxCoeff();
    // Rounding in closest_places.h is less than a quantum; segment_row.h states that in float.
    reach_um_ = std::nextafterf(
        static_cast<float>(options.within_um + store.grid().quantum_um() + std::ldexp(largest_um, -16)), HUGE_VALF);
  }

  // Returns the number of tiles from which it set out.
  std::uint64_t run(internal::PairSorter& pairs) {
    const std::vector<TileId> tiles = tilesOf(store_, sets_out_ == internal::kToSide ? options_.to : options_.from);
    const auto check = [&](std::uint64_t done) {
      if (options_.check) options_.check(done, tiles.size());
    };
    if (options_.surface) tiles_.findLargestRadius(options_.threads, [&] { check(0); });
    std::atomic<std::size_t> next{0};
    runWorkers(options_.threads, [&](std::size_t worker, const std::atomic<bool>& failed) {
      std::vector<ContactPair> found;
      for (std::size_t i = next++; i < tiles.size() && !failed; i = next++) {
        if (worker == 0) check(i);
        search(tiles[i], [&](const ContactPair& pair) {
          found.push_back(pair);
          if (found.size() == kMostFound) pairs.add(worker, found), found.clear();
        });
        pairs.add(worker, found);
        found.clear();
      }
    });
    return tiles.size();
  }

 private:
  static constexpr std::size_t kMostFound = 16384;

  // A pair of two tiles is found from the lower one, if both sides are alike. Otherwise each pair is found from the
  // tile that owns the segment of one side.
  template <class Take>
  void search(TileId id, const Take& take) {
    const std::shared_ptr<const ContactTile> tile = tiles_.get(id);
    const internal::SegmentRow& row = tile->sides[sets_out_].row;
    if (row.size == 0) return;
    const Vector3d reach = Vector3d::Constant(reach_um_ + tiles_.largestRadius_um());
    const auto corner = [](const std::array<float, 3>& p) { return Vector3d(p[0], p[1], p[2]); };
    const BoxRegion around({corner(row.all.lo) - reach, corner(row.all.hi) + reach});
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
      if (!is_symmetric_ || other_id >= id) match(*tile, *other, take);
      for (const ContactTile::Owner& owner : other->owners)
        if ((!is_symmetric_ || owner.tile >= id) && around.mayMeet(owner.box) &&
            !std::binary_search(near.begin(), near.end(), owner.tile))
          owners.push_back(owner.tile);
    }
    std::sort(owners.begin(), owners.end());
    owners.erase(std::unique(owners.begin(), owners.end()), owners.end());
    for (const TileId owner : owners) match(*tile, owner == id ? *tile : *tiles_.get(owner), take);
  }

  // The lower cell first, however the search came to the pair.
  template <class Take>
  void match(const ContactTile& tile, const ContactTile& other, const Take& take) const {
    const ContactTile::Side &out = tile.sides[sets_out_], &in = other.sides[arrives_];
    const bool is_same = is_symmetric_ && &tile == &other;
    std::uint32_t last = UINT32_MAX;
    SegmentEnds ends;
    internal::findNear(out.row, in.row, reach_um_, [&](std::span<const internal::NearSegments> pairs) {
      for (const auto [i, j] : pairs) {
        if (is_same && i > j) continue;
        if (i != last) ends = tile.ends(out, last = i);
        const SegmentEnds others = other.ends(in, j);
        const std::uint32_t cell = out.row.cell(i), other_cell = in.row.cell(j);
        const bool is_lower = cell < other_cell;
        const SegmentEnds &a = is_lower ? ends : others, &b = is_lower ? others : ends;
        const ClosestPlaces places = options_.surface ? closestOnSurfaces(a, b) : closestOnAxes(a, b);
        if (!(places.distance_um <= options_.within_um)) continue;
        ContactPair pair{};
        pair.distance_um = places.distance_um;
        const std::size_t of_out = is_symmetric_ ? (is_lower ? 0 : 1) : std::size_t{sets_out_};
        set(pair, of_out, tile, out, i, ends, places.t[is_lower ? 0 : 1]);
        set(pair, 1 - of_out, other, in, j, others, places.t[is_lower ? 1 : 0]);
        take(pair);
      }
    });
  }

  static void set(ContactPair& pair, std::size_t side, const ContactTile& tile, const ContactTile::Side& of,
                  std::uint32_t i, const SegmentEnds& ends, double t) {
    const ContactTile::Side::Item& item = of.items[i];
    const Tile::Link link = tile.tile->link(item.segment);
    pair.cell[side] = link.id.cell, pair.segment[side] = link.id.segment;
    pair.child[side] = link.child_id.sample, pair.parent[side] = link.parent_id.sample;
    pair.type[side] = item.type;
    pair.t[side] = t, pair.length_um[side] = (ends.parent_W - ends.child_W).norm();
    if (!of.radii_um.empty() && (!(of.radii_um[i][0] > 0) || !(of.radii_um[i][1] > 0))) pair.has_unknown_radius = 1;
  }

  const TileStore& store_;
  const ContactOptions& options_;
  const bool is_symmetric_;
  const internal::ContactSide sets_out_, arrives_;  // the side from whose segments the search sets out; the other
  float reach_um_ = 0;                              // of findNear()
  internal::ContactTiles tiles_;
  const TileFinder finder_;
};

}  // namespace

ContactCounts findContacts(const TileStore& store, const ContactOptions& options,
                           const std::function<void(const ContactSite& site)>& take) {
  refuseDistance(store, options);
  auto sorter = std::make_unique<internal::PairSorter>(options.memory_bytes / 2, options.threads,
                                                       options.detail == ContactOptions::Detail::kCounts);
  const std::uint64_t tiles = ContactSearch(store, options).run(*sorter);
  ContactCounts counts{.pairs = sorter->pairs(), .file_bytes = sorter->file_bytes()};
  const auto check = [&] {
    if (options.check) options.check(tiles, tiles);
  };
  const bool with_places = options.detail == ContactOptions::Detail::kPlaces;
  internal::SiteMerger merger;
  std::vector<ContactSite> sites;
  const std::size_t most = std::max<std::uint64_t>(options.memory_bytes / 4 / (sizeof(ContactSite) + 16), 1024);
  const auto flush = [&] {
    const std::uint64_t left_bytes = options.memory_bytes / 4 * (sorter == nullptr ? 3 : 1);
    if (with_places) internal::addPlaces(store, sites, left_bytes, options.threads, check);
    for (const ContactSite& site : sites) take(site);
    counts.sites += sites.size();
    sites.clear();
  };
  sorter->forEachCellPair([&](std::span<const ContactPair> pairs) {
    for (const ContactPair& pair : pairs) counts.unknown_radii += pair.has_unknown_radius;
    const std::span<const ContactSite> merged = merger.merge(pairs);
    if (sites.size() + merged.size() > most) flush();
    if (sites.size() > most / 64) sites.reserve(most);  // copied once
    sites.insert(sites.end(), merged.begin(), merged.end());
    if (!with_places) flush();
  });
  sorter.reset();
  flush();
  return counts;
}

}  // namespace filiform
