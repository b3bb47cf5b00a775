#include "tests/support/scenes/counting_store.h"

#include "index/errors.h"
#include "index/ingest/tiling/landmarks.h"

#include <algorithm>
#include <thread>

namespace filiform::test {

void CountingStore::failLoads(TileId tile, int times) {
  const std::lock_guard lock(account_->mutex);
  account_->failures[tile] = times;
}

void CountingStore::delayLoads(std::chrono::microseconds delay) {
  const std::lock_guard lock(account_->mutex);
  account_->delay = delay;
}

void CountingStore::jitterLoads(std::chrono::microseconds most) {
  const std::lock_guard lock(account_->mutex);
  account_->jitter = most;
}

std::vector<TileId> CountingStore::loads() const {
  const std::lock_guard lock(account_->mutex);
  return account_->loads;
}

std::size_t CountingStore::loads(TileId tile) const {
  const std::lock_guard lock(account_->mutex);
  return static_cast<std::size_t>(std::count(account_->loads.begin(), account_->loads.end(), tile));
}

std::size_t CountingStore::landmarkReads() const {
  const std::lock_guard lock(account_->mutex);
  return account_->landmark_reads;
}

std::uint64_t CountingStore::heldBytes() const {
  const std::lock_guard lock(account_->mutex);
  return account_->held;
}

std::uint64_t CountingStore::peakHeldBytes() const {
  const std::lock_guard lock(account_->mutex);
  return account_->peak_held;
}

std::shared_ptr<const Tile> CountingStore::load(TileId tile) const {
  std::chrono::microseconds delay;
  {
    const std::lock_guard lock(account_->mutex);
    account_->loads.push_back(tile);
    delay = account_->delay;
    if (const auto most = account_->jitter.count(); most > 0)
      delay += std::chrono::microseconds(account_->random() % static_cast<std::uint64_t>(most + 1));
    const auto failure = account_->failures.find(tile);
    if (failure != account_->failures.end() && failure->second != 0) {
      if (failure->second > 0) --failure->second;
      throw CorruptTile(tile, "counting.pack", 4096 * std::uint64_t{tile}, "injected failure");
    }
  }
  if (delay.count() > 0) std::this_thread::sleep_for(delay);
  const std::shared_ptr<const Tile> inner = store_.load(tile);
  const std::uint64_t bytes = inner->bytes();
  {
    const std::lock_guard lock(account_->mutex);
    account_->held += bytes;
    account_->peak_held = std::max(account_->peak_held, account_->held);
  }
  // A copy, so that the sanitizers detect a reader that uses a freed tile.
  return {new Tile(*inner), [account = account_, bytes](const Tile* copy) {
            {
              const std::lock_guard lock(account->mutex);
              account->held -= bytes;
            }
            delete copy;
          }};
}

const Landmarks& CountingStore::landmarks() const {
  {
    const std::lock_guard lock(account_->mutex);
    ++account_->landmark_reads;
  }
  if (most_landmarks_ == 0) return store_.landmarks();
  return chosen_.get([&] { return std::make_unique<Landmarks>(chooseLandmarks(store_, most_landmarks_)); });
}

}  // namespace filiform::test
