#include "solver/proxy/descent.h"

#include "index/errors.h"
#include "tests/support/scenes/proxy_walk.h"
#include "tests/support/scenes/test_graph.h"
#include "tests/support/what_of.h"

#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

// A scene in one tile, and a basic proxy on it.
class Descent : public testing::Test {
 protected:
  void build(const SolverParameters& parameters = {}) {
    graph_ = builder_.build();
    tiled_ = std::make_unique<TiledGraph>(graph_, 1000);
    solver_ = makeDescent(parameters);
  }
  void place(SegmentId segment, double t) { solver_->setPlace(viewOf(*tiled_, graph_).placeAt(0, segment, t)); }
  const ProxyPlace& advance(const Vector3d& h_W) {
    solver_->advance(viewOf(*tiled_, graph_), {h_W}, step_);
    return solver_->place();
  }

  TestGraphBuilder builder_;
  TestGraph graph_;
  std::unique_ptr<TiledGraph> tiled_;
  std::unique_ptr<ProxySolver> solver_;
  SolverStep step_;
};

TEST_F(Descent, TravelsAStraightNeuriteInOneTick) {
  builder_.node(Vector3d(0, 0, 0));
  for (std::uint32_t i = 1; i <= 50; ++i) builder_.link(builder_.node(Vector3d(i, 0, 0)), i - 1);
  build();
  place({0, 3}, 0.5);
  EXPECT_EQ(advance(Vector3d(41.25, 1, 0)).p_W, Vector3d(41.25, 0, 0));
  EXPECT_EQ(solver_->place().segment, (SegmentId{0, 42}));
  EXPECT_EQ(step_.visited, 40u);
  EXPECT_EQ(step_.touched.count, 1u);
  EXPECT_EQ(advance(Vector3d(-7, 1, 0)).node, (NodeId{0, 0}));
  EXPECT_TRUE(solver_->place().at_node);
  EXPECT_EQ(solver_->place().p_W, Vector3d(0, 0, 0));
}

TEST_F(Descent, TakesTheBranchThatEndsNearest) {
  const std::uint32_t fork = builder_.node(Vector3d(0, 0, 0));
  builder_.link(builder_.node(Vector3d(-5, 0, 0)), fork);
  builder_.link(builder_.node(Vector3d(5, 4, 0)), fork);
  builder_.link(builder_.node(Vector3d(5, 1, 0)), fork);
  build();
  place({0, 1}, 0.5);
  EXPECT_EQ(advance(Vector3d(5, 0.9, 0)).segment, (SegmentId{0, 3}));
  EXPECT_EQ(step_.visited, 3u);
  place({0, 1}, 1.0);  // from the fork itself
  EXPECT_EQ(advance(Vector3d(5, 3.9, 0)).segment, (SegmentId{0, 2}));
}

TEST_F(Descent, AmongEquallyNearBranchesTheLowestIdWins) {
  const std::uint32_t fork = builder_.node(Vector3d(0, 0, 0));
  builder_.link(builder_.node(Vector3d(3, 2, 0)), fork);
  builder_.link(builder_.node(Vector3d(3, -2, 0)), fork);
  build();
  place({0, 2}, 1.0);
  EXPECT_EQ(advance(Vector3d(3, 0, 0)).segment, (SegmentId{0, 1}));
}

TEST_F(Descent, StaysAtAConcaveElbow) {
  const std::uint32_t root = builder_.node(Vector3d(0, 0, 0));
  const std::uint32_t down = builder_.node(Vector3d(4, 0, 0));
  builder_.link(down, root);
  const std::uint32_t up = builder_.node(Vector3d(6, 3, 0));
  builder_.link(up, down);
  build();
  // Beyond the corner the neurite leads away from the probe before it comes back.
  place({0, 1}, 0.5);
  EXPECT_EQ(advance(Vector3d(3, 3, 0)).segment, (SegmentId{0, 1}));
  EXPECT_EQ(solver_->place().p_W, Vector3d(3, 0, 0));
}

TEST_F(Descent, PassesSegmentsOfLengthZero) {
  const std::uint32_t root = builder_.node(Vector3d(0, 0, 0));
  std::uint32_t last = root;
  for (int i = 0; i < 3; ++i) {  // starts before, between and after them
    for (int k = 0; k < 2; ++k) {
      const std::uint32_t same = builder_.node(builder_.position_W(last));
      builder_.link(same, last);
      last = same;
    }
    const std::uint32_t next = builder_.node(Vector3d(i + 1, 0, 0));
    builder_.link(next, last);
    last = next;
  }
  build();
  place({0, 9}, 0.0);
  EXPECT_EQ(advance(Vector3d(0.25, 1, 0)).p_W, Vector3d(0.25, 0, 0));
  EXPECT_EQ(advance(Vector3d(2.75, 1, 0)).p_W, Vector3d(2.75, 0, 0));
  place({0, 4}, 0.0);  // start at an end of one
  EXPECT_EQ(advance(Vector3d(2.5, 1, 0)).p_W, Vector3d(2.5, 0, 0));
}

TEST_F(Descent, StartsInsideASegmentOfLengthZeroBothWays) {
  const std::uint32_t a = builder_.node(Vector3d(0, 0, 0));
  const std::uint32_t b = builder_.node(Vector3d(1, 0, 0));
  const std::uint32_t c = builder_.node(Vector3d(1, 0, 0));
  const std::uint32_t d = builder_.node(Vector3d(2, 0, 0));
  builder_.link(b, a);
  builder_.link(c, b);
  builder_.link(d, c);
  build();
  ProxyPlace inside;  // no query returns such a place, but it is valid
  inside.segment = {0, c};
  inside.t = 0.5;
  inside.tile = 0;
  inside.p_W = Vector3d(1, 0, 0);
  solver_->setPlace(inside);
  EXPECT_EQ(advance(Vector3d(0.25, 0, 0)).p_W, Vector3d(0.25, 0, 0));
  solver_->setPlace(inside);
  EXPECT_EQ(advance(Vector3d(1.75, 0, 0)).p_W, Vector3d(1.75, 0, 0));
}

