#include "solver/proxy/force_based.h"

#include "solver/proxy/descent.h"
#include "tests/support/scenes/proxy_walk.h"
#include "tests/support/scenes/test_graph.h"

#include <cmath>
#include <memory>
#include <utility>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

// A neurite along x, over a hump whose first slope is 3 um wide and 1 um high, and on along x. Probes lie below it.
class ForceBased : public testing::Test {
 protected:
  // Optional segments of length zero at the top of the hump.
  void build(const SolverParameters& parameters, int zero_length = 0) {
    builder_.node(Vector3d(0, 0, 0));
    builder_.link(builder_.node(Vector3d(4, 1, 0)), 0);
    std::uint32_t top = 1;
    for (int i = 0; i < zero_length; ++i) {
      const std::uint32_t same = builder_.node(Vector3d(4, 1, 0));
      builder_.link(same, top);
      top = same;
    }
    end_ = builder_.node(Vector3d(8, -4, 0));
    builder_.link(end_, top);
    graph_ = builder_.build();
    tiled_ = std::make_unique<TiledGraph>(graph_, 1000);
    solver_ = makeForceBased(parameters, reading_);
    solver_->setPlace(viewOf(*tiled_, graph_).placeAt(0, {0, 1}, 0.5));
  }
  const ProxyPlace& advance(const Vector3d& h_W) {
    solver_->advance(viewOf(*tiled_, graph_), {h_W}, step_);
    return solver_->place();
  }
  static SolverParameters reach(double gain, double r_min_um, double r_max_um) {
    SolverParameters parameters;
    parameters.gain = gain;
    parameters.r_min_um = r_min_um;
    parameters.r_max_um = r_max_um;
    return parameters;
  }

  TestGraphBuilder builder_;
  TestGraph graph_;
  std::unique_ptr<TiledGraph> tiled_;
  std::unique_ptr<ProxySolver> solver_;
  SolverStep step_;
  std::uint32_t end_ = 0;
  ForceReading reading_ = ForceReading::text;
};

// The nearest point of the first slope is (3.25, 0.8125). It is 2.5 um from the top, far less than the pull. The second
// slope comes nearer to the probe.
const Vector3d kBelow_W(4.3, -3.4, 0);

TEST_F(ForceBased, StepsOverAMaximumWithinReach) {
  build(reach(1, 0, 10));
  advance(kBelow_W);
  EXPECT_EQ(solver_->place().segment, (SegmentId{0, end_}));
  EXPECT_EQ(step_.visited, 2u);
}

TEST_F(ForceBased, StaysWhereTheBasicSolverDoesWithoutReach) {
  build(reach(0, 0, 10));
  const ProxyPlace place = advance(kBelow_W);
  EXPECT_EQ(place.segment, (SegmentId{0, 1}));
  EXPECT_FALSE(place.at_node);
  const auto basic = makeDescent({});
  basic->setPlace(viewOf(*tiled_, graph_).placeAt(0, {0, 1}, 0.5));
  basic->advance(viewOf(*tiled_, graph_), {kBelow_W}, step_);
  EXPECT_TRUE(samePlace(basic->place(), place));
}

TEST_F(ForceBased, ReachIsBoundedByItsMaximumAndOpenAtTheBound) {
  build(reach(0, 100, 0));
  ASSERT_EQ(advance(kBelow_W).segment, (SegmentId{0, 1}));
  const double to_top_um = (Vector3d(4, 1, 0) - solver_->place().p_W).norm();
  const auto endsOn = [&](const SolverParameters& parameters) {
    const auto solver = makeForceBased(parameters, reading_);
    solver->setPlace(viewOf(*tiled_, graph_).placeAt(0, {0, 1}, 0.5));
    solver->advance(viewOf(*tiled_, graph_), {kBelow_W}, step_);
    return solver->place().segment;
  };
  EXPECT_EQ(endsOn(reach(0, 100, to_top_um)), (SegmentId{0, 1}));  // |n-q| < r, not <=
  EXPECT_EQ(endsOn(reach(0, 100, std::nextafter(to_top_um, 10.0))), (SegmentId{0, end_}));
  EXPECT_EQ(endsOn(reach(0, to_top_um, 100)), (SegmentId{0, 1}));
  EXPECT_EQ(endsOn(reach(0, std::nextafter(to_top_um, 10.0), 100)), (SegmentId{0, end_}));
}

// A concave corner whose nearest point is the node itself; beyond the right edge a branch falls.
TEST_F(ForceBased, OnlyTheListingClimbsFromANode) {
  const std::uint32_t corner = builder_.node(Vector3d(0, 0, 0));
  const std::uint32_t left = builder_.node(Vector3d(-2, 0.5, 0)), right = builder_.node(Vector3d(2, 0.5, 0));
  builder_.link(left, corner);
  builder_.link(right, corner);
  const std::uint32_t beyond = builder_.node(Vector3d(2.2, -3, 0));
  builder_.link(beyond, right);
  graph_ = builder_.build();
  tiled_ = std::make_unique<TiledGraph>(graph_, 1000);
  const auto travel = [&](ForceReading reading) {
    solver_ = makeForceBased(reach(10, 10, 100), reading);
    solver_->setPlace(viewOf(*tiled_, graph_).placeAt(0, {0, left}, 1.0));
    return advance(Vector3d(0.5, -3, 0));
  };
  EXPECT_EQ(travel(ForceReading::text).node, (NodeId{0, corner}));
  EXPECT_EQ(step_.visited, 2u);
  EXPECT_EQ(travel(ForceReading::listing).segment, (SegmentId{0, beyond}));
  EXPECT_EQ(step_.visited, 3u);
}

