#include "tools/program/ending_watch.h"

#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

TEST(EndingWatches, TellOfAnEndThatTakesTooLong) {
  std::atomic<int> told{0};
  EndingWatch watch(0.01, [&] { ++told; });
  watch.begin();
  watch.begin();
  for (int i = 0; i < 10'000 && told == 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(told, 1);
}

TEST(EndingWatches, AreSilentWhenItEndsInTimeOrHasNotBegun) {
  std::atomic<int> told{0};
  {
    EndingWatch in_time(3600, [&] { ++told; }), not_begun(0, [&] { ++told; });
    in_time.begin();
  }
  EXPECT_EQ(told, 0);
}

}  // namespace
}  // namespace filiform::tools
