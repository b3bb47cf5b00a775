#include "index/internal/tile_loader.h"

#include "index/errors.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {
namespace {

// What is in memory counts as this much nearer: no swapping back and forth at the rim.
constexpr double kHeadStart = 0.8;
constexpr std::size_t kMaxCells = 8;  // whose lists of tiles are kept
// Of a jump's target: what a hand may reach within this time, and for prefetch by distance the part of the workspace's
// radius that this amounts to.
constexpr double kTargetTime_s = 0.1, kTargetPart = 0.2;

}  // namespace

TileLoader::TileLoader(const TileStore& store, const ResidencyOptions& options)
    : store_(store),
      options_(options),
      directory_(store),
      prefetch_(store, directory_, options.prefetch, options.lookahead_s),
      loaded_(store.tile_count()),
      evicted_(store.tile_count()) {}

TileReader& TileLoader::addReader() {
  Peer& peer = peers_.emplace_back(store_.tile_count());
  for (auto& [tile, slot] : slots_) {
    if (!slot.inMemory()) continue;
    ++slot.adds_left;
    slot.state = TileState::ready;
    peer.outbox.push_back({slot.tile.get(), tile});
  }
  flush();
  return peer.channel;
}

void TileLoader::adoptLongTile(std::shared_ptr<const Tile> tile) {
  Slot& slot = slots_[tile->id()];
  slot.state = TileState::resident;
  slot.tile = std::move(tile);
  loaded_.add(*slot.tile);
  counters_.reads = 1;
  counters_.bytes = counters_.peak_bytes = counters_.bytes_read_decoded = slot.tile->bytes();
}

bool TileLoader::pinned(TileId tile) const {
  if (tile == store_.long_tile()) return true;
  return std::any_of(peers_.begin(), peers_.end(),
                     [&](const Peer& p) { return p.has_focus && p.focus.active_tile == tile; });
}

bool TileLoader::waitsForRetry(TileId tile) const {
  const auto at = slots_.find(tile);
  return at != slots_.end() && at->second.state == TileState::failed && at->second.retry > now_;
}

void TileLoader::send(const TileMessage& message) {
  for (Peer& p : peers_) p.outbox.push_back(message);
  flush();
}

void TileLoader::flush() {
  for (Peer& p : peers_)
    while (!p.outbox.empty() && p.under_way < TileChannel::kRing) {
      p.channel.inbox.push(p.outbox.front());
      p.outbox.pop_front();
      ++p.under_way;
    }
}

void TileLoader::takeAcknowledgements() {
  for (Peer& p : peers_)
    for (TileAcknowledgement a; p.channel.acknowledgements.pop(a);) {
      --p.under_way;
      const SlotPlace at = slots_.find(a.id);
      Slot& slot = at->second;
      if (a.retired) {
        if (--slot.retires_left == 0) release(at);
      } else if (--slot.adds_left == 0 && slot.state == TileState::ready) {
        arrive(slot);
      }
    }
  flush();
}

void TileLoader::arrive(Slot& slot) {
  slot.state = TileState::resident;
  if (slot.held_once) return;  // a reader joined late
  slot.held_once = true;
  const double wait = now_ - slot.queued_at;
  counters_.wait_sum += wait;
  counters_.wait_most = std::max(counters_.wait_most, wait);
  ++counters_.waits;
}

void TileLoader::use(TileId tile) {
  const SlotPlace at = slots_.find(tile);
  if (at == slots_.end() || !at->second.foreseen) return;
  at->second.foreseen = false;
  ++counters_.prefetch_used;
}

void TileLoader::takeFocus() {
  for (Peer& p : peers_) {
    const TileId before = p.focus.active_tile;
    if (!p.channel.focus.take(p.focus)) continue;
    if (p.focus.active_tile != before && inMemory(p.focus.active_tile)) {
      ++counters_.entered;
      use(p.focus.active_tile);
    }
    const double moved = (p.focus.p_W - p.planned.p_W).norm();
    const bool away = !p.has_focus || p.focus.radius_um != p.planned.radius_um || !(moved <= p.focus.radius_um / 32);
    if (away || p.focus.active_tile != p.planned.active_tile || p.focus.target_tile != p.planned.target_tile ||
        p.focus.target_node != p.planned.target_node) {
      p.walk_stale = p.around_stale = stale_ = true;
      active_at_ = now_;
    }
    p.has_focus = true;
  }
}

