#include "index/streaming/internal/tile_loader.h"

#include "index/errors.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace filiform::internal {
namespace {

// Tiles in memory count as 20 % nearer, so that tiles at the rim are not swapped back and forth.
constexpr double kHeadStart = 0.8;
// Fraction of the workspace's radius after which the walk ahead is repeated. Fraction of the radius that the budget
// covers after which the tiles around are listed again: this costs more and changes less.
constexpr double kWalkAgain = 1.0 / 32, kAroundAgain = 1.0 / 8;
// In real time, plans follow each other after at least so many times the time that one took: the rest is for reads.
// Each tile that is read on the way ahead makes the plan outdated.
constexpr double kRestOfPlan = 4;

}  // namespace

TileLoader::TileLoader(const TileStore& store, const ResidencyOptions& options, std::function<void()> leaves)
    : store_(store),
      pages_(store),
      options_(options),
      leaves_(std::move(leaves)),
      finder_(pages_),
      prefetch_(pages_, finder_, options.prefetch, options.lookahead_s),
      in_flight_(options.io_threads > 0 ? options.io_threads : ResidencyOptions::kLeastRemoteReads,
                 options.io_threads > 0 ? options.io_threads : ResidencyOptions::kMostRemoteReads),
      slots_(store.tile_count()),
      loaded_(store.tile_count()),
      claimed_in_(store.tile_count()),
      evicted_(store.tile_count()) {}

void TileLoader::adoptLongTile(std::shared_ptr<const Tile> tile) {
  TileSlot& slot = slots_[tile->id()];
  pages_.entry(tile->id());
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
  const TileSlot* const slot = slots_.find(tile);
  return slot != nullptr && slot->state == TileState::failed && slot->retry > now_;
}

void TileLoader::send(const TileMessage& message) {
  for (Peer& p : peers_)
    if (p.reader) p.outbox.push_back(message);
  flush();
}

void TileLoader::flush() {
  for (Peer& p : peers_)
    while (!p.outbox.empty() && p.under_way < TileChannel::kRing) {
      p.reader->inbox.push(p.outbox.front());
      p.outbox.pop_front();
      ++p.under_way;
    }
}

void TileLoader::takeAcknowledgements() {
  for (Peer& p : peers_)
    for (TileAcknowledgement a; p.reader && p.reader->acknowledgements.pop(a);) {
      --p.under_way;
      TileSlot& slot = *slots_.find(a.id);
      if (a.retired) {
        if (--slot.retires_left == 0) release(slot);
      } else if (--slot.adds_left == 0 && slot.state == TileState::ready) {
        arrive(slot);
      }
    }
  flush();
}

void TileLoader::arrive(TileSlot& slot) {
  slot.state = TileState::resident;
  if (slot.held_once) return;  // a reader was added later
  slot.held_once = true;
  const double wait = now_ - slot.queued_at;
  counters_.wait_sum += wait;
  counters_.wait_most = std::max(counters_.wait_most, wait);
  ++counters_.waits;
}

void TileLoader::use(TileId tile) {
  TileSlot* const slot = slots_.find(tile);
  if (slot == nullptr || !slot->foreseen) return;
  slot->foreseen = false;
  ++counters_.prefetch_used;
}

void TileLoader::takeFocus() {
  for (Peer& p : peers_) {
    const TileId before = p.focus.active_tile;
    if (!p.ends.focus.take(p.focus)) continue;
    if (p.focus.active_tile != before && inMemory(p.focus.active_tile)) {
      ++counters_.entered;
      use(p.focus.active_tile);
    }
    const bool afresh = !p.has_focus || p.focus.radius_um != p.planned.radius_um;
    const bool elsewhere = p.focus.active_tile != p.planned.active_tile ||
                           p.focus.target_tile != p.planned.target_tile || p.focus.target_node != p.planned.target_node;
    if (afresh || elsewhere || !((p.focus.p_W - p.planned.p_W).norm() <= kWalkAgain * p.focus.radius_um)) {
      p.walk_stale = stale_ = true;
      urgent_ |= elsewhere;
      active_at_ = now_;
    }
    if (afresh || !((p.focus.p_W - p.around_W).norm() <= kAroundAgain * p.around_um)) p.around_stale = stale_ = true;
    p.has_focus = true;
  }
}

void TileLoader::countMiss(TileId tile) {
  const TileSlot* const slot = slots_.find(tile);
  const TileState state = slot == nullptr ? TileState::absent : slot->state;
  if (state == TileState::failed) {
    ++counters_.missed_failed;
  } else if (state == TileState::queued || state == TileState::reading) {
    ++counters_.missed_late;
  } else if (plan_number_ > 0 && claimed_in_[tile] == plan_number_) {
    ++counters_.missed_full;
  } else if (evicted_[tile]) {
    ++counters_.missed_evicted;
  } else {
    ++counters_.missed_unclaimed;
  }
}