// Both slopes of the hump are equally near to the probe. A branch that leads to the probe begins behind the second one.
TEST_F(ForceBased, OnlyTheListingGoesOnAtAnEqualDistance) {
  const std::uint32_t left = builder_.node(Vector3d(-4, 0, 0)), top = builder_.node(Vector3d(0, 4, 0));
  const std::uint32_t right = builder_.node(Vector3d(4, 0, 0)), tip = builder_.node(Vector3d(0.5, 0, 0));
  builder_.link(top, left);
  builder_.link(right, top);
  builder_.link(tip, right);
  graph_ = builder_.build();
  tiled_ = std::make_unique<TiledGraph>(graph_, 1000);
  const auto endsOn = [&](ForceReading reading) {
    solver_ = makeForceBased(reach(0, 3, 3), reading);
    solver_->setPlace(viewOf(*tiled_, graph_).placeAt(0, {0, top}, 0.5));
    return advance(Vector3d(0, 0, 0)).segment;
  };
  EXPECT_EQ(endsOn(ForceReading::text), (SegmentId{0, top}));
  EXPECT_EQ(endsOn(ForceReading::listing), (SegmentId{0, tip}));
}

// Two branches of a node: one ends 1.1 um from the probe, the other passes it at 2.5 um and ends 0.4 um from it.
TEST_F(ForceBased, OnlyTheListingDropsABranchThatIsFartherThanAnotherBranch) {
  const auto endsOn = [&](ForceReading reading, bool short_first) {
    builder_ = TestGraphBuilder();
    const std::uint32_t node = builder_.node(Vector3d(0, 0, 0));
    const auto shorter = [&] { builder_.link(builder_.node(Vector3d(0.5, -9, 0)), node); };
    if (short_first) shorter();
    const std::uint32_t first = builder_.node(Vector3d(2, -8.5, 0)), last = builder_.node(Vector3d(0.2, -10.3, 0));
    builder_.link(first, node);
    builder_.link(last, first);
    if (!short_first) shorter();
    graph_ = builder_.build();
    tiled_ = std::make_unique<TiledGraph>(graph_, 1000);
    solver_ = makeForceBased(reach(0, 0.1, 1), reading);
    solver_->setPlace(viewOf(*tiled_, graph_).placeAt(0, {0, first}, 1.0));
    return std::pair(advance(Vector3d(0, -10, 0)).segment, SegmentId{0, last});
  };
  for (const bool short_first : {false, true}) {
    const auto [reached, wanted] = endsOn(ForceReading::text, short_first);
    EXPECT_EQ(reached, wanted);
    const auto [listed, far_tip] = endsOn(ForceReading::listing, short_first);
    EXPECT_EQ(listed == far_tip, !short_first);
  }
}

TEST_F(ForceBased, TheListingsSphereIsClosed) {
  reading_ = ForceReading::listing;
  build(reach(0, 100, 0));
  ASSERT_EQ(advance(kBelow_W).segment, (SegmentId{0, 1}));
  const double to_top_um = (Vector3d(4, 1, 0) - solver_->place().p_W).norm();
  const auto endsOn = [&](double r_um) {
    solver_ = makeForceBased(reach(0, 100, r_um), reading_);
    solver_->setPlace(viewOf(*tiled_, graph_).placeAt(0, {0, 1}, 0.5));
    return advance(kBelow_W).segment;
  };
  EXPECT_EQ(endsOn(to_top_um), (SegmentId{0, end_}));
  EXPECT_EQ(endsOn(std::nextafter(to_top_um, 0.0)), (SegmentId{0, 1}));
}

TEST_F(ForceBased, StepsOverOneMaximumOnly) {
  // Two humps without an interior minimum between them: the valley after the first hump is not nearer to the probe than
  // the start of the branch.
  const Vector3d points[] = {{0, 0, 0}, {4, 1, 0}, {5, 0.9, 0}, {6, 2, 0}, {7, -5, 0}};
  for (std::uint32_t i = 0; i < 5; ++i) {
    builder_.node(points[i]);
    if (i > 0) builder_.link(i, i - 1);
  }
  graph_ = builder_.build();
  tiled_ = std::make_unique<TiledGraph>(graph_, 1000);
  solver_ = makeForceBased(reach(1, 0, 100), ForceReading::text);
  solver_->setPlace(viewOf(*tiled_, graph_).placeAt(0, {0, 1}, 0.5));
  EXPECT_EQ(advance(Vector3d(2, -3, 0)).segment, (SegmentId{0, 1}));
  EXPECT_EQ(step_.visited, 2u);
}

TEST_F(ForceBased, SegmentsOfLengthZeroChangeNothing) {
  build(reach(1, 0, 10), 0);
  const Vector3d without_W = advance(kBelow_W).p_W;
  for (int zero_length = 1; zero_length < 4; ++zero_length) {
    builder_ = TestGraphBuilder();
    build(reach(1, 0, 10), zero_length);
    EXPECT_EQ(advance(kBelow_W).p_W, without_W);
    EXPECT_EQ(step_.visited, 2u + static_cast<std::uint32_t>(zero_length));
  }
}

}  // namespace
}  // namespace filiform::test