void TileLoader::countMiss(TileId tile) {
  const auto at = slots_.find(tile);
  const TileState state = at == slots_.end() ? TileState::absent : at->second.state;
  if (state == TileState::failed) {
    ++counters_.missed_failed;
  } else if (state == TileState::queued || state == TileState::reading) {
    ++counters_.missed_late;
  } else if (std::any_of(claims_.begin(), claims_.end(), [&](const Claim& c) { return c.tile == tile; })) {
    ++counters_.missed_full;
  } else if (evicted_[tile]) {
    ++counters_.missed_evicted;
  } else {
    ++counters_.missed_unclaimed;
  }
}

void TileLoader::takeRequests() {
  for (Peer& p : peers_)
    for (TileId tile; p.channel.requests.pop(tile);) {
      if (tile >= store_.tile_count()) continue;
      const bool again = asked_.contains(tile) && slots_.contains(tile);
      if (!again && !inMemory(tile)) {
        countMiss(tile);
        stale_ = true;
      }
      active_at_ = now_;
      use(tile);
      ask(tile);
    }
}

bool TileLoader::fetchCells(double due, std::unique_lock<std::mutex>& lock) {
  if (options_.prefetch != PrefetchPolicy::structure) return false;
  std::vector<std::uint32_t> wanted;
  for (const Peer& p : peers_) {
    if (!p.has_focus || p.focus.is_view) continue;
    if (p.focus.active_tile != kNoTile) wanted.push_back(p.focus.active_node.cell);
    if (p.focus.target_tile != kNoTile) wanted.push_back(p.focus.target_node.cell);
  }
  for (const std::uint32_t cell : wanted) {
    const auto known = cells_.find(cell);
    if (known != cells_.end() && !(known->second.retry <= now_)) continue;
    const double backoff =
        known == cells_.end() ? pace_.first_retry : std::min(2 * known->second.backoff, pace_.last_retry);
    if (known == cells_.end() && cells_.size() >= kMaxCells)
      cells_.erase(std::min_element(cells_.begin(), cells_.end(), [](const auto& a, const auto& b) {
        return a.second.last_plan < b.second.last_plan;
      }));
    constexpr double kNever = std::numeric_limits<double>::infinity();
    cells_[cell] = {{}, kNever, kNever, backoff, plan_number_};
    std::vector<TileId> tiles;
    std::string reason;
    lock.unlock();
    try {
      if (cell < store_.cell_count()) tiles = store_.loadCellDetail(cell).tiles;
    } catch (const std::exception& error) {
      reason = error.what();
    }
    lock.lock();
    // Without its list, a cell is followed only as far as tiles in memory tell.
    if (!reason.empty()) {
      failed_cells_[cell] = "cell " + std::to_string(cell) + ": " + reason;
      ++counters_.failures;
      cells_[cell] = {{}, kNever, now_ + backoff, backoff, plan_number_};
    } else {
      failed_cells_.erase(cell);
      cells_[cell] = {std::move(tiles), due, kNever, backoff, plan_number_};
      cells_due_ = std::min(cells_due_, due);
    }
    return true;
  }
  return false;
}

HoldId TileLoader::hold(std::span<const TileId> tiles, HoldKind kind) {
  Hold hold{{}, kind, plan_number_};
  for (const TileId tile : tiles)
    if (tile < store_.tile_count()) hold.tiles.push_back(tile);
  holds_.emplace(next_hold_, std::move(hold));
  stale_ = true;
  return next_hold_++;
}

void TileLoader::releaseHold(HoldId hold) { stale_ |= holds_.erase(hold) > 0; }

bool TileLoader::isHeld(HoldId id) const {
  const auto found = holds_.find(id);
  if (found == holds_.end()) return false;
  const Hold& hold = found->second;
  for (std::size_t i = 0; i < hold.tiles.size(); ++i) {
    const auto at = slots_.find(hold.tiles[i]);
    if (at != slots_.end() && at->second.state == TileState::resident) continue;
    const bool no_room = i > 0 && plan_number_ > hold.made_in_plan && (at == slots_.end() || !at->second.wanted);
    if (!no_room) return false;
  }
  return true;
}