void TileLoader::takeRequests() {
  for (Peer& p : peers_)
    for (TileId tile; p.ends.requests.pop(tile);) {
      if (tile >= store_.tile_count()) continue;
      const bool again = asked_.contains(tile) && slots_.find(tile) != nullptr;
      if (!again && !inMemory(tile)) {
        countMiss(tile);
        stale_ = urgent_ = true;
      }
      active_at_ = now_;
      use(tile);
      ask(tile);
    }
}

std::vector<std::string> TileLoader::failed() const {
  std::vector<std::string> lines;
  for (const auto& [tile, line] : failed_) lines.push_back(line);
  for (const auto& [cell, line] : failed_cells_) lines.push_back(line);
  for (const auto& [page, failure] : failed_pages_) lines.push_back(failure.line);
  return lines;
}

std::vector<std::string> TileLoader::missing() const {
  std::vector<std::string> lines;
  for (const auto& [tile, line] : failed_)
    if (const TileSlot* const slot = slots_.find(tile); slot != nullptr && slot->last_claimed == plan_number_)
      lines.push_back(line);
  const std::vector<std::uint32_t> cells = cellsOfReaders();
  for (const auto& [cell, line] : failed_cells_)
    if (std::find(cells.begin(), cells.end(), cell) != cells.end()) lines.push_back(line);
  for (const auto& [page, failure] : failed_pages_) lines.push_back(failure.line);
  return lines;
}

void TileLoader::ask(TileId tile) { asked_[tile] = {now_ + pace_.hold, ++ask_serial_}; }

void TileLoader::settle() {
  for (bool busy = true; busy;) {
    flush();
    busy = false;
    for (Peer& p : peers_) busy |= p.reader && p.reader->apply(std::numeric_limits<int>::max()) > 0;
    takeAcknowledgements();
  }
}

void TileLoader::claimFor(Peer& p) {
  if (p.walk_stale) {
    p.ahead.clear();
    prefetch_.claimAhead(p.focus, loaded_, tilesOf(p.focus.active_node.cell), partOf(p), p.ahead);
    claimTarget(p);
  }
  if (p.around_stale) {
    p.around_W = p.focus.p_W;
    p.around.clear();
    p.around_stale = !prefetch_.claimAround(p.focus, partOf(p), p.around);
    p.around_um = p.around.empty() ? 0 : p.around.back().cost;
  }
  if (p.walk_stale) p.planned = p.focus;
  p.walk_stale = false;
  for (const TileClaim& c : p.target) claims_.push_back({c.tile, Rank::target, c.cost});
  for (const TileClaim& c : p.ahead) claims_.push_back({c.tile, Rank::ahead, c.cost});
  for (const TileClaim& c : p.around) claims_.push_back({c.tile, p.focus.is_view ? Rank::view : Rank::around, c.cost});
}

void TileLoader::collectClaims() {
  claims_.clear();
  if (std::any_of(peers_.begin(), peers_.end(), [](const Peer& p) { return p.walk_stale; })) pages_.forgetNoted();
  if (store_.long_tile() != kNoTile) claims_.push_back({store_.long_tile(), Rank::pinned, 0});
  for (const Peer& p : peers_)
    if (p.has_focus && p.focus.active_tile < store_.tile_count())
      claims_.push_back({p.focus.active_tile, Rank::pinned, 1});
  // Keep requests that are still queued: they were not served.
  std::erase_if(asked_, [&](const auto& a) {
    const TileSlot* const slot = slots_.find(a.first);
    return a.second.until < now_ && !(slot != nullptr && slot->state == TileState::queued);
  });
  for (const auto& [tile, a] : asked_) claims_.push_back({tile, Rank::asked, -static_cast<double>(a.serial)});
  claimHolds();
  for (Peer& p : peers_)
    if (p.has_focus) claimFor(p);
  // No claim needs such a page any more, or it could be read meanwhile.
  std::erase_if(failed_pages_, [&](const auto& failed) { return !pages_.noted().contains(failed.first); });

  pages_.setCost(-1);  // before any state changes: in virtual time this may throw
  std::erase_if(claims_, [&](const Claim& c) { return pages_.find(c.tile) == nullptr; });
  for (Claim& c : claims_)
    if (c.rank >= Rank::ahead && inMemory(c.tile)) c.cost *= kHeadStart;
  std::sort(claims_.begin(), claims_.end(), [](const Claim& a, const Claim& b) {
    return a.rank != b.rank ? a.rank < b.rank : a.cost != b.cost ? a.cost < b.cost : a.tile < b.tile;
  });
  // Of several claims on a tile, the most urgent counts.
  std::erase_if(claims_,
                [&](const Claim& c) { return std::exchange(claimed_in_[c.tile], plan_number_) == plan_number_; });
}

void TileLoader::planIfDue(double due) {
  const bool listed = now_ >= cells_due_;  // the tiles of a cell have become known
  const double crowd = crowdRest();
  const bool late = now_ - planned_at_ >= std::max(pace_.replan, 5 * crowd);
  if (listed) cells_due_ = std::numeric_limits<double>::infinity();
  if (listed || late)
    for (Peer& p : peers_) p.walk_stale = true;
  stale_ |= listed;
  urgent_ |= listed;
  const double rest = urgent_ ? crowd : std::max({pace_.rest, crowd, kRestOfPlan * plan_took_});
  const bool rested = rest == 0 || now_ - planned_at_ >= rest;
  if ((stale_ && rested) || late) {
    const auto begun = std::chrono::steady_clock::now();
    plan(due);
    if (pace_.is_real) plan_took_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }
  tellTargets();
}

