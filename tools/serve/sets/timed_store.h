// TimedStore: a tile store whose reads end when the time for an answer is over.
//
//   TimedStore::Limit limit(5);     // for this thread, until the end of the block
//   nearest.find(p_W, {.k = 1});    // Nearest over a TimedStore: throws AnswerTimeout instead of reading more tiles
//
// A search that reads many tiles then stops. Work on tiles in memory is not interrupted. Thread rule: internally
// synchronised; a Limit belongs to its thread. Counts the damaged tiles that it met.
#pragma once

#include "index/set/forwarding_store.h"

#include <atomic>
#include <cstdint>

namespace filiform::tools {

class TimedStore final : public ForwardingStore {
 public:
  using ForwardingStore::ForwardingStore;

  // Limits the reads of this thread while it lives. Limits do not nest.
  class Limit {
   public:
    // `left`: ends the reads also as soon as it is true.
    explicit Limit(double seconds, const std::atomic<bool>* left = nullptr);
    ~Limit();
    Limit(const Limit&) = delete;
    Limit& operator=(const Limit&) = delete;
  };
  // Throws AnswerTimeout if this thread has a limit and the time is over, or the client has left.
  static void check();
  // Reads so far that ended with CorruptTile.
  std::uint64_t damagedReads() const { return damaged_; }
  // True if this share of the time is over, or the client has left. isOver(1) is true where check() throws.
  static bool isOver(double share = 1);

  std::shared_ptr<const Tile> load(TileId tile) const override;
  TileAppearance loadAppearance(TileId tile) const override;
  CellDetail loadCellDetail(std::uint32_t id) const override;
  std::vector<TileId> cellTiles(std::uint32_t id) const override;

 private:
  template <typename Read>
  auto timed(Read read) const;
  mutable std::atomic<std::uint64_t> damaged_{0};
};

}  // namespace filiform::tools
