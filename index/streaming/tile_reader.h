// The side of Residency that haptic threads and cameras use: what they work on, and their table of tiles.
#pragma once

#include "index/set/tile_store.h"
#include "index/streaming/tile_table.h"

#include <cstdint>

namespace filiform {

// What a reader works on, published once a tick. The loader turns it into claims on the budget.
struct ReaderFocus {
  TileId active_tile = kNoTile;                // pinned in memory
  NodeId active_node{UINT32_MAX, UINT32_MAX};  // a node of the proxy's segment; the walk ahead starts there
  Vector3d p_W = Vector3d::Zero();             // proxy, um
  Vector3d v_W = Vector3d::Zero();             // velocity of the proxy, um/s
  Vector3d pull_W = Vector3d::Zero();          // from the proxy to the hand, um
  double radius_um = 0;                        // half the workspace: tiles within it are claimed, nearest first
  bool is_view = false;                        // for a camera: its surroundings come after those of all proxies
  // A pending jump that waits for its tiles; kNoTile: none. These tiles are claimed after the active tiles.
  TileId target_tile = kNoTile;
  NodeId target_node{UINT32_MAX, UINT32_MAX};  // a node in target_tile
  Vector3d target_W = Vector3d::Zero();        // um
};

// What one hand or camera asks for. Safe in the haptic thread: every member is noexcept, without allocation, lock or
// system call. Thread rule: owned by one reading thread.
class TileFocus {
 public:
  virtual ~TileFocus() = default;
  // Publishes what the hand works on; once a tick.
  virtual void publishFocus(const ReaderFocus& focus) noexcept = 0;
  // Requests an absent tile, which becomes urgent. A repeated request is harmless. A request is lost if the ring is
  // full and must then be repeated.
  virtual void request(TileId tile) noexcept = 0;
  // True if the pending jump can be made. The table then holds the target tile. With prefetch it also holds the tiles
  // that the proxy may reach within 2.75 times of the fastest read, at least 0.14 s and at most 0.5 s, as far as the
  // budget goes.
  virtual bool isTargetReady(NodeId target_node) const noexcept = 0;
};

// The reader's side: a table of tiles, and the focus of the one who uses it. As TileFocus.
class TileReader : public TileFocus {
 public:
  virtual const TileTable& tiles() const noexcept = 0;
  // Takes up to `most` messages from the loader, changes the table and acknowledges them. Returns the number of
  // messages.
  virtual int apply(int most = 8) noexcept = 0;
};

}  // namespace filiform
