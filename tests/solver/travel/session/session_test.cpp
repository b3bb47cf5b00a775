#include "solver/travel/session/session.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/ingest/memory_tiles.h"
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "solver/graph/graph_view.h"
#include "tests/support/devices/paced_device.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"
#include "tests/support/what_of.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

ProxyPlace placeNear(const TileStore& store, const Vector3d& p_W) {
  const NearestResult nearest = Nearest(store).find(p_W).at(0);
  const std::shared_ptr<const Tile> tile = store.load(nearest.tile);
  TileTable table(store.tile_count());
  table.add(*tile);
  return GraphView(table, store.leaves(), store.grid()).placeAt(nearest.tile, nearest.segment, nearest.t);
}

class Sessions : public ::testing::Test {
 protected:
  void SetUp() override {
    CellList stream(test::randomColumn(11, 4, 400, 200));
    store_ = buildTilesInMemory(stream, {.capacity = 64});
  }
  ProxyPlace near(const Vector3d& p_W) const { return placeNear(*store_, p_W); }
  std::unique_ptr<TileStore> store_;
};

TEST_F(Sessions, AJumpPutsThePlaceUnderTheHandAndThePointerPulls) {
  Session session(*store_, {.in_memory = true});
  const ProxyPlace place = near({10, 20, 30});
  session.jump(place);
  session.advance(200);
  EXPECT_EQ(session.update().p_W, place.p_W);
  EXPECT_LT((session.now().h_W - place.p_W).norm(), 1e-6);
  EXPECT_LT(session.now().force_N.norm(), 1e-6);

  session.point(Pointing::at(session.now().p_D + Vector3d(0.02, 0, 0)));
  session.advance(1000);
  session.update();
  EXPECT_GT(session.now().force_N.norm(), 0.05);  // the neurite holds the proxy
  EXPECT_LT(session.now().force_N.norm(), 8.001);
  std::vector<float> forces;
  session.takeForces(forces);
  EXPECT_EQ(forces.size(), 1200u);

  session.point({});
  session.advance(2000);
  EXPECT_LT(session.update().force_N.norm(), 0.02);
}

