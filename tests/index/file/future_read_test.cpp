#include "index/file/future_read.h"

#include <atomic>
#include <chrono>
#include <future>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

constexpr int kThreads = 4;

TEST(FutureReadTest, OneThatIsNotAheadRunsInGet) {
  FutureRead<std::thread::id> read(nullptr, [] { return std::this_thread::get_id(); });
  EXPECT_EQ(read.get(), std::this_thread::get_id());
}

TEST(FutureReadTest, OneAheadBeginsWithoutGet) {
  ReadThreads threads(kThreads);
  std::atomic<bool> has_run{false};
  FutureRead<std::thread::id> read(&threads, [&] {
    has_run = true;
    return std::this_thread::get_id();
  });
  while (!has_run) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_NE(read.get(), std::this_thread::get_id());
}

TEST(FutureReadTest, GetThrowsWhatTheReadThrows) {
  ReadThreads threads(kThreads);
  for (ReadThreads* some : {&threads, static_cast<ReadThreads*>(nullptr)}) {
    FutureRead<int> read(some, []() -> int { throw std::runtime_error("no tile"); });
    EXPECT_THROW(read.get(), std::runtime_error);
  }
}

TEST(FutureReadTest, OnlyAReadUnderWayIsNotGivenUp) {
  FutureRead<int> not_begun(nullptr, [] { return 1; });
  EXPECT_TRUE(not_begun.giveUp());
  ReadThreads threads(1);
  std::promise<void> begun, go;
  FutureRead<int> read(&threads, [&] {
    begun.set_value();
    go.get_future().wait();
    return 1;
  });
  begun.get_future().wait();
  FutureRead<int> behind(&threads, [] { return 2; });
  EXPECT_FALSE(read.giveUp());
  EXPECT_TRUE(behind.giveUp());
  go.set_value();
  while (!read.giveUp()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

// All threads wait in reads that began reads of their own: these run on the threads that wait for them.
TEST(FutureReadTest, ReadsOfReadsNeedNoFreeThread) {
  ReadThreads threads(kThreads);
  std::vector<FutureRead<int>> outer;
  const int count = 3 * kThreads;
  for (int i = 0; i < count; ++i)
    outer.emplace_back(&threads, [i, &threads] {
      FutureRead<int> inner(&threads, [i] { return 2 * i; });
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return inner.get() + 1;
    });
  for (int i = 0; i < count; ++i) EXPECT_EQ(outer[i].get(), 2 * i + 1);
}

TEST(FutureReadTest, ManyReadsShareFewThreads) {
  ReadThreads threads(kThreads);
  std::mutex mutex;
  std::set<std::thread::id> used;
  {
    std::vector<FutureRead<int>> reads;
    for (int i = 0; i < 10 * kThreads; ++i)
      reads.emplace_back(&threads, [&] {
        const std::lock_guard lock(mutex);
        used.insert(std::this_thread::get_id());
        return 0;
      });
    for (FutureRead<int>& read : reads) EXPECT_EQ(read.get(), 0);
  }
  used.erase(std::this_thread::get_id());
  EXPECT_LE(used.size(), std::size_t{kThreads});
}

// A forgotten reading has ended or never begins, so what it refers to may end.
TEST(FutureReadTest, OneThatIsForgottenDoesNotRunLater) {
  ReadThreads threads(kThreads);
  std::atomic<int> begun{0}, ended{0};
  {
    std::vector<FutureRead<int>> reads;
    for (int i = 0; i < 5 * kThreads; ++i)
      reads.emplace_back(&threads, [&] {
        ++begun;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        return ++ended;
      });
  }
  const int before = begun;
  EXPECT_EQ(ended, before);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(begun, before);
}

}  // namespace
}  // namespace filiform
