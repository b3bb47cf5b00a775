#include "index/streaming/residency.h"

#include "index/errors.h"
#include "index/set/reads_at_once.h"
#include "index/streaming/internal/tile_loader.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace filiform {
namespace {

// Readers cannot wake the loader: this would be a system call in their tick. The loader therefore polls, more often
// while a reader moves.
constexpr std::chrono::microseconds kBusyPoll{200}, kIdlePoll{2000};
constexpr double kIdleAfter_s = 0.5;
// Evictions wait for acknowledgements, so room is made for this many tiles at once.
constexpr std::size_t kRoomAhead = 16;

}  // namespace

const char* toString(TileState state) {
  switch (state) {
    case TileState::absent:
      return "absent";
    case TileState::queued:
      return "queued";
    case TileState::reading:
      return "reading";
    case TileState::ready:
      return "ready";
    case TileState::resident:
      return "resident";
    case TileState::retiring:
      return "retiring";
    case TileState::failed:
      return "failed";
  }
  return "unknown";
}

struct Residency::Impl {
  const TileStore& store;
  const std::uint64_t budget_bytes;
  const unsigned io_threads;
  mutable std::mutex mutex;
  std::condition_variable stop, work;
  std::vector<std::thread> threads;
  bool started = false, stopping = false, polling = false;
  internal::TileLoader loader;

  Impl(const TileStore& s, const ResidencyOptions& options)
      : store(s),
        budget_bytes(options.budget_bytes),
        io_threads(options.io_threads > 0 ? options.io_threads
                   : s.isRemote()         ? std::min(ResidencyOptions::kMostRemoteReads, 2 * readsAtOnce(s))
                                          : 1),
        loader(s, options, [this] { work.notify_one(); }) {}

  void requireNotStarted(const char* call) const {
    if (started) throw std::logic_error(std::string("Residency::") + call + " while its thread runs");
  }

  bool round(double now_s, std::unique_lock<std::mutex>& lock) {
    loader.mayReadPages(false);
    loader.setTime(now_s, internal::kSecondPace);
    loader.takeAcknowledgements();
    loader.takeFocus();
    loader.takeRequests();
    if (loader.fetchCells(now_s, lock)) return true;
    loader.planIfDue(now_s);
    if (loader.readPage(lock)) return true;
    const TileId next = loader.mayReadMore() ? loader.nextDue() : kNoTile;
    if (next == kNoTile) return false;
    loader.makeRoom(loader.dueBytes(kRoomAhead), false);
    if (!loader.makeRoom(loader.bytesOf(next), false)) return false;
    loader.read(next, lock);
    return true;
  }

  // One thread at a time takes messages; the others wait for a tile to read.
  void run() {
    std::unique_lock lock(mutex);
    while (!stopping) {
      const std::chrono::duration<double> now = std::chrono::steady_clock::now().time_since_epoch();
      if (round(now.count(), lock)) continue;
      if (polling) {
        work.wait(lock);
        continue;
      }
      polling = true;
      stop.wait_for(lock, now.count() - loader.lastActive() < kIdleAfter_s ? kBusyPoll : kIdlePoll);
      polling = false;
    }
    work.notify_all();
  }
};

Residency::Residency(const TileStore& store, const ResidencyOptions& options) {
  const std::uint64_t floor = floorBytes(store);
  if (options.budget_bytes < floor)
    throw UsageError(
        "--budget " + std::to_string(options.budget_bytes) + " is below the floor of " + std::to_string(floor) +
        " bytes (the two largest tiles and the long-segment tile); give at least " + std::to_string(floor));
  impl_ = std::make_unique<Impl>(store, options);
  const TileId long_tile = store.long_tile();
  if (long_tile == kNoTile) return;
  // The caller must get this error: without this tile every result may be wrong.
  std::shared_ptr<const Tile> tile = store.load(long_tile);
  if (tile->bytes() != store.entry(long_tile).decoded_bytes)
    throw CorruptTile(long_tile, "directory", 0, "the long-segment tile's decoded size differs from the directory's");
  impl_->loader.adoptLongTile(std::move(tile));
}

Residency::~Residency() { stop(); }

std::uint64_t Residency::floorBytes(const TileStore& store) { return store.floorBytes(); }

TileReader& Residency::addReader(const std::string&) {
  const std::lock_guard lock(impl_->mutex);
  impl_->requireNotStarted("addReader");
  return impl_->loader.addReader();
}

TileFocus& Residency::addFocus() {
  const std::lock_guard lock(impl_->mutex);
  return impl_->loader.addFocus();
}

void Residency::removeFocus(TileFocus& focus) {
  const std::lock_guard lock(impl_->mutex);
  impl_->loader.removeFocus(focus);
}

