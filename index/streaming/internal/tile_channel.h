// The queues between the loader and one reader. At most kRing messages to a reader are sent and not yet acknowledged.
// So neither queue can overflow, and the reader never waits, allocates or locks.
#pragma once

#include "index/spsc_ring.h"
#include "index/streaming/tile_reader.h"
#include "index/triple_buffer.h"

#include <atomic>

namespace filiform::internal {

struct TileMessage {
  const Tile* tile;  // nullptr: remove the tile
  TileId id;
};

struct TileAcknowledgement {
  TileId id;
  bool retired;
};

// The queues of one hand. Thread rule: the reader owns the TileFocus functions; the loader owns the other ends.
struct FocusEnds {
  SpscRing<TileId> requests{256};
  TripleBuffer<ReaderFocus> focus;
  std::atomic<std::uint64_t> ready_target{UINT64_MAX};  // NodeId::key(), written by the loader
};
template <class Interface>
struct FocusChannel : public Interface {
  void publishFocus(const ReaderFocus& f) noexcept override { ends.focus.publish(f); }
  void request(TileId tile) noexcept override { ends.requests.push(tile); }
  bool isTargetReady(NodeId target_node) const noexcept override {
    return ends.ready_target.load(std::memory_order_acquire) == target_node.key();
  }
  FocusEnds ends;
};

// Thread rule: the reader owns `table` and the TileReader functions; the loader owns the other ends of the queues.
struct TileChannel : public FocusChannel<TileReader> {
  static constexpr std::size_t kRing = 1024;

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

  TileTable table;
  SpscRing<TileMessage> inbox{kRing};
  SpscRing<TileAcknowledgement> acknowledgements{kRing};
};

}  // namespace filiform::internal
