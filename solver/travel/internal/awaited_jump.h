// A jump that waits for its tile: the tile is held in memory until the hand has arrived there. Thread rule: belongs to
// the commanding thread.
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
  // Asks for a jump to a valid place; replaces the jump that waits. `residency`: nullptr if all tiles are in memory.
  // `under_hand`: see Session::jump().
  void ask(const ProxyPlace& place, bool under_hand, Residency* residency);
  // The place of the jump that waits.
  const std::optional<ProxyPlace>& place() const { return place_; }

  // Sends the jump if its tile has come; `tick` is the newest tick of the hand. Returns a line for the person if the
  // tile cannot be read: the jump is then given up. The same `residency` as in ask().
  std::optional<std::string> serve(std::uint64_t tick, SpscRing<NavigationCommand>& commands, Residency* residency);

 private:
  bool send(SpscRing<NavigationCommand>& commands);

  std::optional<ProxyPlace> place_;
  bool under_hand_ = true;
  std::optional<HoldId> hold_;
  std::uint64_t release_at_ = 0;  // the tick from which the tile may go
};

}  // namespace filiform::internal
