// A session that the test ticks itself: force, silence, stalls, and replays to the bit.
#include "tools/serve/session/remote_session.h"

#include "solver/force/force_law.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/servers/served_sets.h"
#include "tests/support/temp_folder.h"
#include "tools/serve/session/session_replay.h"

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <thread>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

constexpr double kDt_s = RemoteHand::kPeriod_s;

class RemoteSessions : public ::testing::Test {
 protected:
  std::unique_ptr<RemoteSession> begin(const std::string& set, RemoteSessionOptions options = {}) {
    scene_ =
        std::make_shared<SharedScene>(sets_.shelf->find(set), std::uint64_t{16} << 20, std::vector<Ticker*>{&ticker_});
    return std::make_unique<RemoteSession>(scene_, options);
  }
  // Places the proxy, and ticks until it is there and its tile too.
  void arrive(RemoteSession& session, const Vector3d& p_W) {
    const auto found = scene_->places().nearest(p_W);
    ASSERT_TRUE(found);
    session.jump(found->place, true);
    for (int i = 0; i < 20000; ++i) {
      push(session, {0, 0, 0});
      tick(session);
      if (session.now().place.valid() && !session.now().frontier) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    FAIL() << "the tile of the place does not come";
  }
  void push(RemoteSession& session, const Vector3d& h_D) {
    v1::Hand hand;
    hand.seq = ++seq_;
    for (int i = 0; i < 3; ++i) hand.h_D[i] = h_D[i];
    session.receive(hand);
  }
  void tick(RemoteSession& session, std::uint64_t periods = 1) {
    period_ += periods;
    scene_->tiles(0).reader->apply(32);
    session.tick(period_);
    session.afterAll(0.0005);
    session.serve();
  }
  Vector3d force_N(RemoteSession& session) { return session.now().force_N; }

  const test::ServedSets sets_;
  Ticker ticker_{[] {}};
  std::shared_ptr<SharedScene> scene_;
  std::uint64_t period_ = 0;
  std::uint32_t seq_ = 0;
};

TEST_F(RemoteSessions, TheForcePullsTheHandBackToTheNeurite) {
  const auto session = begin("fork");
  arrive(*session, {5, 0, 0});
  for (int i = 1; i <= 1000; ++i) {
    push(*session, {0, 0, 0.00001 * i});
    tick(*session);
  }
  EXPECT_LT(force_N(*session).z(), -0.5);
  v1::Proxy proxy;
  std::uint32_t hand = 0;
  while (session->takeProxy(proxy)) hand = proxy.hand;
  EXPECT_GT(hand, 0u);
}

// Bounds 1 and 2 of solver/FORCES.md, whatever the client sends: jumps of metres, values that are not finite, silence,
// stalls of the server.
TEST_F(RemoteSessions, TheForceIsBoundedWhateverTheClientSends) {
  const auto session = begin("column");
  arrive(*session, {0, 0, 0});
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> near(-0.06, 0.06), far(-9, 9);
  const ForceLawOptions law;
  const double stiffness_N_m = session->stiffness_N_m();
  Vector3d last_N = force_N(*session), h_D = Vector3d::Zero(), last_h_D = session->now().h_D;
  double strongest_N = 0;
  for (int i = 0; i < 6000; ++i) {
    const std::uint64_t kind = random() % 40;
    if (kind == 0) h_D = Vector3d(far(random), far(random), far(random));
    if (kind == 1) h_D = Vector3d(near(random), std::nan(""), near(random));
    if (kind == 2) h_D = Vector3d::Constant(std::numeric_limits<double>::infinity());
    if (kind == 3) h_D = Vector3d(near(random), near(random), near(random));
    const bool silent = i % 1000 > 700;
    if (!silent && i % 10 == 0) push(*session, h_D);
    const std::uint64_t periods = random() % 200 == 0 ? 1 + random() % 3000 : 1;
    tick(*session, periods);
    const NavigationSnapshot now = session->now();
    ASSERT_TRUE(now.force_N.allFinite());
    ASSERT_LE(now.force_N.norm(), law.max_force_N + 1e-9);
    const double dt_s = std::min(0.010, kDt_s * static_cast<double>(periods));
    const double step_m = (now.h_D - last_h_D).norm();
    const double allowed_N = (law.max_slew_N_s + law.max_force_N / law.ramp_s) * dt_s +
                             stiffness_N_m * std::min(step_m, law.free_speed_m_s * dt_s) + 1e-9;
    ASSERT_LE(now.force_N.norm(), last_N.norm() + allowed_N) << "tick " << i;
    last_N = now.force_N;
    last_h_D = now.h_D;
    strongest_N = std::max(strongest_N, last_N.norm());
    if (silent && i % 1000 > 810) {
      ASSERT_EQ(last_N.norm(), 0) << "tick " << i;
    }
  }
  EXPECT_GT(strongest_N, 0.5);
  EXPECT_GT(session->refusedHands(), 10u);
}

// The model is a spring that cannot give energy: symmetric, no negative eigenvalue, no stiffer than the session.
TEST_F(RemoteSessions, TheLocalModelIsASpring) {
  const auto session = begin("column");
  arrive(*session, {0, 0, 0});
  session->subscribe({.proxy_Hz = 0, .model_Hz = 100, .radius_um = 40});
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> step(-0.0005, 0.0005);
  Vector3d h_D = Vector3d::Zero();
  ModelMaker::Frame frame;
  int models = 0, waiting = 0, with_nodes = 0;
  for (int i = 0; i < 3000; ++i) {
    h_D += Vector3d(step(random), step(random), step(random));
    h_D = h_D.cwiseMax(-0.05).cwiseMin(0.05);
    push(*session, h_D);
    tick(*session);
    if (!session->takeModel(frame)) continue;
    v1::ModelHead model;
    ASSERT_TRUE(v1::decode(frame.bytes.data(), frame.size, model));
    ++models;
    const bool has_nodes = model.nodes >= 2 && model.links >= 1;
    with_nodes += has_nodes;
    waiting += !has_nodes && session->now().frontier;  // for the tile of the place
    const float* const k = model.stiffness_N_m;
    Eigen::Matrix3d stiffness;
    stiffness << k[0], k[1], k[2], k[1], k[3], k[4], k[2], k[4], k[5];
    const Eigen::Vector3d values = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(stiffness).eigenvalues();
    ASSERT_GT(values.minCoeff(), -1e-3);
    ASSERT_LT(values.maxCoeff(), session->stiffness_N_m() * 1.0001);
    ASSERT_GT(model.radius_m, 0);
  }
  EXPECT_GT(models, 200);
  EXPECT_EQ(with_nodes + waiting, models);
  EXPECT_GT(with_nodes, 100);
}

TEST_F(RemoteSessions, ATickMakesNoAllocation) {
  const auto session = begin("column");
  session->subscribe({.proxy_Hz = 1000, .model_Hz = 100, .radius_um = 40});
  arrive(*session, {0, 0, 0});
  for (int i = 0; i < 500; ++i) {
    push(*session, {0.00002 * i, 0.00001 * i, 0});
    ++period_;
    test::NoAllocGuard guard;
    scene_->tiles(0).reader->apply(32);
    session->tick(period_);
    session->afterAll(0.0005);
    const test::ForbiddenCalls calls = guard.calls();
    ASSERT_EQ(calls.total(), 0u) << calls.first;
    session->serve();
    v1::Proxy proxy;
    while (session->takeProxy(proxy)) {
    }
  }
}

class RecordedSessions : public RemoteSessions {
 protected:
  // Travels with jumps, commands, silence and stalls.
  void record() {
    const auto session = begin("column", {.record = file_});
    session->subscribe({.proxy_Hz = 0, .model_Hz = 20, .radius_um = 30});
    arrive(*session, {0, 0, 0});
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> step(-0.002, 0.002);
    Vector3d h_D = Vector3d::Zero();
    for (int i = 0; i < 3000; ++i) {
      h_D += Vector3d(step(random), step(random), step(random));
      h_D = h_D.cwiseMax(-0.06).cwiseMin(0.06);
      if (i % 7 == 0 && i % 1000 < 800) push(*session, h_D);
      if (i == 1500) {
        const auto found = scene_->places().nearest({100, 50, -60});
        session->jump(found->place, true);
      }
      NavigationCommand turn;
      turn.kind = NavigationCommand::Kind::rotate;
      turn.about_y_rad = 0.2;
      if (i % 500 == 499) session->send(turn);
      tick(*session, random() % 100 == 0 ? 30 : 1);
      if (i % 50 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // tiles come at other times
    }
    session->finish();
  }
  const test::TempFolder folder_;
  const std::string file_ = folder_ / "a.rec";
};

TEST_F(RecordedSessions, ReplayToTheBit) {
  record();
  const auto set = sets_.shelf->find("column");
  EXPECT_EQ(recordedRevision(file_), set->set().revision());
  const SessionReplay replay = replaySession(set->set(), file_);
  EXPECT_GE(replay.ticks, 3000u);
  EXPECT_GT(replay.hands, 300u);
  EXPECT_EQ(replay.proxies, replay.hands);
  EXPECT_EQ(replay.differing_hands, 0u);
  EXPECT_EQ(replay.differing_proxies, 0u);
}

TEST_F(RecordedSessions, AChangedBitIsFound) {
  record();
  const std::string frames = file_ + ".frames";
  std::string bytes = test::readBytes(frames);
  ReadLog log = readSessionLog(frames);
  // The last PROXY: its p_W.
  const std::size_t at = bytes.rfind(std::string("\x02\x00\x01\x00\x00\x00\x00\x00", 8)) + 24;
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  test::writeBytes(frames, bytes);
  EXPECT_EQ(replaySession(sets_.shelf->find("column")->set(), file_).differing_proxies, 1u);
  test::writeBytes(frames, bytes.substr(0, bytes.size() - 5));
  EXPECT_THROW(readSessionLog(frames), InputError);
}

}  // namespace
}  // namespace filiform::tools
