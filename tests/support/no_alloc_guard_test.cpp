#include "tests/support/no_alloc_guard.h"

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fcntl.h>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <thread>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

TEST(NoAllocGuard, SeesNothingWhereNothingHappens) {
  volatile double x = 1.0;
  NoAllocGuard guard;
  for (int i = 0; i < 1000; ++i) x = x * 1.0000001;
  const ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0u) << calls.first;
}

TEST(NoAllocGuard, SeesNewAndDelete) {
  NoAllocGuard guard;
  auto p = std::make_unique<std::vector<int>>(1000);
  static_cast<volatile int*>(p->data())[0] = 1;  // prevents the compiler from removing the allocation
  p.reset();
  const ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.allocations, 4u);
  EXPECT_STRNE(calls.first, "");
}

TEST(NoAllocGuard, SeesMallocAndAlignedAllocation) {
  void* volatile p = nullptr;
  {
    NoAllocGuard guard;
    p = std::malloc(10);
    std::free(p);
    EXPECT_EQ(guard.calls().allocations, 2u);
  }
  NoAllocGuard guard;
  p = std::aligned_alloc(64, 128);
  std::free(p);
  const ForbiddenCalls calls = guard.calls();
  EXPECT_GE(calls.allocations, NoAllocGuard::sees().locks ? 2u : 1u);  // the thread sanitizer reports only the free
}

TEST(NoAllocGuard, SeesLocksOrSaysWhyNot) {
  std::mutex mutex;
  std::shared_mutex shared;
  NoAllocGuard guard;
  { const std::lock_guard lock(mutex); }
  { const std::shared_lock lock(shared); }
  { const std::unique_lock lock(shared); }
  const ForbiddenCalls calls = guard.calls();
  if (NoAllocGuard::sees().locks) {
    EXPECT_EQ(calls.locks, 3u);
    EXPECT_STREQ(calls.first, "pthread_mutex_lock");
  } else {
    EXPECT_EQ(calls.locks, 0u);
    EXPECT_STRNE(NoAllocGuard::sees().why, "");
  }
}

TEST(NoAllocGuard, SeesSystemCallsOrSaysWhyNot) {
  char byte = 0;
  NoAllocGuard guard;
  const int fd = ::open("/dev/zero", O_RDONLY);
  const ssize_t got = ::read(fd, &byte, 1);
  ::close(fd);
  std::this_thread::sleep_for(std::chrono::nanoseconds(1));
  const ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(got, 1);
  if (NoAllocGuard::sees().system_calls) {
    EXPECT_EQ(calls.system_calls, 4u);
    EXPECT_STREQ(calls.first, "open");
  } else {
    EXPECT_EQ(calls.system_calls, 0u);
    EXPECT_STRNE(NoAllocGuard::sees().why, "");
  }
}

TEST(NoAllocGuard, LooksAtItsOwnThreadAndOnlyWhileOpen) {
  std::vector<int> before(10);
  std::thread other;
  ForbiddenCalls calls;
  {
    std::atomic<bool> go = false, done = false;
    other = std::thread([&] {
      while (!go) {
      }
      std::vector<int>(1000).back() = 1;
      done = true;
    });
    NoAllocGuard guard;
    go = true;
    while (!done) {
    }
    calls = guard.calls();
    before.resize(1000);
  }
  other.join();
  EXPECT_EQ(calls.total(), 0u) << calls.first;
}

TEST(NoAllocGuardDeathTest, AbortsWhenAsked) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(
      {
        NoAllocGuard guard(NoAllocGuard::On::abort);
        void* volatile p = std::malloc(10);
        std::free(p);
      },
      "forbidden in a haptic tick: malloc");
}

TEST(NoAllocGuard, SealedRunEndsAtASystemCall) {
  const auto nothing = [] {};
  const SealedRun clean = runSealed(nothing, [] { return true; });
  if (clean.outcome == SealedRun::Outcome::refused) {
    if (NoAllocGuard::sees().system_calls) GTEST_SKIP() << clean.text;  // this kernel
    EXPECT_NE(clean.text.find("sanitizer"), std::string::npos);
    return;
  }
  EXPECT_EQ(clean.outcome, SealedRun::Outcome::clean) << clean.text;
  EXPECT_EQ(runSealed(nothing, [] { return false; }).outcome, SealedRun::Outcome::failed);
  const SealedRun called = runSealed(nothing, [] { return ::getppid() != 0; });
  EXPECT_EQ(called.outcome, SealedRun::Outcome::system_call) << called.text;
}

}  // namespace
}  // namespace filiform::test
