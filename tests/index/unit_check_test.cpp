#include "index/unit_check.h"

#include "tests/support/random_cells.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

// What is said of neurons whose coordinates are multiplied by `factor`.
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
  EXPECT_NE(doubtOf(1000).find("--unit may be nm"), std::string::npos) << doubtOf(1000);
  EXPECT_NE(doubtOf(1e-3).find("--unit may be mm"), std::string::npos) << doubtOf(1e-3);
  EXPECT_NE(doubtOf(1e9).find("--unit states"), std::string::npos) << doubtOf(1e9);
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
