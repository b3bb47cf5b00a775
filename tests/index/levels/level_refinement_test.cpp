#include "index/levels/internal/level_refinement.h"

#include <map>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::LevelRefinement;

// A tile whose finer form is one large tile, of which little is in view.
TEST(LevelRefinement, ASingleTileThatIsTooLargeGivesWayToThoseBelowIt) {
  const LevelPart coarse{true, 0, 10, 100}, large{true, 1, 500, 50}, near{true, 2, 40, 5}, far{true, 3, 30, 2};
  const std::map<std::uint32_t, std::vector<LevelPart>> below{{0, {large}}, {1, {near, far}}};
  const auto finer = [&](const LevelPart& part) { return below.at(part.tile); };
  for (const std::uint64_t most : {std::uint64_t{69}, std::uint64_t{70}}) {
    LevelRefinement refinement({coarse}, 10, most, finer);
    refinement.refineSingly(5);
    EXPECT_EQ(refinement.segments(), most == 70 ? 70u : 10u);
    EXPECT_EQ(refinement.take().size(), most == 70 ? 2u : 1u);
  }
}

// A part whose tiles below are not read stands for itself.
TEST(LevelRefinement, AnUnreadPartStays) {
  const LevelPart part{true, 0, 10, 100};
  LevelRefinement refinement({part}, 10, 5, [&](const LevelPart&) { return std::vector<LevelPart>{part}; });
  refinement.refineSingly(1);
  EXPECT_EQ(refinement.take().size(), 1u);
}

}  // namespace
}  // namespace filiform
