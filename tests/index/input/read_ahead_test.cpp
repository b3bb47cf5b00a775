#include "index/input/internal/read_ahead.h"

#include "index/errors.h"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

using namespace std::chrono_literals;

// Reads input i as a cell of digest i, after a wait that differs from input to input.
ReadAhead::Plan planOf(unsigned threads, std::vector<std::uint64_t> costs) {
  return {threads, 100, std::move(costs),
          [](unsigned, std::size_t item, const std::atomic<bool>&, ReadAhead::Result& result) {
            std::this_thread::sleep_for(std::chrono::microseconds(item * 7919 % 500));
            result.cell.digest = item;
            result.bytes = item;
          }};
}

std::uint64_t taken(ReadAhead& ahead, std::size_t item) {
  ReadAhead::Result result;
  ahead.take(item, result, [] {});
  return result.cell.digest;
}

TEST(ReadAhead, HandsInputsOnInOrder) {
  for (const unsigned threads : {1u, 2u, 7u}) {
    ReadAhead ahead(planOf(threads, std::vector<std::uint64_t>(200, 30)));
    for (std::size_t i = 0; i < 200; ++i) ASSERT_EQ(taken(ahead, i), i) << threads;
  }
}

TEST(ReadAhead, LeavesInputsOutAndStopsBeforeThoseReadAlone) {
  std::atomic<std::size_t> highest{0};
  ReadAhead::Plan plan = planOf(4, {1, ReadAhead::kSkip, 1, ReadAhead::kAlone, 1, 1});
  const auto read = plan.read;
  plan.read = [&](unsigned reader, std::size_t item, const std::atomic<bool>& stop, ReadAhead::Result& result) {
    if (item > highest) highest = item;
    EXPECT_NE(item, 1u);
    EXPECT_NE(item, 3u);
    read(reader, item, stop, result);
  };
  ReadAhead ahead(plan);
  EXPECT_EQ(taken(ahead, 0), 0u);
  EXPECT_EQ(taken(ahead, 2), 2u);
  EXPECT_FALSE(ahead.isAhead(1));
  EXPECT_FALSE(ahead.isAhead(3));
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(highest, 2u) << "the input read alone has all the memory";
  EXPECT_EQ(taken(ahead, 4), 4u);
  EXPECT_EQ(taken(ahead, 5), 5u);
}

TEST(ReadAhead, InputsUnderWayStayWithinTheMemory) {
  std::atomic<std::uint64_t> now{0}, most{0};
  ReadAhead::Plan plan = planOf(8, std::vector<std::uint64_t>(100, 40));
  plan.read = [&](unsigned, std::size_t, const std::atomic<bool>&, ReadAhead::Result&) {
    const std::uint64_t used = now += 40;
    std::uint64_t seen = most;
    while (used > seen && !most.compare_exchange_weak(seen, used)) {
    }
    std::this_thread::sleep_for(200us);
    now -= 40;
  };
  ReadAhead ahead(plan);
  for (std::size_t i = 0; i < 100; ++i) taken(ahead, i);
  EXPECT_LE(most, 100u);
}

TEST(ReadAhead, AFailureComesInItsPlaceAndReadingMayStartAnew) {
  ReadAhead::Plan plan = planOf(3, std::vector<std::uint64_t>(10, 1));
  std::atomic<int> failures{1};
  const auto read = plan.read;
  plan.read = [&](unsigned reader, std::size_t item, const std::atomic<bool>& stop, ReadAhead::Result& result) {
    if (item == 4 && failures-- > 0) throw InputError("four");
    read(reader, item, stop, result);
  };
  ReadAhead ahead(plan);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(taken(ahead, i), i);
  ReadAhead::Result result;
  ahead.take(4, result, [] {});
  EXPECT_THROW(std::rethrow_exception(result.failure), InputError);
  for (std::size_t i = 4; i < 10; ++i) EXPECT_EQ(taken(ahead, i), i);
  for (std::size_t i = 2; i < 10; ++i) EXPECT_EQ(taken(ahead, i), i);
}

TEST(ReadAhead, EndsWhileInputsAreBeingRead) {
  ReadAhead::Plan plan = planOf(4, std::vector<std::uint64_t>(100, 1));
  plan.read = [](unsigned reader, std::size_t item, const std::atomic<bool>& stop, ReadAhead::Result&) {
    while (reader > 0 && item > 0 && !stop) std::this_thread::sleep_for(1ms);
  };
  ReadAhead ahead(plan);
  EXPECT_EQ(taken(ahead, 0), 0u);
  std::this_thread::sleep_for(5ms);
}

TEST(ReadAhead, AsksTheCallerWhileItWaits) {
  std::atomic<bool> go{false};
  ReadAhead::Plan plan = planOf(2, {60, 60});
  const std::thread::id caller = std::this_thread::get_id();
  plan.read = [&](unsigned, std::size_t item, const std::atomic<bool>&, ReadAhead::Result&) {
    while (item == 1 && std::this_thread::get_id() != caller && !go) std::this_thread::sleep_for(1ms);
  };
  ReadAhead ahead(plan);
  taken(ahead, 0);
  std::this_thread::sleep_for(20ms);  // the other thread has begun to read input 1
  ReadAhead::Result result;
  int asked = 0;
  ahead.take(1, result, [&] {
    ++asked;
    go = true;
  });
  EXPECT_LE(asked, 1);
}

}  // namespace
}  // namespace filiform::internal
