// The hand of a session, on the thread that ticks: the pointer pulls it, commands come from the commanding thread or
// from the recording, and each tick publishes its result. Thread rule: the ticking thread; for the channels, see each.
#pragma once

#include "index/spsc_ring.h"
#include "index/triple_buffer.h"
#include "solver/travel/hand/internal/hand_navigation.h"
#include "solver/travel/session/internal/session_commands.h"
#include "solver/travel/session/pointing.h"
#include "solver/workspace/navigation_link.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform::internal {

// The channels between the commanding and the ticking thread.
struct SessionChannels {
  explicit SessionChannels(std::size_t log_capacity) : log(log_capacity) {}
  NavigationLink link;
  TripleBuffer<Pointing> pointings;  // to the ticking thread
  SpscRing<float> forces{8192};      // to the commanding thread: magnitude (N) in each tick; if full, it is left out
  SpscRing<SessionCommand> log;      // to the commanding thread: applied commands, for the recording
  std::atomic<std::uint64_t> log_lost{0};
};

class SessionHand {
 public:
  // All references must outlive the object. `hand`: the hand that the pointer moves; nullptr: none. `workspace`: the
  // hand stays in its box. `replayed`: the commands of a replay.
  SessionHand(TravelDevice& device, HandTiles& tiles, HandNavigation& travel, SessionChannels& channels,
              SimulatedHand* hand, const WorkspaceOptions& workspace, std::vector<SessionCommand> replayed);

  // One tick. Haptic-safe, except in a replay, which reads tiles and throws CorruptTile and IoError.
  Wrench tick(const DeviceState& state, double step_s);
  // One tick in virtual time. In a replay: zero force and no tick if the recorded run computed no tick.
  Wrench virtualTick(const DeviceState& state, double period_s);
  const NavigationSnapshot& snapshot() const noexcept { return snapshot_; }  // of the last tick

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
