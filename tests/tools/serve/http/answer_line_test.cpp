#include "tools/serve/http/answer_line.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using tools::AnswerLine;

// A job that is in work until open().
struct Gate {
  AnswerLine::Job job() {
    return [this] {
      ++entered;
      opened.wait();
    };
  }
  void open() { promise.set_value(); }
  bool enteredBy(int jobs) const {
    for (int i = 0; i < 500 && entered != jobs; ++i) std::this_thread::sleep_for(10ms);
    return entered == jobs;
  }
  std::promise<void> promise;
  std::shared_future<void> opened = promise.get_future();
  std::atomic<int> entered{0};
};

TEST(AnswerLine, ClientsTakeTurns) {
  Gate gate;
  std::vector<std::string> order;
  std::promise<void> last;
  {
    AnswerLine line(1);
    line.add("a", gate.job());
    ASSERT_TRUE(gate.enteredBy(1));
    for (int i = 0; i < 3; ++i) line.add("a", [&order] { order.push_back("a"); });
    line.add("b", [&order] { order.push_back("b"); });
    gate.open();
    line.add("a", [&last] { last.set_value(); });
    last.get_future().wait();
  }
  EXPECT_EQ(std::count(order.begin(), order.end(), "a"), 3);
  ASSERT_EQ(order.size(), 4u);
  EXPECT_NE(order.back(), "b") << "b waited for all jobs of a";
}

TEST(AnswerLine, JobsThatNobodyWaitsForAreDiscarded) {
  Gate gate;
  AnswerLine line(1);
  line.add("a", gate.job());
  ASSERT_TRUE(gate.enteredBy(1));
  const auto left = std::make_shared<std::atomic<bool>>(false);
  const auto body = std::make_shared<int>(0);
  for (int i = 0; i < 3; ++i)
    line.add(
        "a", [body] { ++*body; }, left);
  *left = true;
  EXPECT_EQ(line.add("b", [] {}), 0u) << "another client's line";
  std::promise<void> done;
  EXPECT_EQ(line.add("a", [&done] { done.set_value(); }), 3u);
  EXPECT_EQ(body.use_count(), 1);
  gate.open();
  done.get_future().wait();
  EXPECT_EQ(*body, 0);
}

TEST(AnswerLine, LongJobsOfOneClientLeaveRoomForOthers) {
  Gate gate;
  AnswerLine line(2);
  for (int i = 0; i < 10; ++i) line.add("a", gate.job());
  ASSERT_TRUE(gate.enteredBy(2));
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(gate.entered, 2) << "a client has at most as many jobs in work as there are threads";
  EXPECT_EQ(line.waiting(), 8u);
  for (int i = 0; i < 100; ++i) {
    std::promise<void> done;
    line.add("b", [&done] { done.set_value(); });
    ASSERT_EQ(done.get_future().wait_for(20s), std::future_status::ready);
  }
  gate.open();
  EXPECT_TRUE(gate.enteredBy(10));
}

TEST(AnswerLine, TheNumberOfLongJobsIsLimited) {
  Gate gate;
  AnswerLine line(1);
  for (int i = 0; i < 20; ++i) line.add(std::to_string(i), gate.job());
  EXPECT_TRUE(gate.enteredBy(5)) << "four long ones and one on the thread itself";
  std::this_thread::sleep_for(100ms);
  EXPECT_EQ(gate.entered, 5);
  gate.open();
  EXPECT_TRUE(gate.enteredBy(20));
}

TEST(AnswerLine, TheEndDiscardsWhatWaits) {
  const auto kept = std::make_shared<int>(0);
  Gate gate;
  std::thread opens;
  {
    AnswerLine line(1);
    line.add("a", gate.job());
    ASSERT_TRUE(gate.enteredBy(1));
    for (int i = 0; i < 5; ++i) line.add("a", [kept] { FAIL() << "ran after the end"; });
    EXPECT_EQ(kept.use_count(), 6);
    opens = std::thread([&] {
      while (kept.use_count() > 1) std::this_thread::sleep_for(1ms);
      gate.open();
    });
  }
  opens.join();
  EXPECT_EQ(kept.use_count(), 1);
}

}  // namespace
}  // namespace filiform
