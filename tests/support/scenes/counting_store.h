// A tile store for tests: counts loads, fails or delays loads on request, and knows which tiles are still held.
#pragma once

#include "index/file/internal/read_once.h"
#include "index/set/forwarding_store.h"

#include <chrono>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <vector>

namespace filiform::test {

// Thread rule: internally synchronised.
class CountingStore : public ForwardingStore {
 public:
  static constexpr int kForever = -1;

  // With `most_landmarks`, the landmarks are chosen anew, at most this many: few are chosen quickly.
  explicit CountingStore(const TileStore& store, std::size_t most_landmarks = 0)
      : ForwardingStore(store), most_landmarks_(most_landmarks), account_(std::make_shared<Account>()) {}

  // Makes the next `times` loads of the tile throw CorruptTile.
  void failLoads(TileId tile, int times = kForever);
  // Makes every load take at least this long.
  void delayLoads(std::chrono::microseconds delay);
  // Adds a random delay up to this to each load.
  void jitterLoads(std::chrono::microseconds most);

  std::vector<TileId> loads() const;  // in order, with failed loads
  std::size_t loads(TileId tile) const;
  std::size_t landmarkReads() const;  // calls of landmarks()
  // Tile::bytes() of the tiles that somebody still holds, each load counted; below, the largest value so far.
  std::uint64_t heldBytes() const;
  std::uint64_t peakHeldBytes() const;

  std::shared_ptr<const Tile> load(TileId tile) const override;
  const Landmarks& landmarks() const override;

 private:
  struct Account {  // outlives the store, because a tile may be freed later
    std::mutex mutex;
    std::vector<TileId> loads;
    std::size_t landmark_reads = 0;
    std::map<TileId, int> failures;
    std::chrono::microseconds delay{0}, jitter{0};
    std::mt19937_64 random{11};
    std::uint64_t held = 0, peak_held = 0;
  };

  const std::size_t most_landmarks_;
  mutable internal::ReadOnce<Landmarks> chosen_;
  std::shared_ptr<Account> account_;
};

}  // namespace filiform::test
