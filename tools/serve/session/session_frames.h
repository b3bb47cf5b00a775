// The frames of a tick: PROXY and LOCAL MODEL, from the state of the navigation. A recording replays through the same
// functions. Thread rule: functions without state; ModelMaker: the ticking thread. Haptic-safe.
#pragma once

#include "solver/force/spring_model.h"
#include "solver/graph/nearby_graph.h"
#include "solver/workspace/navigation_link.h"
#include "tools/serve/session/protocol.h"
#include "tools/serve/session/remote_hand.h"

#include <array>
#include <cstdint>
#include <span>

namespace filiform::tools {

// Without seq and replaced, which the Outbox sets, and without kJumpWaits, which depends on other threads.
v1::Proxy proxyOf(const NavigationSnapshot& now, const RemoteHand& hand) noexcept;

class ModelMaker {
 public:
  static constexpr std::uint32_t kMostNodes = 512;
  static constexpr std::size_t kMostBytes = v1::kModelHeadBytes + 12 * kMostNodes + 4 * 2 * kMostNodes;
  struct Frame {
    std::array<unsigned char, kMostBytes> bytes;
    std::uint32_t size = 0;
  };

  ModelMaker() : around_(kMostNodes) {}

  // The spring's force about the hand (SpringModel). `radius_um`: of the neighbourhood; 0: none.
  void make(const NavigationSnapshot& now, const RemoteHand& hand, const GraphView& graph, double stiffness_N_m,
            double most_N, double radius_um, Frame& frame) noexcept;

 private:
  NearbyGraph around_;
  SpringModel spring_;
};

}  // namespace filiform::tools
