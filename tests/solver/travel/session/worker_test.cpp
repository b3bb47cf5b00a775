#include "solver/travel/session/worker.h"

#include "index/errors.h"

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(Worker, ServesInOrderAndReportsFailures) {
  std::vector<int> done;
  std::vector<std::string> failed;
  Worker worker;
  EXPECT_TRUE(worker.idle());
  for (int i = 0; i < 3; ++i)
    worker.ask([&done, i]() -> Worker::Done {
      if (i == 1) throw UsageError("no such place");
      return [&done, i] { done.push_back(i); };
    });
  EXPECT_FALSE(worker.idle());
  for (int i = 0; i < 4000 && !worker.idle(); ++i) {
    worker.serve([&](const std::string& what) { failed.push_back(what); });
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(done, (std::vector<int>{0, 2}));
  EXPECT_EQ(failed, (std::vector<std::string>{"no such place"}));
}

}  // namespace
}  // namespace filiform