std::vector<std::string> TileLoader::failed() const {
  std::vector<std::string> lines;
  for (const auto& [tile, line] : failed_) lines.push_back(line);
  for (const auto& [cell, line] : failed_cells_) lines.push_back(line);
  return lines;
}

void TileLoader::ask(TileId tile) { asked_[tile] = {now_ + pace_.hold, ++ask_serial_}; }

void TileLoader::settle() {
  for (bool busy = true; busy;) {
    flush();
    busy = false;
    for (Peer& p : peers_) busy |= p.channel.apply(std::numeric_limits<int>::max()) > 0;
    takeAcknowledgements();
  }
}

void TileLoader::claimHolds() {
  double order = 0;
  for (const auto& [id, hold] : holds_)
    for (const TileId tile : hold.tiles) {
      double cost = ++order;
      if (hold.kind == HoldKind::cell) {
        cost = std::numeric_limits<double>::infinity();
        for (const Peer& p : peers_)
          if (p.has_focus && p.focus.p_W.allFinite()) cost = std::min(cost, prefetch_.distance_um(tile, p.focus.p_W));
      }
      claims_.push_back({tile, hold.kind == HoldKind::target ? Rank::target : Rank::kept, cost});
    }
}

std::span<const TileId> TileLoader::tilesOf(std::uint32_t cell) {
  const auto found = cells_.find(cell);
  if (found == cells_.end() || found->second.usable > now_) return {};
  found->second.last_plan = plan_number_;
  return found->second.tiles;
}

void TileLoader::claimTarget(Peer& p) {
  p.target.clear();
  if (p.focus.target_tile >= store_.tile_count()) return;
  ReaderFocus there = p.focus;
  there.active_tile = p.focus.target_tile;
  there.active_node = p.focus.target_node;
  there.p_W = p.focus.target_W;
  there.v_W.setZero();
  if (options_.prefetch == PrefetchPolicy::structure) {
    prefetch_.claimAhead(there, loaded_, tilesOf(there.active_node.cell), options_.budget_bytes, p.target);
    std::erase_if(p.target, [](const TileClaim& c) { return c.cost > kTargetTime_s; });
  } else {
    there.radius_um *= kTargetPart;
    prefetch_.claimAround(there, options_.budget_bytes, p.target);
  }
  std::erase_if(p.target, [&](const TileClaim& c) { return c.tile == there.active_tile; });
  p.target.insert(p.target.begin(), {there.active_tile, -1});
}

void TileLoader::tellTargets() {
  for (Peer& p : peers_) {
    std::uint64_t ready = UINT64_MAX;
    if (!p.walk_stale && !p.target.empty() && p.planned.target_node == p.focus.target_node) {
      bool all = true;
      for (std::size_t i = 0; i < p.target.size() && all; ++i) {
        const auto at = slots_.find(p.target[i].tile);
        all = at == slots_.end() ? i > 0 : at->second.state == TileState::resident || (i > 0 && !at->second.wanted);
      }
      if (all) ready = p.planned.target_node.key();
    }
    p.channel.ready_target.store(ready, std::memory_order_release);
  }
}

void TileLoader::claimFor(Peer& p) {
  if (p.walk_stale) {
    p.ahead.clear();
    prefetch_.claimAhead(p.focus, loaded_, tilesOf(p.focus.active_node.cell), options_.budget_bytes, p.ahead);
    claimTarget(p);
  }
  if (p.around_stale) {
    p.around.clear();
    prefetch_.claimAround(p.focus, options_.budget_bytes, p.around);
  }
  if (p.walk_stale || p.around_stale) p.planned = p.focus;
  p.walk_stale = p.around_stale = false;
  for (const TileClaim& c : p.target) claims_.push_back({c.tile, Rank::target, c.cost});
  for (const TileClaim& c : p.ahead) claims_.push_back({c.tile, Rank::ahead, c.cost});
  for (const TileClaim& c : p.around) claims_.push_back({c.tile, p.focus.is_view ? Rank::view : Rank::around, c.cost});
}