void TileLoader::plan(double due) {
  ++plan_number_;
  planned_at_ = now_;
  stale_ = urgent_ = false;
  try {
    collectClaims();
  } catch (...) {
    --plan_number_;  // no plan was made
    throw;
  }
  for (TileSlot* const slot : slots_.all()) {
    slot->order = TileSlot::kUnclaimed;
    slot->wanted = slot->ahead = false;
  }
  const auto stays = [&](const Claim& c) { return c.rank == Rank::pinned && inMemory(c.tile); };
  std::uint64_t total = 0;
  for (const Claim& c : claims_)
    if (stays(c)) total += bytesOf(c.tile);
  bool full = false;
  queue_.clear();
  head_ = 0;
  for (std::size_t i = 0; i < claims_.size(); ++i) {
    const Claim& c = claims_[i];
    if (TileSlot* const slot = slots_.find(c.tile)) {
      slot->order = i;
      slot->last_claimed = plan_number_;
    }
    if (waitsForRetry(c.tile)) continue;
    if (!stays(c)) {
      if (full || total + bytesOf(c.tile) > options_.budget_bytes) {
        full |= c.rank >= Rank::ahead;  // no less urgent claim may come before it
        continue;
      }
      total += bytesOf(c.tile);
    }
    TileSlot& slot = slots_[c.tile];
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
    if (slot.state == TileState::queued) queue_.push_back(c.tile);
  }
  counters_.queued = queue_.size();
  counters_.peak_queued = std::max(counters_.peak_queued, counters_.queued);
  unwanted_.clear();
  for (std::size_t i = slots_.all().size(); i-- > 0;) {  // backwards: erasing moves the last slot here
    TileSlot& slot = *slots_.all()[i];
    if (slot.wanted) continue;
    if (slot.inMemory()) unwanted_.push_back(&slot);
    if (slot.state != TileState::queued) continue;
    ++counters_.cancelled;
    slots_.erase(slot);
  }
  std::sort(unwanted_.begin(), unwanted_.end(), goesLater);
}

std::vector<TileId> TileLoader::dueTiles() const {
  std::vector<TileId> tiles;
  for (std::size_t i = head_; i < queue_.size(); ++i)
    if (isDue(queue_[i])) tiles.push_back(queue_[i]);
  return tiles;
}

bool TileLoader::isDue(TileId tile) const {
  const TileSlot* const slot = slots_.find(tile);
  return slot != nullptr && slot->state == TileState::queued && slot->due <= now_;
}

TileId TileLoader::nextDue() {
  const auto waits = [&](TileId tile) {
    const TileSlot* const slot = slots_.find(tile);
    return slot != nullptr && slot->state == TileState::queued;
  };
  while (head_ < queue_.size() && !waits(queue_[head_])) ++head_;
  for (std::size_t i = head_; i < queue_.size(); ++i)
    if (isDue(queue_[i])) return queue_[i];
  return kNoTile;
}

std::uint64_t TileLoader::dueBytes(std::size_t most) const {
  std::uint64_t sum = 0;
  for (std::size_t i = head_; i < queue_.size() && most > 0; ++i) {
    if (!isDue(queue_[i])) continue;
    sum += bytesOf(queue_[i]);
    --most;
  }
  return sum;
}

bool TileLoader::read(TileId tile, std::unique_lock<std::mutex>& lock) {
  TileSlot& slot = slots_[tile];  // stays valid: a tile being read is never erased
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
  ++reading_;
  leaves_();
  lock.unlock();
  const auto begun = std::chrono::steady_clock::now();
  try {
    got = store_.load(tile);
    if (got->bytes() != bytes) {
      reason = "decodes to " + std::to_string(got->bytes()) + " bytes; the directory says " + std::to_string(bytes);
      got.reset();
    }
  } catch (const std::exception& error) {
    reason = error.what();
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  lock.lock();
  --reading_;
  if (pace_.is_real) {
    latency_.add(took.count());
    in_flight_.add(took.count());
    prefetch_.setLookahead(latency_.lookahead_s(options_.lookahead_s));
    counters_.read_mean_s = latency_.mean_s();
  }
  reserved_ -= bytes;
  if (slot.ahead) {
    for (Peer& p : peers_) p.walk_stale = true;  // the walk may continue through it
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
  slot.adds_left = readers_;
  slot.state = TileState::ready;
  slot.last_claimed = plan_number_;
  slot.foreseen = !asked_.contains(tile) && !pinned(tile);
  // A plan made during the read may not want it any more.
  if (!slot.wanted) unwanted_.insert(std::upper_bound(unwanted_.begin(), unwanted_.end(), &slot, goesLater), &slot);
  if (readers_ == 0) arrive(slot);
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