void Residency::start() {
  const std::lock_guard lock(impl_->mutex);
  impl_->requireNotStarted("start");
  impl_->started = true;
  impl_->stopping = false;
  for (unsigned i = 0; i < impl_->io_threads; ++i) impl_->threads.emplace_back(&Impl::run, impl_.get());
}

void Residency::stop() {
  if (impl_ == nullptr) return;
  {
    const std::lock_guard lock(impl_->mutex);
    if (!impl_->started) return;
    impl_->stopping = true;
  }
  impl_->stop.notify_all();
  impl_->work.notify_all();
  for (std::thread& thread : impl_->threads) thread.join();
  const std::lock_guard lock(impl_->mutex);
  impl_->threads.clear();
  impl_->started = false;
}

bool Residency::serve(double now_s) {
  std::unique_lock lock(impl_->mutex);
  impl_->requireNotStarted("serve");
  return impl_->round(now_s, lock);
}

void Residency::advance(std::uint64_t tick, std::uint64_t latency_ticks) {
  std::unique_lock lock(impl_->mutex);
  impl_->requireNotStarted("advance");
  internal::TileLoader& loader = impl_->loader;
  loader.mayReadPages(true);
  loader.setTime(static_cast<double>(tick), internal::kTickPace);
  loader.settle();
  loader.takeFocus();
  loader.takeRequests();
  const double due = static_cast<double>(tick) + static_cast<double>(latency_ticks);
  while (loader.fetchCells(due, lock)) {
  }
  loader.planIfDue(due);
  for (const TileId tile : loader.dueTiles()) {
    if (!loader.makeRoom(loader.bytesOf(tile), true)) continue;
    loader.read(tile, lock);
    loader.settle();
  }
}

bool Residency::loadTogether(std::span<const TileId> tiles) {
  std::unique_lock lock(impl_->mutex);
  impl_->requireNotStarted("loadTogether");
  internal::TileLoader& loader = impl_->loader;
  loader.mayReadPages(true);
  loader.setTime(loader.now(), internal::kTickPace);
  loader.settle();
  loader.takeFocus();
  std::vector<TileId> together(tiles.begin(), tiles.end());
  std::sort(together.begin(), together.end());
  together.erase(std::unique(together.begin(), together.end()), together.end());
  if (!together.empty() && together.back() >= impl_->store.tile_count()) return false;

  const auto asked = [&](TileId tile) { return std::binary_search(together.begin(), together.end(), tile); };
  std::uint64_t need = 0, keep = 0;
  for (const TileId tile : together) {
    if (!loader.inMemory(tile)) need += loader.bytesOf(tile);
  }
  for (const internal::TileSlot* const slot : loader.slots().all())
    if (slot->inMemory() && (loader.pinned(slot->id) || asked(slot->id))) keep += loader.bytesOf(slot->id);
  if (keep > impl_->budget_bytes || need > impl_->budget_bytes - keep) return false;

  for (const TileId tile : together) loader.ask(tile);
  bool all = true;
  loader.makeRoom(need, true, [&](const internal::TileSlot& slot) { return !asked(slot.id); });
  for (const TileId tile : together) {
    if (loader.inMemory(tile)) continue;
    all &= loader.read(tile, lock);
    loader.settle();
  }
  return all;
}

HoldId Residency::hold(std::span<const TileId> tiles, HoldKind kind) {
  const std::lock_guard lock(impl_->mutex);
  return impl_->loader.hold(tiles, kind);
}

void Residency::release(HoldId hold) {
  const std::lock_guard lock(impl_->mutex);
  impl_->loader.releaseHold(hold);
}

bool Residency::isHeld(HoldId hold) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->loader.isHeld(hold);
}

TileState Residency::state(TileId tile) const {
  const std::lock_guard lock(impl_->mutex);
  if (tile >= impl_->store.tile_count()) return TileState::absent;
  const internal::TileSlot* const slot = impl_->loader.slots().find(tile);
  return slot == nullptr ? TileState::absent : slot->state;
}

std::vector<std::pair<TileId, TileState>> Residency::states() const {
  std::vector<std::pair<TileId, TileState>> states;
  {
    const std::lock_guard lock(impl_->mutex);
    const std::vector<internal::TileSlot*>& slots = impl_->loader.slots().all();
    states.reserve(slots.size());
    for (const internal::TileSlot* slot : slots)
      if (slot->state != TileState::absent) states.emplace_back(slot->id, slot->state);
  }
  std::sort(states.begin(), states.end());
  return states;
}

ResidencyCounters Residency::counters() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->loader.counters();
}

std::uint64_t Residency::budget_bytes() const { return impl_->budget_bytes; }

std::vector<std::string> Residency::failures() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->loader.failed();
}

std::vector<std::string> Residency::missing() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->loader.missing();
}

}  // namespace filiform
