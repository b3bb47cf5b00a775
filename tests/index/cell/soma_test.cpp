#include "index/cell/soma.h"

#include "tests/support/scenes/random_cells.h"

#include <numbers>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A soma of three samples, the outer two `up` and `down` of the centre, with a neurite of three samples.
Cell threePoint(const Vector3d& up, const Vector3d& down, float radius_um = 8) {
  Cell cell;
  const Vector3d centre(100, -50, 7);
  test::addSample(cell, centre, kNoParent, radius_um, 1);
  test::addSample(cell, centre + down, 0, radius_um, 1);
  test::addSample(cell, centre + up, 0, radius_um, 1);
  for (std::uint32_t i = 0; i < 3; ++i)
    test::addSample(cell, centre + Vector3d(10.0 + 5 * i, 0, 0), i == 0 ? 0 : 2 + i, 0.5F, 3);
  return cell;
}

// An outline of `n` samples with the given radii, and a neurite at sample `at`.
Cell contour(std::uint32_t n, std::uint32_t at, float thickness_um, double around = 1) {
  Cell cell;
  for (std::uint32_t i = 0; i < n; ++i) {
    const double angle = around * 2 * std::numbers::pi * i / n;
    test::addSample(cell, Vector3d(7 * std::cos(angle), 7 * std::sin(angle), 3), i == 0 ? kNoParent : i - 1,
                    thickness_um, 1);
  }
  test::addSample(cell, cell.positions_um[at] * 2, at, 0.5F, 3);
  test::addSample(cell, cell.positions_um[at] * 3, n, 0.5F, 3);
  return cell;
}

