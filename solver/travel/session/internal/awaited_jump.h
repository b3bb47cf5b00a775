// A jump that waits for its tile, and for the reach of its cell. The tile is held in memory until the hand has arrived.
// Thread rule: belongs to the commanding thread.
#pragma once

#include "index/streaming/residency.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/travel/hand/internal/cell_reaches.h"
#include "solver/travel/session/worker.h"
#include "solver/workspace/navigation_link.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace filiform::internal {

class AwaitedJump {
 public:
  // The store must outlive the object.
  AwaitedJump(const TileStore& store, SolverMethod method) : reaches_(store, method) {}
  // Waits for the tile that is being read.
  ~AwaitedJump() { stops_ = true; }
  AwaitedJump(const AwaitedJump&) = delete;
  AwaitedJump& operator=(const AwaitedJump&) = delete;

  // Requests a jump to a valid place; replaces the jump that waits. `residency`: nullptr if all tiles are in memory.
  // `under_hand`: see Session::jump().
  void ask(const ProxyPlace& place, bool under_hand, Residency* residency);
  // The place of the jump that waits; nullopt: none.
  const std::optional<ProxyPlace>& place() const { return place_; }

  // Sends the jump if its tile is in memory and its reach is known. `tick`: the newest tick of the hand. If a tile
  // cannot be read, cancels the jump and returns a line for the user. `residency` must be that of ask().
  std::optional<std::string> serve(std::uint64_t tick, SpscRing<NavigationCommand>& commands, Residency* residency);

  // Drops a jump that waits, and releases its tile.
  void cancel(Residency* residency);

 private:
  bool send(SpscRing<NavigationCommand>& commands);
  bool findsReach();
  std::string drop(const std::string& why);

  std::optional<ProxyPlace> place_;
  bool under_hand_ = true;
  std::optional<HoldId> hold_;
  std::uint64_t release_at_ = 0;        // the tick at which the tile is released
  CellReaches reaches_;                 // while the worker is not idle, the worker's
  std::uint32_t searched_ = 0;          // the cell of the worker's search
  std::uint32_t unknown_ = UINT32_MAX;  // the last cell that could not be read, and why
  std::string why_;
  std::atomic<bool> stops_{false};
  std::unique_ptr<Worker> worker_;  // made at its first use; destroyed first
};

}  // namespace filiform::internal
