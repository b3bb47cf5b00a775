#include "viewer/window/travel/internal/tooltip.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(Tooltip, WaitsForAPointerThatHasMovedAndRests) {
  Tooltip tooltip;
  EXPECT_FALSE(tooltip.isDue(0));
  EXPECT_FALSE(tooltip.isDue(1000)) << "the pointer has not moved yet";
  tooltip.pointerMoved(1000);
  EXPECT_FALSE(tooltip.isDue(1000.1));
  EXPECT_TRUE(tooltip.isDue(1000.5));
  tooltip.pointerMoved(1000.6);
  EXPECT_FALSE(tooltip.isDue(1000.7));
  tooltip.reset();
  EXPECT_FALSE(tooltip.isDue(2000));
}

}  // namespace
}  // namespace filiform::internal
