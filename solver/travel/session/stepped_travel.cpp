#include "solver/travel/session/stepped_travel.h"

#include "device/simulated/null_device.h"
#include "index/errors.h"
#include "solver/graph/graph_view.h"
#include "solver/travel/hand/internal/cell_reaches.h"
#include "solver/travel/hand/internal/hand_navigation.h"
#include "solver/travel/hand/internal/hand_tiles.h"
#include "solver/travel/hand/internal/navigation_choice.h"
#include "solver/travel/hand/internal/travel_device.h"

#include <atomic>
#include <chrono>
#include <cmath>
#include <stop_token>
#include <thread>

namespace filiform {

namespace {

constexpr auto kBetweenLooks = std::chrono::microseconds(200);
constexpr auto kBetweenWatches = std::chrono::milliseconds(5);
constexpr int kMessagesAtOnce = 64;

SteppedTravelOptions withRate(const SteppedTravelOptions& options) {
  if (!(options.rate_Hz > 0 && options.rate_Hz <= 1e6)) throw UsageError("the rate must be between 0 and 1e6 Hz");
  return options;
}

NavigationOptions steppedNavigation(const DeviceCapabilities& can, const SteppedTravelOptions& options) {
  NavigationOptions navigation = internal::chooseNavigation(can, {.held_device = "",
                                                                  .period_s = 1.0 / options.rate_Hz,
                                                                  .zoom_um = options.zoom_um,
                                                                  .stiffness_N_m = options.stiffness_N_m})
                                     .navigation;
  navigation.force.max_force_N = options.max_force_N;
  return navigation;
}

// Holds tiles while it lives.
class TileHold {
 public:
  TileHold(Residency& residency, TileId tile)
      : residency_(residency), id_(residency.hold({&tile, 1}, HoldKind::target)) {}
  ~TileHold() { residency_.release(id_); }
  TileHold(const TileHold&) = delete;
  TileHold& operator=(const TileHold&) = delete;

 private:
  Residency& residency_;
  HoldId id_;
};

}  // namespace

struct SteppedTravel::Impl {
  Impl(const TileStore& scene, const SteppedTravelOptions& wanted)
      : store(scene),
        options(withRate(wanted)),
        device({.name = "caller",
                .period_s = 1.0 / wanted.rate_Hz,
                .make = [](const std::string&, double period_s) { return std::make_unique<NullDevice>(period_s); }}),
        tiles(scene, internal::TileKind::resident, {.budget_bytes = options.budget_bytes.value_or(UINT64_MAX)}),
        reaches(scene, options.method),
        hand(scene, tiles, device, makeProxySolver(options.method, {}),
             steppedNavigation(device.capabilities(), options)) {
    state.status = DeviceStatus::ready;
    if (!options.realtime) return;
    tiles.residency()->start();
    watcher = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        waits_for_failed.store(hand.waitsForFailedTile(), std::memory_order_relaxed);
        std::this_thread::sleep_for(kBetweenWatches);
      }
    });
  }
  ~Impl() {
    watcher = {};
    if (options.realtime) tiles.residency()->stop();
  }

  void bring(TileId tile);

  const TileStore& store;
  SteppedTravelOptions options;
  internal::TravelDevice device;
  internal::HandTiles tiles;
  internal::CellReaches reaches;
  internal::HandNavigation hand;
  DeviceState state;
  NavigationTick none;  // of a tick whose force is withheld
  bool moved = false;   // a tick has told where the hand is
  std::atomic<bool> waits_for_failed{false};
  std::jthread watcher;  // in real time: asks the loader, which takes a lock
};

void SteppedTravel::Impl::bring(TileId tile) {
  if (tiles.table().find(tile) != nullptr) return;
  if (!options.realtime) {
    if (!tiles.loadTogether({&tile, 1})) {
      store.load(tile);  // throws the reason
      throw UsageError("the tile of the place does not fit the budget beside those in use");
    }
    return;
  }
  const TileHold hold(*tiles.residency(), tile);
  while (tiles.table().find(tile) == nullptr) {
    tiles.reader()->apply(kMessagesAtOnce);
    if (tiles.residency()->state(tile) == TileState::failed) store.load(tile);  // throws the reason
    std::this_thread::sleep_for(kBetweenLooks);
  }
  // From the next tick on, the focus keeps the tile.
  ReaderFocus focus = hand.navigation().focus();
  focus.target_tile = tile;
  tiles.reader()->publishFocus(focus);
}

SteppedTravel::SteppedTravel(const TileStore& store, const SteppedTravelOptions& options)
    : impl_(std::make_unique<Impl>(store, options)) {}
SteppedTravel::~SteppedTravel() = default;

void SteppedTravel::jump(TileId tile, SegmentId segment, double t) {
  if (tile >= impl_->store.tile_count()) throw UsageError("the set has no such tile");
  impl_->bring(tile);
  NavigationCommand command;
  command.kind = NavigationCommand::Kind::jump;
  command.place = impl_->hand.graph().placeAt(tile, segment, t);
  if (command.place.valid() && command.place.tile != tile) {  // at a node, the place lies in the node's home
    impl_->bring(command.place.tile);
    command.place = impl_->hand.graph().placeAt(tile, segment, t);
  }
  if (command.place.valid()) command.reach = impl_->reaches.of(segment.cell);
  if (!command.place.valid() || !apply(command)) throw UsageError("the tile does not store the segment, or t is NaN");
}

bool SteppedTravel::apply(const NavigationCommand& command) noexcept {
  return impl_->hand.navigation().apply(command, impl_->state.p_D);
}

const NavigationTick& SteppedTravel::tick(const Vector3d& hand_D, double dt_s) {
  if (!(dt_s > 0 && std::isfinite(dt_s))) throw UsageError("the time step must be > 0 and finite");
  DeviceState& state = impl_->state;
  state.time_s += dt_s;
  state.v_D = impl_->moved && hand_D.allFinite() && state.p_D.allFinite() ? Vector3d((hand_D - state.p_D) / dt_s)
                                                                          : Vector3d::Zero();
  state.p_D = hand_D;
  impl_->moved = true;
  const bool realtime = impl_->options.realtime;
  internal::HandNavigation& hand = impl_->hand;
  if (realtime) impl_->tiles.reader()->apply();
  const NavigationTick* tick = nullptr;
  try {
    tick = realtime ? &hand.tick(state, dt_s) : &hand.tickWithItsTiles(state, dt_s);
  } catch (...) {
    state.sent_N = Vector3d::Zero();  // the caller gets no force
    throw;
  }
  hand.publish(hand.navigation().focus());
  hand.prepare(realtime ? 0 : dt_s);
  if (realtime && tick->frontier && impl_->waits_for_failed.load(std::memory_order_relaxed)) {
    impl_->none = *tick;
    impl_->none.wrench = {};
    tick = &impl_->none;
  }
  state.sent_N = tick->wrench.force_N;
  return *tick;
}

const ProxyPlace& SteppedTravel::place() const noexcept { return impl_->hand.navigation().place(); }
ResidencyCounters SteppedTravel::residency() const { return impl_->tiles.residency()->counters(); }
std::uint64_t SteppedTravel::budget_bytes() const { return impl_->tiles.residency()->budget_bytes(); }

}  // namespace filiform