// At 500 Hz the ramp of half a second takes 250 ticks.
TEST_F(Sessions, TimeGoesByTheDevicesClock) {
  Session session(*store_, {.device = "paced",
                            .stiffness_N_m = {},
                            .in_memory = true,
                            .budget_bytes = {},
                            .record = {},
                            .make_device = [](const std::string&, double) {
                              return std::make_unique<test::PacedDevice>(0.002, Vector3d(0.03, 0.03, 0.03));
                            }});
  session.jump(near({10, 20, 30}), false);
  session.start();
  std::vector<float> forces, more;
  for (int i = 0; i < 20000 && forces.size() < 1000; ++i) {
    session.takeForces(more);
    forces.insert(forces.end(), more.begin(), more.end());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  session.finish();
  const auto pulled = std::find_if(forces.begin(), forces.end(), [](float force_N) { return force_N > 0; });
  ASSERT_GT(forces.end() - pulled, 400);
  EXPECT_LT(pulled[125], 0.6 * pulled[300]);
  EXPECT_NEAR(pulled[260], pulled[300], 1e-3);
}

// While it is pushed, the hand stays in the box of its device: the world moves under it.
TEST_F(Sessions, APushedHandDoesNotLeaveItsDevice) {
  Session session(*store_, {.zoom_um = 20, .stiffness_N_m = {}, .in_memory = true});
  const ProxyPlace place = near({10, 20, 30});
  session.jump(place);
  session.advance(10);
  NavigationCommand free;
  free.kind = NavigationCommand::Kind::free;
  ASSERT_TRUE(session.send(free));
  const Vector3d begin_W = session.update().centre_W;
  session.point(Pointing::push({0.02, 0, 0}));
  double farthest_m = 0;
  for (int i = 0; i < 60; ++i) {
    session.advance(50);
    farthest_m = std::max(farthest_m, session.update().h_D.cwiseAbs().maxCoeff());
  }
  EXPECT_LT(farthest_m, 0.07);  // it overshoots its target at the edge, 0.06
  EXPECT_GT(farthest_m, 0.05);
  EXPECT_GT(session.now().centre_W.x() - begin_W.x(), 20);
}

TEST_F(Sessions, FreeThenConstrainedAgain) {
  Session session(*store_, {.in_memory = true});
  session.jump(near({0, 0, 0}));
  session.advance(10);
  NavigationCommand free;
  free.kind = NavigationCommand::Kind::free;
  ASSERT_TRUE(session.send(free));
  session.point(Pointing::at({0.03, 0.02, 0.01}));
  session.advance(2000);
  session.update();
  EXPECT_EQ(session.now().mode, NavigationMode::free);
  EXPECT_EQ(session.now().force_N.norm(), 0);
  EXPECT_LT((session.now().h_D - Vector3d(0.03, 0.02, 0.01)).norm(), 1e-3);
  const ProxyPlace back = near(session.now().p_W);
  session.jump(back, false);
  session.advance(1);
  EXPECT_EQ(session.update().mode, NavigationMode::constrained);
}

// In memory, and in a replay of the recording.
TEST_F(Sessions, TheReachIsThatOfTheProxysCell) {
  const test::TempFolder folder;
  const std::vector<Cell> cells = test::fineAndCoarse();
  const auto both = test::storeOf(cells), coarse = test::storeOf({cells[1]});
  const auto path = [](Session& session) {
    std::vector<Vector3d> places;
    for (int i = 0; i < 300; ++i) {
      const double turn = 0.02 * i;
      session.point(Pointing::at(0.05 * Vector3d(1 - std::cos(turn), std::sin(2 * turn), std::sin(turn))));
      session.advance(10);
      places.push_back(session.update().p_W);
    }
    return places;
  };
  const SessionOptions options{.method = SolverMethod::force, .zoom_um = 1000, .in_memory = true};
  std::vector<Vector3d> travelled;
  {
    SessionOptions recorded = options;
    recorded.record = folder / "a.rec";
    Session session(*both, recorded);
    session.jump(placeNear(*both, {0, 0, 0}));
    session.advance(10);
    session.jump(placeNear(*both, test::kCoarse_W));
    travelled = path(session);
    session.finish();
  }
  Session only(*coarse, options);
  only.advance(10);
  only.jump(placeNear(*coarse, test::kCoarse_W));
  EXPECT_EQ(travelled, path(only));
  SessionOptions basic = options;
  basic.method = SolverMethod::basic;
  Session without(*coarse, basic);
  without.advance(10);
  without.jump(placeNear(*coarse, test::kCoarse_W));
  EXPECT_NE(travelled, path(without)) << "the reach takes no part";
  Session replay(*both, {.device = "replay:" + folder / "a.rec", .in_memory = true});
  replay.advance(3010);
  EXPECT_EQ(replay.update().p_W, travelled.back());
}

// The same states, bit for bit, from the recording alone.
TEST_F(Sessions, AReplayGoesThroughTheSameStates) {
  const test::TempFolder folder;
  const std::string file = folder / "travel.rec";
  std::vector<NavigationSnapshot> seen;
  {
    Session session(*store_,
                    {.zoom_um = 150, .stiffness_N_m = {}, .in_memory = true, .budget_bytes = {}, .record = file});
    const auto go = [&](std::uint64_t ticks) {
      session.advance(ticks);
      seen.push_back(session.update());
    };
    session.jump(near({5, 5, 5}));
    go(50);
    session.point(Pointing::push({0.006, 0.002, 0}));
    go(700);
    NavigationCommand command;
    command.kind = NavigationCommand::Kind::rotate;
    command.about_y_rad = 0.37;
    session.send(command);
    command.kind = NavigationCommand::Kind::zoom;
    command.factor = 0.6;
    session.send(command);
    session.point(Pointing::at({-0.03, 0.04, 0.02}));
    go(600);
    session.jump(near({-40, 60, 0}));
    go(333);
    session.finish();
  }
  Session replay(*store_, {.device = "replay:" + file, .in_memory = true});
  std::uint64_t ticks = 0;
  for (const NavigationSnapshot& expected : seen) {
    replay.advance(expected.tick - ticks);
    ticks = expected.tick;
    const NavigationSnapshot& got = replay.update();
    ASSERT_EQ(got.tick, expected.tick);
    EXPECT_EQ(got.p_W, expected.p_W);
    EXPECT_EQ(got.h_W, expected.h_W);
    EXPECT_EQ(got.force_N, expected.force_N);
    EXPECT_EQ(got.place.segment, expected.place.segment);
    EXPECT_EQ(got.place.t, expected.place.t);
    EXPECT_EQ(got.zoom_um, expected.zoom_um);
    EXPECT_EQ(got.centre_W, expected.centre_W);
    EXPECT_EQ(got.rotation_WD.coeffs(), expected.rotation_WD.coeffs());
  }
  EXPECT_FALSE(replay.replayEnded());
  replay.jump(near({0, 0, 0}));  // replaying: jumps are ignored
  replay.advance(10);
  EXPECT_TRUE(replay.replayEnded());
  EXPECT_EQ(replay.update().p_W, seen.back().p_W);
}

// A device whose stylus turns, with its clutch held now and then.
class TurningDevice : public HapticDevice {
 public:
  TurningDevice() {
    capabilities_.name = "turning";
    capabilities_.buttons = 2;
    capabilities_.senses_orientation = true;
  }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return state_.status; }
  void open() override { state_.status = DeviceStatus::ready; }
  void close() noexcept override { state_.status = DeviceStatus::closed; }
  DeviceState exchange(const Wrench& wrench) noexcept override {
    ++exchanges_;
    state_.time_s = 0.001 * exchanges_;
    state_.orientation_D = Eigen::Quaterniond(Eigen::AngleAxisd(0.001 * exchanges_, Vector3d(1, 2, 3).normalized()));
    state_.buttons = exchanges_ < 150 || (exchanges_ >= 240 && exchanges_ < 290) ? 0U : 2U;
    state_.sent_N = wrench.force_N;
    return state_;
  }

 private:
  DeviceCapabilities capabilities_;
  DeviceState state_;
  int exchanges_ = 0;
};

