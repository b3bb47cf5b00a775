#include "tools/serve/session/ticker.h"

#include <atomic>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

struct Counting final : Ticked {
  void tick(std::uint64_t period) noexcept override {
    ordered = ordered && period > last;
    last = period;
    ++ticks;
  }
  std::atomic<std::uint64_t> ticks{0};
  std::uint64_t last = 0;
  bool ordered = true;
};

void waitFor(const Counting& one, std::uint64_t ticks) {
  while (one.ticks < ticks) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST(Ticker, TicksWhatWasAddedAndNothingAfterItsRemoval) {
  Ticker ticker([] {});
  Counting a, b;
  ticker.add(a);
  waitFor(a, 20);
  ticker.add(b);
  waitFor(b, 20);
  ticker.remove(a);
  const std::uint64_t then = a.ticks;
  waitFor(b, b.ticks + 20);
  EXPECT_EQ(a.ticks, then);
  ticker.remove(b);
  EXPECT_TRUE(a.ordered && b.ordered);
  const TickerCounters counters = ticker.counters();
  EXPECT_GE(counters.due, counters.ticks);
  EXPECT_LE(counters.late, counters.due);
}

TEST(Ticker, SleepsWithoutWork) {
  std::atomic<int> rounds{0};
  Ticker ticker([&] { ++rounds; });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(rounds, 0);
  Counting one;
  ticker.add(one);
  waitFor(one, 3);
  ticker.remove(one);
}

}  // namespace
}  // namespace filiform::tools
