// A jump that waits for its tile. The tile is held in memory until the hand has arrived. Thread rule: belongs to the
// commanding thread.
#pragma once

#include "index/streaming/residency.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/workspace/navigation_link.h"

#include <cstdint>
#include <optional>
#include <string>

namespace filiform::internal {

class AwaitedJump {
 public:
  // Requests a jump to a valid place; replaces the jump that waits. `residency`: nullptr if all tiles are in memory.
  // `under_hand`: see Session::jump().
  void ask(const ProxyPlace& place, bool under_hand, Residency* residency);
  // The place of the jump that waits; nullopt: none.
  const std::optional<ProxyPlace>& place() const { return place_; }

  // Sends the jump if its tile is in memory. `tick`: the newest tick of the hand. If the tile cannot be read, cancels
  // the jump and returns a line for the user. `residency` must be that of ask().
  std::optional<std::string> serve(std::uint64_t tick, SpscRing<NavigationCommand>& commands, Residency* residency);

  // Drops a jump that waits, and releases its tile.
  void cancel(Residency* residency);

 private:
  bool send(SpscRing<NavigationCommand>& commands);

  std::optional<ProxyPlace> place_;
  bool under_hand_ = true;
  std::optional<HoldId> hold_;
  std::uint64_t release_at_ = 0;  // the tick at which the tile is released
};

}  // namespace filiform::internal