void expectReplayWithButtons(const TileStore& store, const std::string& map) {
  const test::TempFolder folder;
  const std::string file = folder / "turns.rec";
  std::vector<NavigationSnapshot> seen;
  {
    Session session(store,
                    {.device = "turning",
                     .stiffness_N_m = {},
                     .buttons = [&map](const DeviceCapabilities&) { return parseButtons(map); },
                     .in_memory = true,
                     .budget_bytes = {},
                     .record = file,
                     .make_device = [](const std::string&, double) { return std::make_unique<TurningDevice>(); }});
    session.jump(placeNear(store, {5, 5, 5}));
    for (int i = 0; i < 10; ++i) {
      session.advance(77);
      seen.push_back(session.update());
    }
    session.finish();
  }
  const NavigationSnapshot &first = seen.front(), &last = seen.back();
  EXPECT_EQ(last.rotation_WD.angularDistance(first.rotation_WD) > 0.05, map.find("turn") != std::string::npos) << map;
  EXPECT_EQ(last.zoom_um != first.zoom_um, map == "1=mode-turn" || map == "1=zoom") << map;
  Session replay(store, {.device = "replay:" + file, .in_memory = true});
  std::uint64_t ticks = 0;
  for (const NavigationSnapshot& expected : seen) {
    replay.advance(expected.tick - ticks);
    ticks = expected.tick;
    const NavigationSnapshot& got = replay.update();
    EXPECT_TRUE(got.has_stylus);
    EXPECT_EQ(got.stylus_D.coeffs(), expected.stylus_D.coeffs());
    EXPECT_EQ(got.rotation_WD.coeffs(), expected.rotation_WD.coeffs());
    EXPECT_EQ(got.p_W, expected.p_W);
    EXPECT_EQ(got.h_W, expected.h_W) << map;
    EXPECT_EQ(got.zoom_um, expected.zoom_um) << map;
  }
}

