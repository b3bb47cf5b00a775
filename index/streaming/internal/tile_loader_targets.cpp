// The part of TileLoader for jumps that wait for their tiles.
#include "index/streaming/internal/tile_loader.h"

#include <algorithm>

namespace filiform::internal {
namespace {

// For a jump's target: time within which the proxy may reach a tile that is claimed: in times of the fastest reads, at
// least and at most. For prefetch by distance: the corresponding fraction of the workspace's radius.
constexpr double kTargetReads = 5.5, kLeastTargetTime_s = 0.28, kMostTargetTime_s = 1, kTargetPart = 0.4;
// The jump waits for the tiles within this part of both. The others arrive before the hand does.
constexpr double kAwaitedPart = 0.5;

}  // namespace

double TileLoader::targetTime_s() const {
  return std::clamp(kTargetReads * in_flight_.fastest_s(), kLeastTargetTime_s, kMostTargetTime_s);
}

void TileLoader::claimTarget(Peer& p) {
  p.target.clear();
  if (p.focus.target_tile >= store_.tile_count()) return;
  ReaderFocus there = p.focus;
  there.active_tile = p.focus.target_tile;
  there.active_node = p.focus.target_node;
  there.p_W = p.focus.target_W;
  there.v_W.setZero();
  there.pull_W.setZero();
  const double time_s = p.target_time_s = targetTime_s();
  const std::uint64_t room = partOf(p) / 2;  // half: the proxy is still at its old position
  if (options_.prefetch == PrefetchPolicy::structure) {
    const std::span<const TileId> cell_tiles = tilesOf(there.active_node.cell);
    prefetch_.claimAhead(there, loaded_, cell_tiles, room, p.target);
    std::erase_if(p.target, [&](const TileClaim& c) { return c.cost > time_s; });
    if (cell_tiles.empty() || !inMemory(there.active_tile)) claimBesideTarget(there, room, time_s, p.target);
  } else {
    there.radius_um *= kTargetPart;
    prefetch_.claimAround(there, room, p.target);
  }
  p.target_open = std::any_of(pages_.noted().begin(), pages_.noted().end(), [&](const auto& noted) {
    return noted.second <= kAwaitedPart * time_s && !failed_pages_.contains(noted.first);
  });
  std::erase_if(p.target, [&](const TileClaim& c) { return c.tile == there.active_tile; });
  p.target.insert(p.target.begin(), {there.active_tile, -1});
}

// The target's tile and the list of its cell's tiles say which tiles the neurite enters. Until both are here, the
// loader reads the tiles nearest to the target. The neurite enters most of these, so the jump needs one round of reads
// less.
void TileLoader::claimBesideTarget(const ReaderFocus& there, std::uint64_t room, double time_s,
                                   std::vector<TileClaim>& claims) const {
  const std::size_t known = claims.size();
  prefetch_.claimAround(there, room, claims);
  for (std::size_t i = known; i < claims.size(); ++i) claims[i].cost = time_s + 1e-6 * claims[i].cost;
}

void TileLoader::tellTargets() {
  for (Peer& p : peers_) {
    std::uint64_t ready = UINT64_MAX;
    if (!p.target_open && !p.target.empty() && p.planned.target_node == p.focus.target_node) {
      const double farthest =
          kAwaitedPart *
          (options_.prefetch == PrefetchPolicy::structure ? p.target_time_s : kTargetPart * p.planned.radius_um);
      bool all = true;
      for (std::size_t i = 0; i < p.target.size() && p.target[i].cost <= farthest && all; ++i) {
        const TileSlot* const slot = slots_.find(p.target[i].tile);
        all = slot == nullptr ? i > 0 : slot->state == TileState::resident || (i > 0 && !slot->wanted);
      }
      const std::uint64_t key = p.planned.target_node.key();
      if (all && (!p.walk_stale || p.ends.ready_target.load(std::memory_order_relaxed) == key))
        ready = key;
      else if (all)
        urgent_ = true;  // the last tile has come: the walk through it may claim further ones
    }
    p.ends.ready_target.store(ready, std::memory_order_release);
  }
}

}  // namespace filiform::internal
