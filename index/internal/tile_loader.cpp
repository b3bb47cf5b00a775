#include "index/internal/tile_loader.h"

#include "index/errors.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {
namespace {

// What is in memory counts as this much nearer: no swapping back and forth at the rim.
constexpr double kHeadStart = 0.8;

}  // namespace

TileLoader::TileLoader(const TileStore& store, const ResidencyOptions& options)
    : store_(store),
      options_(options),
      directory_(store),
      prefetch_(store, directory_, options.prefetch, options.lookahead_s),
      loaded_(store.tile_count()) {}

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
        slot.state = TileState::resident;
      }
    }
  flush();
}

void TileLoader::takeFocus() {
  for (Peer& p : peers_) {
    if (!p.channel.focus.take(p.focus)) continue;
    const double moved = (p.focus.p_W - p.planned.p_W).norm();
    if (!p.has_focus || p.focus.active_tile != p.planned.active_tile || p.focus.radius_um != p.planned.radius_um ||
        !(moved <= p.focus.radius_um / 32))
      stale_ = true;
    p.has_focus = true;
  }
}

void TileLoader::takeRequests() {
  for (Peer& p : peers_)
    for (TileId tile; p.channel.requests.pop(tile);) {
      if (tile >= store_.tile_count()) continue;
      const bool again = asked_.contains(tile) && slots_.contains(tile);
      ask(tile);
      if (!again && !inMemory(tile)) stale_ = true;
    }
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
  for (Peer& p : peers_) {
    if (!p.has_focus) continue;
    structure_.clear();
    workspace_.clear();
    prefetch_.claim(p.focus, loaded_, options_.budget_bytes, structure_, workspace_);
    for (const TileClaim& c : structure_) claims_.push_back({c.tile, Rank::ahead, c.cost});
    for (const TileClaim& c : workspace_) claims_.push_back({c.tile, Rank::around, c.cost});
    p.planned = p.focus;
  }

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
  if ((stale_ || now_ - planned_at_ >= pace_.replan) && loaded_.size() < store_.tile_count()) plan(due);
}

void TileLoader::plan(double due) {
  ++plan_number_;
  planned_at_ = now_;
  stale_ = false;
  collectClaims();
  for (auto& [tile, slot] : slots_) {
    slot.order = kUnclaimed;
    slot.wanted = false;
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
    slot.order = i;
    slot.last_claimed = plan_number_;
    if (slot.state == TileState::absent || slot.state == TileState::failed) {
      slot.state = TileState::queued;
      slot.due = due;
    }
  }
  for (SlotPlace at = slots_.begin(); at != slots_.end();) {
    const bool useless = at->second.state == TileState::queued && !at->second.wanted;
    counters_.cancelled += useless;
    at = useless ? slots_.erase(at) : std::next(at);
  }
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
  if (options_.prefetch == PrefetchPolicy::structure) stale_ = true;  // the walk may go on through it
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
  slot.state = peers_.empty() ? TileState::resident : TileState::ready;
  slot.last_claimed = plan_number_;
  ++counters_.reads;
  counters_.bytes_read_decoded += bytes;
  counters_.bytes += bytes;
  counters_.peak_bytes = std::max(counters_.peak_bytes, counters_.bytes);
  loaded_.add(*slot.tile);
  send({slot.tile.get(), tile});
  return true;
}

}  // namespace filiform::internal
