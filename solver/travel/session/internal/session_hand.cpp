#include "solver/travel/session/internal/session_hand.h"

#include <utility>

namespace filiform::internal {

SessionHand::SessionHand(TravelDevice& device, HandTiles& tiles, HandNavigation& travel, SessionChannels& channels,
                         SimulatedHand* hand, const WorkspaceOptions& workspace, std::vector<SessionCommand> replayed)
    : device_(device),
      tiles_(tiles),
      travel_(travel),
      channels_(channels),
      hand_(hand),
      lo_D_(workspace.lo_D),
      hi_D_(workspace.hi_D),
      replayed_(std::move(replayed)),
      p_D_(0.5 * (workspace.lo_D + workspace.hi_D)) {}

Wrench SessionHand::tick(const DeviceState& state, double step_s) {
  pull();
  if (TileReader* const reader = tiles_.reader()) reader->apply();
  applyCommands(state.p_D);
  const NavigationTick& ticked =
      device_.replay() != nullptr ? travel_.tickAsRecorded(state, step_s) : travel_.tick(state, step_s);
  p_D_ = ticked.mode == NavigationMode::free ? ticked.h_D : ticked.p_D;
  travel_.publish(travel_.navigation().focus());
  travel_.navigation().fill(snapshot_);
  channels_.link.snapshots.publish(snapshot_);
  channels_.forces.push(static_cast<float>(ticked.wrench.force_N.norm()));
  return ticked.wrench;
}

Wrench SessionHand::virtualTick(const DeviceState& state, double period_s) {
  const double step_s = device_.virtualStep_s(state, period_s);
  return device_.wasTicked() ? tick(state, step_s) : Wrench{};
}

void SessionHand::pull() noexcept {
  if (hand_ == nullptr) return;
  Pointing newer;
  if (channels_.pointings.take(newer)) pointing_ = newer;
  Vector3d target_D = p_D_;
  if (pointing_.kind == Pointing::Kind::at) target_D = pointing_.target_D;
  if (pointing_.kind == Pointing::Kind::push) target_D += pointing_.target_D;
  hand_->setTarget(target_D.cwiseMax(lo_D_).cwiseMin(hi_D_));
}

void SessionHand::applyCommands(const Vector3d& h_D) noexcept {
  Navigation& navigation = travel_.navigation();
  if (device_.replay() != nullptr) {
    while (next_replayed_ < replayed_.size() && replayed_[next_replayed_].tick <= navigation.ticks())
      navigation.apply(replayed_[next_replayed_++].command, h_D);
    return;
  }
  NavigationCommand command;
  while (channels_.link.commands.pop(command)) {
    if (device_.recorder() != nullptr && !channels_.log.push({navigation.ticks(), command}))
      channels_.log_lost.fetch_add(1, std::memory_order_relaxed);
    navigation.apply(command, h_D);
  }
}

}  // namespace filiform::internal
