#include "solver/travel/session/internal/awaited_jump.h"

namespace filiform::internal {

namespace {

constexpr std::uint64_t kHeldTicks = 100;  // after the jump was sent; then the hand's own focus keeps the tile

}  // namespace

void AwaitedJump::ask(const ProxyPlace& place, bool under_hand, Residency* residency) {
  cancel(residency);
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
  if (unknown_ != place_->segment.cell) command.reach = reaches_.of(place_->segment.cell);
  if (!commands.push(command)) return false;
  place_.reset();
  return true;
}

// Reads the place's cell on another thread if its reach is not known. Returns false once it is known, or cannot be.
bool AwaitedJump::findsReach() {
  if (worker_ && !worker_->idle()) return true;
  if (unknown_ == place_->segment.cell || reaches_.knows(place_->segment.cell)) return false;
  if (!worker_) worker_ = std::make_unique<Worker>();
  searched_ = place_->segment.cell;
  worker_->ask([this, cell = searched_]() -> Worker::Done {
    reaches_.of(cell, &stops_);
    return {};
  });
  return true;
}

std::string AwaitedJump::drop(const std::string& why) {
  place_.reset();
  release_at_ = 0;
  return "no jump: " + why;
}

std::optional<std::string> AwaitedJump::serve(std::uint64_t tick, SpscRing<NavigationCommand>& commands,
                                              Residency* residency) {
  if (residency == nullptr) {
    if (place_) send(commands);
    return std::nullopt;
  }
  std::optional<std::string> note;
  if (worker_)
    worker_->serve([&](const std::string& why) {
      unknown_ = searched_;
      why_ = why;
    });
  if (place_ && !hold_) hold_ = residency->hold({&place_->tile, 1}, HoldKind::target);
  if (place_ && residency->state(place_->tile) == TileState::failed)
    note = drop("tile " + std::to_string(place_->tile) + " cannot be read");
  else if (place_ && !findsReach() && residency->isHeld(*hold_)) {
    const bool is_unknown = place_->segment.cell == unknown_;
    if (send(commands)) {
      release_at_ = tick + kHeldTicks;
      if (is_unknown) note = "the method keeps the reach of the last cell: " + why_;
    }
  }
  if (hold_ && !place_ && tick >= release_at_) {
    residency->release(*hold_);
    hold_.reset();
  }
  return note;
}

}  // namespace filiform::internal
