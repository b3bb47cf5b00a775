#include "index/workers.h"

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(RunWorkers, CallsEachWorkerOnceAndTheFirstHere) {
  for (const std::size_t threads : {1, 2, 5}) {
    std::vector<int> calls(threads, 0);
    std::thread::id first;
    runWorkers(threads, [&](unsigned worker, const std::atomic<bool>&) {
      ++calls[worker];
      if (worker == 0) first = std::this_thread::get_id();
    });
    EXPECT_EQ(calls, std::vector<int>(threads, 1));
    EXPECT_EQ(first, std::this_thread::get_id());
  }
}

TEST(RunWorkers, TellsOfAFailureAndRethrowsTheLowest) {
  std::atomic<int> ended{0};
  const auto run = [&](unsigned worker, const std::atomic<bool>& failed) {
    if (worker == 2) throw std::runtime_error("worker 2");
    while (!failed) std::this_thread::yield();
    ++ended;
    if (worker == 1) throw std::runtime_error("worker 1");
  };
  try {
    runWorkers(4, run);
    FAIL() << "no exception";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "worker 1");
  }
  EXPECT_EQ(ended, 3);
}

}  // namespace
}  // namespace filiform