TEST(Soma, ThreeSamplesAtOneRadiusAreASphere) {
  const Cell cell = threePoint({0, 8, 0}, {0, -8, 0});
  const CellSomata found = somataOf(cell);
  ASSERT_EQ(found.somata.size(), 1u);
  EXPECT_TRUE(found.off_roots.empty());
  const Soma& soma = found.somata[0];
  EXPECT_EQ(soma.form, Soma::Form::kThreePoint);
  EXPECT_EQ(soma.root, 0u);
  EXPECT_EQ(soma.centre_um, cell.positions_um[0]);
  EXPECT_EQ(soma.radius_um, 8);
  EXPECT_EQ(soma.samples, (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(soma.dead_ends, soma.samples);
  EXPECT_TRUE(found.somata[0].isDeadEnd(2));
  EXPECT_FALSE(found.somata[0].isDeadEnd(0));
  EXPECT_FALSE(found.somata[0].isDeadEnd(3));
}

TEST(Soma, ThreeSamplesAreASphereWhicheverWayTheyAreTurned) {
  const Vector3d out = 8 * Vector3d(1, -2, 0.5).normalized();
  EXPECT_EQ(somataOf(threePoint(out, -out)).somata.size(), 1u);
}

TEST(Soma, OnePercentIsTheLimit) {
  for (const double off : {0.0, 0.009, 0.0101, 0.05, 0.5})
    for (const Vector3d& way : {Vector3d(0, 1, 0), Vector3d(1, 0, 0), Vector3d(0, -1, 0)}) {
      const CellSomata found = somataOf(threePoint(Vector3d(0, 8, 0) + 8 * off * way, {0, -8, 0}));
      // If one sample moves sideways, the axis through both turns by half the angle.
      const bool within = off <= (way.x() > 0 ? 0.02 : 0.01);
      EXPECT_EQ(found.somata.size(), within ? 1u : 0u) << off << " " << way.transpose();
      EXPECT_EQ(found.off_roots.size(), within ? 0u : 1u) << off << " " << way.transpose();
    }
  EXPECT_EQ(somataOf(threePoint({0, 8, 0}, {0, 8, 0})).off_roots.size(), 1u) << "both on one side";
  EXPECT_EQ(somataOf(threePoint({0, 8, 0}, {0, -8, 0}, 0)).off_roots.size(), 1u) << "no radius";
  EXPECT_EQ(somataOf(threePoint({0, 8, 0}, {0, -8, 0}, kUnknownRadius)).off_roots.size(), 1u);
}

TEST(Soma, AnOuterSampleWithANeuriteLeadsOn) {
  Cell cell = threePoint({0, 8, 0}, {0, -8, 0});
  cell.parents[3] = 1;
  const CellSomata found = somataOf(cell);
  ASSERT_EQ(found.somata.size(), 1u);
  EXPECT_EQ(found.somata[0].samples, (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(found.somata[0].dead_ends, (std::vector<std::uint32_t>{2}));
}

TEST(Soma, AnOutlineIsItsSphere) {
  for (const float thickness_um : {0.0F, 0.3F, kUnknownRadius}) {
    const CellSomata found = somataOf(contour(12, 5, thickness_um));
    ASSERT_EQ(found.somata.size(), 1u) << thickness_um;
    const Soma& soma = found.somata[0];
    EXPECT_EQ(soma.form, Soma::Form::kContour);
    EXPECT_NEAR((soma.centre_um - Vector3d(0, 0, 3)).norm(), 0, 1e-9);
    EXPECT_NEAR(soma.radius_um, 7, 1e-9);
    EXPECT_EQ(soma.samples.size(), 11u);
    EXPECT_EQ(soma.dead_ends, (std::vector<std::uint32_t>{6, 7, 8, 9, 10, 11}));
  }
}

TEST(Soma, OtherFormsMeanThemselves) {
  Cell single, two, branching, below, neurite;
  test::addSample(single, Vector3d::Zero(), kNoParent, 5, 1);
  test::addSample(single, Vector3d(6, 0, 0), 0, 1, 3);
  test::addSample(two, Vector3d::Zero(), kNoParent, 5, 1);
  test::addSample(two, Vector3d(0, 5, 0), 0, 5, 1);
  test::addSample(branching, Vector3d::Zero(), kNoParent, 4, 1);
  test::addSample(branching, Vector3d(0, 4, 0), 0, 4, 1);
  test::addSample(branching, Vector3d(3, 6, 0), 1, 3, 1);
  test::addSample(branching, Vector3d(-3, 6, 0), 1, 3, 1);
  below = threePoint({0, 8, 0}, {0, -8, 0});
  below.parents[0] = 5;
  below.parents[3] = kNoParent;
  neurite = threePoint({0, 8, 0}, {0, -8, 0});
  for (std::uint16_t& type : neurite.types) type = 3;
  for (const Cell& cell : {single, two, branching, below, neurite, contour(12, 5, 5), contour(12, 5, 0, 0.5),
                           test::coincidentNodes(50), test::hub(30, 10), Cell{}}) {
    const CellSomata found = somataOf(cell);
    EXPECT_TRUE(found.somata.empty());
    EXPECT_TRUE(found.off_roots.empty());
  }
}

TEST(Soma, ALongRunOfSomaSamplesIsNoOutline) {
  EXPECT_EQ(somataOf(contour(500, 5, 0)).somata.size(), 1u);
  EXPECT_TRUE(somataOf(contour(600, 5, 0)).somata.empty());
}

TEST(Soma, EachRootHasItsOwn) {
  Cell cell = threePoint({0, 8, 0}, {0, -8, 0});
  const Cell more = threePoint({4, 0, 0}, {-4, 0, 0}, 4);
  for (std::uint32_t i = 0; i < more.samples(); ++i)
    test::addSample(cell, more.positions_um[i] + Vector3d(0, 0, 300),
                    more.parents[i] == kNoParent ? kNoParent : 6 + more.parents[i], more.radii_um[i], more.types[i]);
  const CellSomata found = somataOf(cell);
  ASSERT_EQ(found.somata.size(), 2u);
  EXPECT_EQ(found.somata[1].root, 6u);
  EXPECT_TRUE(found.somata[1].isDeadEnd(8));
}

}  // namespace
}  // namespace filiform