TEST_F(Descent, AnIsolatedNodeHoldsTheProxy) {
  builder_.node(Vector3d(1, 2, 3));
  build();
  place({0, 0}, 0.0);
  EXPECT_TRUE(solver_->place().at_node);
  EXPECT_EQ(advance(Vector3d(100, 0, 0)).p_W, Vector3d(1, 2, 3));
  EXPECT_EQ(step_.visited, 1u);
}

TEST_F(Descent, GoesRoundALoopOnce) {
  constexpr std::uint32_t n = 36;
  for (std::uint32_t i = 0; i < n; ++i) {
    const double angle = 2 * 3.141592653589793 * i / n;
    builder_.node(10 * Vector3d(std::cos(angle), std::sin(angle), 0));
  }
  for (std::uint32_t i = 0; i < n; ++i) builder_.loop(i, (i + 1) % n);
  build();
  place({0, 1000000 + n / 2}, 0.5);
  advance(Vector3d(10, 0, 0));
  EXPECT_TRUE(solver_->place().at_node);
  EXPECT_EQ(solver_->place().node, (NodeId{0, 0}));
  EXPECT_LE(step_.visited, n);
}

TEST_F(Descent, FrontierHoldsTheProxyAtTheNodeAndNamesTheTile) {
  for (std::uint32_t i = 0; i <= 40; ++i) {
    builder_.node(Vector3d(i, 0, 0));
    if (i > 0) builder_.link(i, i - 1);
  }
  graph_ = builder_.build();
  TiledGraph tiled(graph_, 8);
  solver_ = makeDescent({});
  const GraphView view = viewOf(tiled, graph_);
  const Vector3d h_W(39.5, 1, 0);
  const TileId far = tiled.leaves().home(graph_.grid.snap(Vector3d(20, 0, 0)));
  solver_->setPlace(view.placeAt(tiled.tileOf({0, 2}), {0, 2}, 0.5));
  tiled.drop(far);
  solver_->advance(view, {h_W}, step_);
  EXPECT_EQ(step_.frontiers, 1u);
  ASSERT_EQ(step_.absent.count, 1u);
  EXPECT_EQ(step_.absent.ids[0], far);
  EXPECT_TRUE(solver_->place().at_node);
  EXPECT_EQ(solver_->place().tile, far);
  const Vector3d rest_W = solver_->place().p_W;
  EXPECT_GT(rest_W.x(), 2.0);
  EXPECT_LE(rest_W.x(), 20.0);
  solver_->advance(view, {h_W}, step_);  // still absent: the proxy rests, and the tile is reported again
  EXPECT_EQ(solver_->place().p_W, rest_W);
  EXPECT_EQ(step_.frontiers, 1u);
  tiled.load(far);
  solver_->advance(view, {h_W}, step_);
  EXPECT_EQ(step_.frontiers, 0u);
  EXPECT_EQ(solver_->place().p_W, Vector3d(39.5, 0, 0));
}

TEST(ProxySolver, EveryMethodIsMadeAndOnlyClimbWantsAnAnchor) {
  for (const SolverMethod method : kSolverMethods) {
    const auto solver = makeProxySolver(method, {});
    ASSERT_NE(solver, nullptr);
    EXPECT_EQ(solver->wantsAnchor(), method == SolverMethod::climb);
  }
}

TEST(ProxySolver, RefusesParametersThatMakeNoSense) {
  const auto refuses = [](auto change) {
    SolverParameters parameters;
    change(parameters);
    return test::whatOf<UsageError>([&] { makeProxySolver(SolverMethod::force, parameters); });
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_NE(refuses([](auto& p) { p.max_visited = 0; }).find("max_visited"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.max_visited = UINT32_MAX; }).find("max_visited"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.gain = -1; }).find("gain"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.r_min_um = nan; }).find("r_min_um"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.r_max_um = inf; }).find("r_max_um"), std::string::npos);
  EXPECT_EQ(refuses([](auto& p) { p.r_max_um = 1e6; }), "no error");
  EXPECT_NE(refuses([](auto& p) { p.climb.rest_mm = -1; }).find("rest_mm"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.climb.gain = nan; }).find("gain"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.climb.most_mm = inf; }).find("most_mm"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.climb.patience_1_s = -1; }).find("patience_1_s"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.climb.pull_mm = -1; }).find("pull_mm"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.climb.most_pull_mm = -1; }).find("most_pull_mm"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.climb.growth_1_mm = -1; }).find("growth_1_mm"), std::string::npos);
  EXPECT_NE(refuses([](auto& p) { p.climb.motion_cost = nan; }).find("motion_cost"), std::string::npos);
}

TEST(ProxySolver, MethodsHaveNames) {
  for (const SolverMethod method : kSolverMethods) EXPECT_EQ(solverMethod(toString(method)), method);
  EXPECT_EQ(solverMethod("basic"), SolverMethod::basic);
  EXPECT_EQ(solverMethod("shading"), SolverMethod::shading);
  EXPECT_EQ(solverMethod("force"), SolverMethod::force);
  EXPECT_EQ(solverMethod("force-listing"), SolverMethod::force_listing);
  EXPECT_EQ(solverMethod("climb"), SolverMethod::climb);
  EXPECT_EQ(test::whatOf<UsageError>([] { solverMethod("best"); }),
            "unknown method 'best': choose basic, shading, force, force-listing or climb");
}

}  // namespace
}  // namespace filiform::test
