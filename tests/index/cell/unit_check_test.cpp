#include "index/cell/internal/unit_check.h"

#include "tests/support/scenes/random_cells.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

// The result for neurons whose coordinates are multiplied by `factor`.
std::string doubtOf(double factor) {
  UnitCheck check;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Cell cell = test::randomNeuron(seed);
    for (Vector3d& p : cell.positions_um) p *= factor;
    check.add(cell);
  }
  return check.doubt();
}

TEST(UnitCheck, HasNoDoubtAboutNeurons) {
  EXPECT_EQ(doubtOf(1), "");
  EXPECT_EQ(doubtOf(0.3), "");
  EXPECT_EQ(doubtOf(5), "");
}

TEST(UnitCheck, NamesTheUnitsThatWouldDo) {
  EXPECT_NE(doubtOf(1000).find("--unit nm"), std::string::npos) << doubtOf(1000);
  EXPECT_NE(doubtOf(1e-3).find("--unit mm"), std::string::npos) << doubtOf(1e-3);
  EXPECT_NE(doubtOf(1e9).find("--unit UNIT"), std::string::npos) << doubtOf(1e9);
}

TEST(UnitCheck, NamesUnitsOfTheFilesWhateverTheyWereTakenFor) {
  UnitCheck check;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Cell cell = test::randomNeuron(seed);
    for (Vector3d& p : cell.positions_um) p *= 1000;
    check.add(cell);
  }
  EXPECT_TRUE(check.doubt(1000).ends_with("um")) << check.doubt(1000);
  EXPECT_EQ(check.doubt(1000).find("nm"), std::string::npos) << check.doubt(1000);
}

// A straight cell of `segments` segments.
Cell straight(double step_um, std::uint32_t segments) {
  Cell cell;
  for (std::uint32_t i = 0; i <= segments; ++i)
    test::addSample(cell, Vector3d(step_um * i, 0, 0), i == 0 ? kNoParent : i - 1);
  return cell;
}

std::string doubtOfStraight(double step_um, std::uint32_t segments) {
  UnitCheck check;
  check.add(straight(step_um, segments));
  return check.doubt();
}

TEST(UnitCheck, DoubtsLongSegmentsOfLargeCellsOnly) {
  EXPECT_EQ(doubtOfStraight(45, 200), "") << "a coarse tracing of 9 mm";
  EXPECT_EQ(doubtOfStraight(4, 7500), "") << "a fine tracing of 30 mm";
  EXPECT_EQ(doubtOfStraight(19.9, 2000), "");
  EXPECT_EQ(doubtOfStraight(20.5, 900), "");
  EXPECT_NE(doubtOfStraight(20.5, 1000), "");
  const std::string em = doubtOfStraight(44, 800);  // voxels of 8 nm
  EXPECT_NE(em.find("--unit 8nm"), std::string::npos) << em;
  EXPECT_EQ(em.find('\n'), std::string::npos);
}

TEST(UnitCheck, BelievesAStatedUnitOfACoarseTracing) {
  UnitCheck coarse, huge;
  coarse.add(straight(44, 800));
  EXPECT_NE(coarse.doubt(), "");
  EXPECT_EQ(coarse.doubt(1000), "") << "stated as mm";
  huge.add(straight(1e12, 800));
  EXPECT_NE(huge.doubt(1000).find("check the unit"), std::string::npos) << huge.doubt(1000);
  EXPECT_EQ(huge.doubt(1000).find("UNIT"), std::string::npos) << huge.doubt(1000);
}

TEST(UnitCheck, TakesTheCellsOfAnother) {
  UnitCheck whole, first, second;
  for (int i = 0; i < 7; ++i) {
    const Cell cell = straight(1000 + i, 8e5);
    whole.add(cell);
    (i < 3 ? first : second).add(cell);
  }
  for (const UnitCheck::Sizes& cell : second.sizes()) first.add(cell);
  EXPECT_NE(whole.doubt(), "");
  EXPECT_EQ(first.doubt(), whole.doubt());
}

TEST(UnitCheck, SaysNothingAboutNothing) {
  UnitCheck check;
  EXPECT_EQ(check.doubt(), "");
  check.add(Cell{});
  check.add(test::coincidentNodes(50));
  check.add(test::isolatedNodes(1, 50, 1e7));
  EXPECT_EQ(check.doubt(), "");
}

}  // namespace
}  // namespace filiform
