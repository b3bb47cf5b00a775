#include "viewer/glyph.h"

#include "tests/support/test_graph.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A thread along x of segments of 1 um with a side branch at every tenth node, from x = 0 to 40.
struct Comb {
  test::TestGraphBuilder build;
  std::vector<std::uint32_t> spine;
  Comb() {
    for (int x = 0; x <= 40; ++x) {
      spine.push_back(build.node({static_cast<double>(x), 0, 0}));
      if (x > 0) build.link(spine.back(), spine[spine.size() - 2]);
      if (x % 10 == 0 && x > 0 && x < 40) {
        const auto a = build.node({static_cast<double>(x), 2, 0}), b = build.node({static_cast<double>(x), 4, 0});
        build.link(a, spine.back());
        build.link(b, a);
      }
    }
  }
};

ProxyPlace placeOn(const test::TiledGraph& tiles, SegmentId segment, double t) {
  return GraphView(tiles.table(), tiles.leaves(), Grid()).placeAt(tiles.tileOf(segment), segment, t);
}

class Glyphs : public ::testing::TestWithParam<int> {
 protected:
  Glyphs() : tiles_(comb_.build.build(), static_cast<std::uint32_t>(GetParam())) {}
  GraphView graph() const { return {tiles_.table(), tiles_.leaves(), Grid()}; }
  // x um along the spine, which runs from parent to child.
  ProxyPlace at(double x) const {
    const auto child = static_cast<std::size_t>(std::ceil(x));
    const NodeId id = comb_.build.id(comb_.spine[child]);
    return placeOn(tiles_, {id.cell, id.sample}, static_cast<double>(child) - x);
  }
  Comb comb_;
  test::TiledGraph tiles_;
};

TEST_P(Glyphs, FindTheNearestForkWhateverTheTiling) {
  const JunctionSearch search = findJunction(graph(), at(17.25), Vector3d::Zero(), 100, 3);
  ASSERT_TRUE(search.junction);
  EXPECT_NEAR(search.junction->distance_um, 2.75, 1e-9);
  EXPECT_LT((search.junction->p_W - Vector3d(20, 0, 0)).norm(), 1e-9);
  ASSERT_EQ(search.junction->branches.size(), 3u);
  EXPECT_TRUE(search.absent.empty());
  for (const Branch& branch : search.junction->branches) {
    double length = 0;
    for (std::size_t i = 1; i < branch.points_W.size(); ++i)
      length += (branch.points_W[i] - branch.points_W[i - 1]).norm();
    EXPECT_NEAR(length, 3, 1e-9);
    EXPECT_EQ(branch.points_W.front(), Vector3d(20, 0, 0));
    EXPECT_EQ(branch.own, (branch.points_W.back() - Vector3d(17, 0, 0)).norm() < 1e-9);
  }
}

TEST_P(Glyphs, TheForkAheadIsPreferred) {
  const JunctionSearch ahead = findJunction(graph(), at(18), {-1, 0.2, 0}, 100, 3);
  ASSERT_TRUE(ahead.junction);
  EXPECT_NEAR(ahead.junction->p_W.x(), 10, 1e-9);
  EXPECT_NEAR(ahead.junction->distance_um, 8, 1e-9);
  const JunctionSearch behind = findJunction(graph(), at(35), {1, 0, 0}, 100, 3);  // ahead is only the end
  ASSERT_TRUE(behind.junction);
  EXPECT_NEAR(behind.junction->p_W.x(), 30, 1e-9);
}

TEST_P(Glyphs, NothingBeyondReachOrVisits) {
  EXPECT_FALSE(findJunction(graph(), at(15), Vector3d::Zero(), 4.9, 3).junction);
  EXPECT_TRUE(findJunction(graph(), at(15), Vector3d::Zero(), 5.1, 3).junction);
  EXPECT_FALSE(findJunction(graph(), at(15), Vector3d::Zero(), 100, 3, 2).junction);
  EXPECT_FALSE(findJunction(graph(), ProxyPlace{}, Vector3d::Zero(), 100, 3).junction);
}

TEST_P(Glyphs, AtTheForkItself) {
  const JunctionSearch search = findJunction(graph(), at(20), Vector3d::Zero(), 1, 3);
  ASSERT_TRUE(search.junction);
  EXPECT_EQ(search.junction->distance_um, 0);
  EXPECT_EQ(std::count_if(search.junction->branches.begin(), search.junction->branches.end(),
                          [](const Branch& b) { return b.own; }),
            1);
}

