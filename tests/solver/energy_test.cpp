// The energy that the hand receives, whatever acts between the force law and the device.
#include "device/haptic_device.h"
#include "solver/graph/graph_view.h"
#include "solver/loop/haptic_loop.h"
#include "solver/workspace/navigation.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tools/lab/reference/energy_sweep.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Eigen::Vector3d;

// A neurite so short that it is a point, and a navigation that pulls the hand to it.
struct PointScene {
  explicit PointScene(const NavigationOptions& options) {
    Cell cell;
    const std::uint32_t root = test::addSample(cell, {0, 0, 0});
    test::addSample(cell, {0, 0, 0.5}, root);
    store = test::storeOf({cell}, 16);
    table = std::make_unique<TileTable>(store->tile_count());
    for (TileId id = 0; id < store->tile_count(); ++id) {
      held.push_back(store->load(id));
      table->add(*held.back());
    }
    graph = std::make_unique<GraphView>(*table, store->leaves(), store->grid());
    navigation = std::make_unique<Navigation>(*graph, makeProxySolver(SolverMethod::climb, {}), options);
    NavigationCommand jump;
    jump.kind = NavigationCommand::Kind::jump;
    jump.place = graph->placeAt(0, held[0]->segmentId(0), 0.5);
    navigation->apply(jump, Vector3d::Zero());
  }

  std::unique_ptr<TileStore> store;
  std::vector<std::shared_ptr<const Tile>> held;
  std::unique_ptr<TileTable> table;
  std::unique_ptr<GraphView> graph;
  std::unique_ptr<Navigation> navigation;
};

// A hand with a prescribed motion. It sums the energy that it receives: force times distance, each force constant until
// the next.
class LedHand : public HapticDevice {
 public:
  // The hand's position (m along x) after exchange number `exchange`. Called on the haptic thread.
  std::function<double(int exchange)> moves;

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return DeviceStatus::ready; }
  void open() override {}
  void close() noexcept override {}
  DeviceState exchange(const Wrench& wrench) noexcept override {
    DeviceState state;
    const int now = exchanges.fetch_add(1) + 1;
    state.time_s = 0.001 * now;
    state.p_D.x() = moves(now);
    given_J = given_J + held_N_ * (state.p_D.x() - x_);
    most_given_J = std::max<double>(most_given_J, given_J);
    x_ = state.p_D.x();
    held_N_ = wrench.force_N.x();
    state.status = DeviceStatus::ready;
    return state;
  }

  std::atomic<int> exchanges{0};
  std::atomic<double> given_J{0}, most_given_J{0};

 private:
  DeviceCapabilities capabilities_;
  double x_ = 0, held_N_ = 0;
};

// The hand moves 4 cm away while no force is sent, and back after the force has grown again. The spring then stores 160
// mJ that the hand has not put in.
TEST(Energy, AHandThatIsLedAwayWithoutForceIsNotGivenTheSpringsEnergy) {
  NavigationOptions options;
  options.force.passivity.on = true;
  options.force.passivity.delay_samples = 1;
  PointScene scene(options);
  LedHand hand;
  HapticLoopOptions loop_options;
  loop_options.realtime_priority = loop_options.lock_memory = false;
  loop_options.stall_s = 0;
  loop_options.ramp_at_start = false;
  HapticLoop loop(
      hand, [&](const DeviceState& state, double dt_s) { return scene.navigation->tick(state, dt_s).wrench; },
      loop_options);
  constexpr double kFar_m = 0.04;
  hand.moves = [&](int now) {
    if (now == 50) loop.withhold(true);
    if (now == 600) loop.withhold(false);
    if (now < 100) return 0.0;
    if (now < 500) return kFar_m * (now - 100) / 400;
    if (now < 1500) return kFar_m;
    return kFar_m * std::max(0.0, 1 - (now - 1500) / 400.0);
  };
  loop.start();
  for (int i = 0; i < 20000 && hand.exchanges < 2000; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  loop.stop();
  ASSERT_GE(hand.exchanges, 2000);
  EXPECT_GT(scene.navigation->ticks(), 1900u);
  const PassivityOptions& passivity = options.force.passivity;
  const double bound_J = passivity.energy_J + 2.0 * passivity.power_W + 2 * 8 * kFar_m / 400;
  EXPECT_LE(hand.most_given_J, bound_J);
}

// The whole path from tick to motors, with all interruptions. `filiform bench stability` runs a longer form, as one row
// of its table.
TEST(Energy, TheWholeLoopGivesNoMoreThanTheBound) {
  const tools::EnergySweep sweep = tools::energySweep(1, 40, 4);
  EXPECT_EQ(sweep.beyond_J, 0) << "seed " << sweep.worst;
  EXPECT_GT(sweep.stalls, 100u);
  EXPECT_GT(sweep.stale, 100u);
  EXPECT_GT(sweep.withheld, 50u);
  EXPECT_GT(sweep.commands, 50u);
  EXPECT_GT(sweep.most_given_J, 1e-3);
}

TEST(Energy, WithoutTheForceThatWasReallySentTheBoundIsBroken) {
  EXPECT_GT(tools::energySweep(1, 40, 4, false).beyond_J, 0.005);
}

}  // namespace
}  // namespace filiform
