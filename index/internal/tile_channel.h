// The rings between the loader and one reader. The loader has at most kRing messages under way to a reader, sent and
// not yet acknowledged, so neither ring can overflow, and the reader never waits, allocates or locks.
#pragma once

#include "index/residency.h"
#include "index/spsc_ring.h"
#include "index/triple_buffer.h"

#include <atomic>

namespace filiform::internal {

struct TileMessage {
  const Tile* tile;  // null: retire
  TileId id;
};

struct TileAcknowledgement {
  TileId id;
  bool retired;
};

// Thread rule: `table` and the TileReader functions belong to the reader, the other ends of the rings to the loader.
struct TileChannel : public TileReader {
  static constexpr std::size_t kRing = 1024, kRequests = 256;

  explicit TileChannel(std::size_t tile_count) : table(tile_count) {}

  const TileTable& tiles() const noexcept override { return table; }
  int apply(int most) noexcept override {
    int n = 0;
    for (TileMessage m; n < most && inbox.pop(m); ++n) {
      if (m.tile != nullptr) {
        table.add(*m.tile);
      } else {
        table.retire(m.id);
      }
      acknowledgements.push({m.id, m.tile == nullptr});
    }
    return n;
  }
  void publishFocus(const ReaderFocus& f) noexcept override { focus.publish(f); }
  void request(TileId tile) noexcept override { requests.push(tile); }
  bool isTargetReady(NodeId target_node) const noexcept override {
    return ready_target.load(std::memory_order_acquire) == target_node.key();
  }

  TileTable table;
  SpscRing<TileMessage> inbox{kRing};
  SpscRing<TileAcknowledgement> acknowledgements{kRing};
  SpscRing<TileId> requests{kRequests};
  TripleBuffer<ReaderFocus> focus;
  std::atomic<std::uint64_t> ready_target{UINT64_MAX};  // NodeId::key(), written by the loader
};

}  // namespace filiform::internal
