// The hand of a session, on the thread that ticks: the pointer pulls it, commands from the other thread (or from the
// recording) reach it, and each tick tells what it did. Thread rule: the ticking thread; the channels as they say.
#pragma once

#include "index/spsc_ring.h"
#include "index/triple_buffer.h"
#include "solver/travel/internal/hand_navigation.h"
#include "solver/travel/internal/session_commands.h"
#include "solver/travel/session.h"
#include "solver/workspace/navigation_link.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform::internal {

// Between the commanding and the ticking thread.
struct SessionChannels {
  NavigationLink link;
  TripleBuffer<Pointing> pointings;    // to the ticking thread
  SpscRing<float> forces{8192};        // magnitudes (N) of each tick; when full, later ones are left out
  SpscRing<SessionCommand> log{4096};  // commands that were applied, for the recording
  std::atomic<std::uint64_t> log_lost{0};
};

class SessionHand {
 public:
  // All must outlive it. `hand`: the hand that the pointer moves; nullptr: none. `workspace`: the hand stays in its
  // box. `replayed`: the commands of a replay.
  SessionHand(TravelDevice& device, HandTiles& tiles, HandNavigation& travel, SessionChannels& channels,
              SimulatedHand* hand, const WorkspaceOptions& workspace, std::vector<SessionCommand> replayed);

  // One tick. Haptic-safe, but in a replay reads tiles and throws CorruptTile and IoError.
  Wrench tick(const DeviceState& state, double step_s);
  // One tick in virtual time. In a replay: zero force, and no tick, where the recorded run computed nothing.
  Wrench virtualTick(const DeviceState& state, double period_s);

 private:
  void pull() noexcept;
  void applyCommands(const Vector3d& h_D) noexcept;

  TravelDevice& device_;
  HandTiles& tiles_;
  HandNavigation& travel_;
  SessionChannels& channels_;
  SimulatedHand* hand_;
  Vector3d lo_D_, hi_D_;  // the box of the device
  std::vector<SessionCommand> replayed_;
  std::size_t next_replayed_ = 0;
  Pointing pointing_;
  Vector3d p_D_;  // the proxy after the last tick; in free mode the hand
  NavigationSnapshot snapshot_;
};

}  // namespace filiform::internal