TEST_F(Sessions, TurnsOfTheStylusAreReplayedToTheBit) {
  for (const char* const map : {"1=turn", "1=turn-moving", "1=mode-turn", "0=mode,1=carry", "1=zoom"})
    expectReplayWithButtons(*store_, map);
}

TEST_F(Sessions, ButtonsThatTheDeviceLacksAreRefused) {
  SessionOptions options{.device = "turning", .in_memory = true};
  options.make_device = [](const std::string&, double) { return std::make_unique<TurningDevice>(); };
  options.buttons = [](const DeviceCapabilities&) { return parseButtons("5=turn"); };
  EXPECT_EQ(test::whatOf<UsageError>([&] { const Session session(*store_, options); }),
            "button 5=turn: turning has 2 buttons, 0 to 1; change --buttons, or run filiform devices --setup");
}

TEST_F(Sessions, ARecordingThatDoesNotFitIsRefused) {
  const test::TempFolder folder;
  {
    Session session(*store_, {.in_memory = true, .budget_bytes = {}, .record = folder / "a.rec"});
    session.jump(near({5, 5, 5}));
    session.advance(20);
    session.finish();
  }
  test::writeBytes(folder / "b.rec", test::readBytes(folder / "a.rec"));
  EXPECT_THROW(Session(*store_, {.device = "replay:" + folder / "b.rec", .in_memory = true}), IoError);
  test::writeBytes(folder / "b.rec.json", "{\"zoom_um\": 1");
  EXPECT_THROW(Session(*store_, {.device = "replay:" + folder / "b.rec", .in_memory = true}), InputError);
}

TEST_F(Sessions, CommandsWithNumbersOutOfRangeAreRefused) {
  const test::TempFolder folder;
  {
    Session session(*store_, {.in_memory = true, .budget_bytes = {}, .record = folder / "a.rec"});
    session.advance(10);
    session.finish();
  }
  const std::string good = test::readBytes(folder / "a.rec.json");
  for (const std::string& command : {std::string(R"({"tick":-5e20,"kind":0})"), std::string(R"({"tick":1.5,"kind":0})"),
                                     std::string(R"({"tick":3,"kind":4294967296})")}) {
    const std::size_t list = good.find('[', good.find("\"commands\""));
    std::string bad = good;
    test::writeBytes(folder / "a.rec.json", bad.replace(list, good.rfind(']') + 1 - list, "[" + command + "]"));
    EXPECT_THROW(Session(*store_, {.device = "replay:" + folder / "a.rec", .in_memory = true}), InputError) << command;
  }
}