void TileLoader::collectClaims() {
  claims_.clear();
  if (store_.long_tile() != kNoTile) claims_.push_back({store_.long_tile(), Rank::pinned, 0});
  for (const Peer& p : peers_)
    if (p.has_focus && p.focus.active_tile < store_.tile_count())
      claims_.push_back({p.focus.active_tile, Rank::pinned, 1});
  // A request that is still queued is kept: it was never served.
  std::erase_if(asked_, [&](const auto& a) {
    const auto at = slots_.find(a.first);
    return a.second.until < now_ && !(at != slots_.end() && at->second.state == TileState::queued);
  });
  for (const auto& [tile, a] : asked_) claims_.push_back({tile, Rank::asked, -static_cast<double>(a.serial)});
  claimHolds();
  for (Peer& p : peers_)
    if (p.has_focus) claimFor(p);

  const auto better = [](const Claim& a, const Claim& b) {
    return a.rank != b.rank ? a.rank < b.rank : a.cost < b.cost;
  };
  std::sort(claims_.begin(), claims_.end(),
            [&](const Claim& a, const Claim& b) { return a.tile != b.tile ? a.tile < b.tile : better(a, b); });
  const auto same = [](const Claim& a, const Claim& b) { return a.tile == b.tile; };
  claims_.erase(std::unique(claims_.begin(), claims_.end(), same), claims_.end());
  for (Claim& c : claims_)
    if (c.rank >= Rank::ahead && inMemory(c.tile)) c.cost *= kHeadStart;
  std::stable_sort(claims_.begin(), claims_.end(), better);
}

void TileLoader::planIfDue(double due) {
  const bool listed = now_ >= cells_due_;  // the tiles of a cell have become known
  const bool late = now_ - planned_at_ >= pace_.replan;
  if (listed) cells_due_ = std::numeric_limits<double>::infinity();
  if (listed || late)
    for (Peer& p : peers_) p.walk_stale = true;
  if (stale_ || listed || late) plan(due);
  tellTargets();
}

void TileLoader::plan(double due) {
  ++plan_number_;
  planned_at_ = now_;
  stale_ = false;
  collectClaims();
  for (auto& [tile, slot] : slots_) {
    slot.order = kUnclaimed;
    slot.wanted = slot.ahead = false;
  }
  const auto stays = [&](const Claim& c) { return c.rank == Rank::pinned && inMemory(c.tile); };
  std::uint64_t total = 0;
  for (const Claim& c : claims_)
    if (stays(c)) total += bytesOf(c.tile);
  bool full = false;
  for (std::size_t i = 0; i < claims_.size(); ++i) {
    const Claim& c = claims_[i];
    if (const SlotPlace at = slots_.find(c.tile); at != slots_.end()) {
      at->second.order = i;
      at->second.last_claimed = plan_number_;
    }
    if (waitsForRetry(c.tile)) continue;
    if (!stays(c)) {
      if (full || total + bytesOf(c.tile) > options_.budget_bytes) {
        full |= c.rank >= Rank::ahead;  // nothing less urgent may slip in before it
        continue;
      }
      total += bytesOf(c.tile);
    }
    Slot& slot = slots_[c.tile];
    slot.wanted = true;
    slot.ahead = c.rank == Rank::ahead || c.rank == Rank::target;
    slot.order = i;
    slot.last_claimed = plan_number_;
    if (slot.state == TileState::absent || slot.state == TileState::failed) {
      slot.state = TileState::queued;
      slot.due = due;
      slot.queued_at = now_;
      slot.held_once = false;
    }
  }
  counters_.queued = 0;
  for (SlotPlace at = slots_.begin(); at != slots_.end();) {
    const bool queued = at->second.state == TileState::queued, useless = queued && !at->second.wanted;
    counters_.cancelled += useless;
    counters_.queued += queued && !useless;
    at = useless ? slots_.erase(at) : std::next(at);
  }
  counters_.peak_queued = std::max(counters_.peak_queued, counters_.queued);
}

std::vector<TileId> TileLoader::dueTiles() const {
  std::vector<std::pair<std::size_t, TileId>> due;
  for (const auto& [tile, slot] : slots_)
    if (slot.state == TileState::queued && slot.due <= now_) due.emplace_back(slot.order, tile);
  std::sort(due.begin(), due.end());
  std::vector<TileId> tiles;
  tiles.reserve(due.size());
  for (const auto& [order, tile] : due) tiles.push_back(tile);
  return tiles;
}

TileId TileLoader::nextDue() const {
  const std::pair<const TileId, Slot>* best = nullptr;
  for (const auto& at : slots_)
    if (at.second.state == TileState::queued && at.second.due <= now_ &&
        (best == nullptr || at.second.order < best->second.order))
      best = &at;
  return best == nullptr ? kNoTile : best->first;
}

