#include "solver/travel/session/internal/awaited_jump.h"

namespace filiform::internal {

namespace {

constexpr std::uint64_t kHeldTicks = 100;  // after the jump was sent; then the hand's own focus keeps the tile

}  // namespace

void AwaitedJump::ask(const ProxyPlace& place, bool under_hand, Residency* residency) {
  if (hold_ && residency != nullptr) residency->release(*hold_);
  hold_.reset();
  place_ = place;
  under_hand_ = under_hand;
}

void AwaitedJump::cancel(Residency* residency) {
  if (hold_ && residency != nullptr) residency->release(*hold_);
  hold_.reset();
  place_.reset();
}

bool AwaitedJump::send(SpscRing<NavigationCommand>& commands) {
  NavigationCommand command;
  command.kind = under_hand_ ? NavigationCommand::Kind::jump : NavigationCommand::Kind::constrain;
  command.place = *place_;
  if (!commands.push(command)) return false;
  place_.reset();
  return true;
}

std::optional<std::string> AwaitedJump::serve(std::uint64_t tick, SpscRing<NavigationCommand>& commands,
                                              Residency* residency) {
  if (residency == nullptr) {
    if (place_) send(commands);
    return std::nullopt;
  }
  std::optional<std::string> note;
  if (place_ && !hold_) hold_ = residency->hold({&place_->tile, 1}, HoldKind::target);
  if (place_ && residency->state(place_->tile) == TileState::failed) {
    note = "no jump: tile " + std::to_string(place_->tile) + " cannot be read";
    place_.reset();
    release_at_ = 0;
  } else if (place_ && residency->isHeld(*hold_) && send(commands)) {
    release_at_ = tick + kHeldTicks;
  }
  if (hold_ && !place_ && tick >= release_at_) {
    residency->release(*hold_);
    hold_.reset();
  }
  return note;
}

}  // namespace filiform::internal