// With threads and tiles from the disk, and a replay of the recording.
TEST_F(Sessions, InRealTimeAJumpWaitsForItsTile) {
  const test::TempFolder folder;
  CellList stream(test::randomColumn(11, 4, 400, 200));
  ingest(stream, folder / "a.fil", {});
  const auto set = TileSet::open(folder / "a.fil");
  const auto wait = [](Session& session, const auto& done) {
    for (int i = 0; i < 4000 && !done(session.update()); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_TRUE(done(session.update()));
    EXPECT_EQ(session.fault(), "");
  };
  for (const SolverMethod method : {SolverMethod::climb, SolverMethod::force}) {
    NavigationSnapshot last;
    const std::string file = folder / (std::string(toString(method)) + ".rec");
    {
      Session session(*set, {.method = method, .budget_bytes = Residency::floorBytes(*set) * 2, .record = file});
      session.start();
      for (const Vector3d& p_W : {Vector3d(20, -30, 0), Vector3d(-60, 90, 10)}) {
        const ProxyPlace place = placeNear(*set, p_W);
        session.jump(place);
        wait(session, [&](const NavigationSnapshot& s) { return !session.awaited() && s.p_W == place.p_W; });
      }
      session.point(Pointing::push({0.005, 0, 0}));
      const std::uint64_t until = session.now().tick + 300;
      wait(session, [&](const NavigationSnapshot& s) { return s.tick >= until; });
      session.finish();
      last = session.now();
      ASSERT_NE(session.metrics(), nullptr);
    }
    Session replay(*set, {.device = "replay:" + file});
    replay.advance(1U << 20);
    EXPECT_TRUE(replay.replayEnded());
    EXPECT_EQ(replay.update().tick, last.tick);
    EXPECT_EQ(replay.now().p_W, last.p_W);
    EXPECT_EQ(replay.now().centre_W, last.centre_W);
  }
}

// A tile fails its checksum while the scene is open.
TEST_F(Sessions, ADamagedTileIsReportedAndTheTravelContinues) {
  test::CountingStore damaged(*store_);
  const ProxyPlace here = near({20, -30, 0});
  ProxyPlace there;
  for (double y = 0; y < 400 && (!there.valid() || there.tile == here.tile); y += 10) there = near({-60, y, 10});
  ASSERT_NE(there.tile, here.tile);
  damaged.failLoads(there.tile);
  Session session(damaged, {});
  session.start();
  const auto wait = [&](const auto& done) {
    for (int i = 0; i < 4000 && !done(session.update()); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return done(session.update());
  };
  session.jump(here);
  ASSERT_TRUE(wait([&](const NavigationSnapshot& s) { return s.p_W == here.p_W; }));
  session.jump(there);
  std::vector<std::string> notes;
  EXPECT_TRUE(wait([&](const NavigationSnapshot&) {
    for (std::string& note : session.takeNotes()) notes.push_back(std::move(note));
    return !session.awaited();
  }));
  ASSERT_FALSE(notes.empty());
  EXPECT_EQ(notes.back(), "no jump: tile " + std::to_string(there.tile) + " cannot be read");
  EXPECT_EQ(session.update().p_W, here.p_W);
  EXPECT_EQ(session.fault(), "");
  const std::uint64_t until = session.now().tick + 100;
  EXPECT_TRUE(wait([&](const NavigationSnapshot& s) { return s.tick >= until; }));
  session.finish();
}

// The reach of a force-based method needs all tiles of the cell.
TEST_F(Sessions, ACellWhoseReachCannotBeReadIsReportedAndTheTravelContinues) {
  const std::vector<Cell> cells = test::fineAndCoarse();
  const auto both = test::storeOf(cells);
  const ProxyPlace here = placeNear(*both, test::kCoarse_W), there = placeNear(*both, {0, 0, 0});
  TileId other = there.tile;
  for (const TileId tile : both->cellTiles(there.segment.cell))
    if (tile != there.tile) other = tile;
  ASSERT_NE(other, there.tile);
  test::CountingStore damaged(*both);
  damaged.failLoads(other);
  Session session(damaged, {.method = SolverMethod::force});
  session.start();
  const auto wait = [&](const auto& done) {
    for (int i = 0; i < 4000 && !done(session.update()); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return done(session.update());
  };
  session.jump(there);
  session.jump(here);  // replaces the jump whose cell is being read
  ASSERT_TRUE(wait([&](const NavigationSnapshot& s) { return s.p_W == here.p_W; }));
  session.jump(there);
  EXPECT_TRUE(wait([&](const NavigationSnapshot& s) { return s.place.segment.cell == there.segment.cell; }));
  const std::vector<std::string> notes = session.takeNotes();
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_TRUE(notes[0].starts_with("the method keeps the reach of the last cell: ")) << notes[0];
  session.jump(here, false);
  EXPECT_TRUE(wait([&](const NavigationSnapshot&) { return !session.awaited(); }));
  session.finish();
}

}  // namespace
}  // namespace filiform