std::uint64_t TileLoader::dueBytes(std::size_t most) const {
  const std::vector<TileId> tiles = dueTiles();
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < std::min(most, tiles.size()); ++i) sum += bytesOf(tiles[i]);
  return sum;
}

void TileLoader::release(SlotPlace at) {
  counters_.bytes -= bytesOf(at->first);
  leaving_ -= bytesOf(at->first);
  stale_ |= at->second.wanted;
  slots_.erase(at);
}

void TileLoader::retire(SlotPlace at) {
  Slot& slot = at->second;
  const TileId tile = at->first;
  slot.state = TileState::retiring;
  counters_.prefetch_wasted += slot.foreseen;
  evicted_[tile] = true;
  slot.retires_left = peers_.size();
  loaded_.retire(tile);
  leaving_ += bytesOf(tile);
  ++counters_.evictions;
  if (peers_.empty()) {
    release(at);
  } else {
    send({nullptr, tile});
  }
}

// The worst claim goes first; of those without a claim, the one that lost it longest ago.
TileLoader::SlotPlace TileLoader::victim(const MayGo& may_go) {
  SlotPlace worst = slots_.end();
  for (SlotPlace at = slots_.begin(); at != slots_.end(); ++at) {
    const Slot& slot = at->second;
    if (!slot.inMemory() || pinned(at->first) || !may_go(at->first, slot)) continue;
    const bool worse = worst == slots_.end() || slot.order > worst->second.order ||
                       (slot.order == worst->second.order && slot.last_claimed < worst->second.last_claimed);
    if (worse) worst = at;
  }
  return worst;
}

bool TileLoader::makeRoom(std::uint64_t need, bool at_once, const MayGo& may_go) {
  while (counters_.bytes - leaving_ + reserved_ + need > options_.budget_bytes) {
    const SlotPlace at = victim(may_go);
    if (at == slots_.end()) return false;
    retire(at);
    if (at_once) settle();
  }
  return counters_.bytes + reserved_ + need <= options_.budget_bytes;
}

bool TileLoader::read(TileId tile, std::unique_lock<std::mutex>& lock) {
  Slot& slot = slots_[tile];  // stays: nobody erases a tile that is being read
  if (slot.state == TileState::queued) {
    --counters_.queued;
  } else {
    slot.queued_at = now_;
    slot.held_once = false;
  }
  slot.state = TileState::reading;
  const std::uint64_t bytes = bytesOf(tile);
  reserved_ += bytes;
  std::shared_ptr<const Tile> got;
  std::string reason;
  lock.unlock();
  try {
    got = store_.load(tile);
    if (got->bytes() != bytes) {
      reason =
          "decodes to " + std::to_string(got->bytes()) + " bytes where the directory says " + std::to_string(bytes);
      got.reset();
    }
  } catch (const std::exception& error) {
    reason = error.what();
  }
  lock.lock();
  reserved_ -= bytes;
  if (slot.ahead) {
    for (Peer& p : peers_) p.walk_stale = true;  // the walk may go on through it
    stale_ = true;
  }
  if (got == nullptr) {
    slot.state = TileState::failed;
    slot.backoff = slot.backoff > 0 ? std::min(2 * slot.backoff, pace_.last_retry) : pace_.first_retry;
    slot.retry = now_ + slot.backoff;
    ++counters_.failures;
    failed_[tile] = "tile " + std::to_string(tile) + ": " + reason;
    return false;
  }
  failed_.erase(tile);
  slot.backoff = 0;
  slot.tile = std::move(got);
  slot.adds_left = peers_.size();
  slot.state = TileState::ready;
  slot.last_claimed = plan_number_;
  slot.foreseen = !asked_.contains(tile) && !pinned(tile);
  if (peers_.empty()) arrive(slot);
  ++counters_.reads;
  counters_.prefetched += slot.foreseen;
  counters_.bytes_read_decoded += bytes;
  counters_.bytes += bytes;
  counters_.peak_bytes = std::max(counters_.peak_bytes, counters_.bytes);
  loaded_.add(*slot.tile);
  send({slot.tile.get(), tile});
  return true;
}

}  // namespace filiform::internal