TEST_P(Glyphs, AbsentTilesAreNamedAndWithThemItGoesOn) {
  const ProxyPlace place = at(15.5);
  tiles_.dropAll();
  tiles_.load(place.tile);
  JunctionSearch search = findJunction(graph(), place, Vector3d::Zero(), 100, 3);
  int rounds = 0;
  while (!search.absent.empty() && ++rounds < 100) {
    for (const TileId tile : search.absent) tiles_.load(tile);
    search = findJunction(graph(), place, Vector3d::Zero(), 100, 3);
  }
  ASSERT_TRUE(search.junction);
  EXPECT_NEAR(search.junction->p_W.x(), 20, 1e-9);
  EXPECT_EQ(rounds > 0, GetParam() < 1000);
}

INSTANTIATE_TEST_SUITE_P(Capacities, Glyphs, ::testing::Values(2, 8, 1000));

TEST(Glyph, EndsOnLoops) {
  std::mt19937_64 random(3);
  const test::TestGraph graph = test::randomGraph(random, 300, true);
  const test::TiledGraph tiles(graph, 32);
  const GraphView view(tiles.table(), tiles.leaves(), graph.grid);
  int found = 0;
  for (const StoredSegment& s : graph.segments) {
    const ProxyPlace place = view.placeAt(tiles.tileOf(s.id), s.id, 0.5);
    const JunctionSearch search = findJunction(view, place, Vector3d::Zero(), 1e9, 5);
    if (!search.junction) continue;
    ++found;
    EXPECT_GT(search.junction->branches.size(), 2u);
  }
  EXPECT_GT(found, 100);
}

TEST(Glyph, OwnBranchDiffersInColourAndInShape) {
  Junction junction;
  junction.p_W = Vector3d(1e6, 0, 0);
  for (int i = 0; i < 3; ++i) {
    Branch branch;
    branch.own = i == 1;
    branch.points_W = {junction.p_W, junction.p_W + Vector3d(i - 1.0, 1, 0.25 * i)};
    junction.branches.push_back(branch);
  }
  for (const GlyphPalette& palette : {kRedGreen, kOrangeBlue, kForGlasses}) {
    const ThreadBatch glyph = glyphBatch(junction, 10, 0.4, palette);
    EXPECT_EQ(glyph.origin_W, junction.p_W);
    int own = 0, other = 0, filled = 0;
    double farthest[2] = {0, 0};
    float thickest_other = 0, thinnest_own_line = 1e9F;
    for (const DrawnSegment& s : glyph.segments) {
      const bool is_own = s.colour == palette.own;
      ASSERT_TRUE(is_own || s.colour == palette.other);
      ++(is_own ? own : other);
      farthest[is_own] = std::max<double>(farthest[is_own], Eigen::Vector3f(s.b_um[0], s.b_um[1], s.b_um[2]).norm());
      if (is_own && s.a_radius_um != s.b_radius_um) ++filled;
      if (is_own && s.a_radius_um == s.b_radius_um) thinnest_own_line = std::min(thinnest_own_line, s.a_radius_um);
      if (!is_own) thickest_other = std::max(thickest_other, s.a_radius_um);
    }
    EXPECT_EQ(own, 2);  // a line and a head
    EXPECT_EQ(filled, 1);
    EXPECT_EQ(other, 2 * (1 + 32));
    EXPECT_GT(thinnest_own_line, 1.5 * thickest_other);
    EXPECT_NEAR(farthest[0], 10, 0.01);
    EXPECT_NEAR(farthest[1], 10, 0.01);
  }
  EXPECT_NE(kRedGreen.own, kOrangeBlue.own);
}

// As bright for the eye behind the red glass, which sees luminance, as for the other; and one of the two far brighter.
TEST(Glyph, IsSeenThroughRedAndCyanGlasses) {
  const auto luminance = [](const Rgba& c) { return 0.299 * c.r + 0.587 * c.g + 0.114 * c.b; };
  EXPECT_GT(luminance(kForGlasses.own), 200);
  EXPECT_GT(luminance(kForGlasses.own), 1.8 * luminance(kForGlasses.other));
  EXPECT_GT(luminance(kForGlasses.other), 90);
}

}  // namespace
}  // namespace filiform
