// Detects what a haptic tick must not do: allocate, lock, or call the system.
//
//   NoAllocGuard guard;                       // watches this thread
//   solver->advance(graph, h_W, step);
//   const ForbiddenCalls calls = guard.calls();
//   EXPECT_EQ(calls.total(), 0u) << calls.first;   // gtest allocates, so only after calls() has closed the guard
//
// How: the test program defines malloc and its relatives, the locking functions of pthreads and the usual wrappers of
// system calls. Each definition counts the call if a guard is open on the calling thread, and then calls the C library.
// The guard detects
//   - malloc, calloc, realloc, free, aligned_alloc, posix_memalign, memalign, and through them operator new and delete;
//   - pthread_mutex_lock/trylock/timedlock, pthread_rwlock_rdlock/wrlock,
//     pthread_cond_wait/timedwait/clockwait/signal/broadcast, and through them std::mutex, std::shared_mutex,
//     std::condition_variable; sem_wait, sem_post (an unlock is not detected, but it always comes after a lock);
//   - read, write, pread, pwrite, open, openat, close, lseek, fsync, mmap, munmap, madvise, ioctl, poll, nanosleep,
//     clock_nanosleep, usleep, sched_yield, syscall.
// It does not detect calls within the C library (a lock inside stdio, a futex of a static local), spin locks, page
// faults, and system calls by inline assembly. runSealed() detects these: the kernel ends the process at the first one.
//
// Under a sanitizer the C library's functions belong to the sanitizer. Then only allocations are detected, by its
// hooks: see sees().
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace filiform::test {

struct ForbiddenCalls {
  std::uint32_t allocations = 0;  // allocations and releases
  std::uint32_t locks = 0;
  std::uint32_t system_calls = 0;
  const char* first = "";  // name of the first function called

  std::uint32_t total() const { return allocations + locks + system_calls; }
};

class NoAllocGuard {
 public:
  enum class On {
    count,
    abort
  };  // abort: at the first forbidden call, with its name on stderr (a debugger then shows the place)

  // Guards do not nest.
  explicit NoAllocGuard(On on = On::count) noexcept;
  ~NoAllocGuard();
  NoAllocGuard(const NoAllocGuard&) = delete;
  NoAllocGuard& operator=(const NoAllocGuard&) = delete;

  // Closes the guard and returns what it counted.
  ForbiddenCalls calls() noexcept;

  struct Sight {
    bool allocations, locks, system_calls;
    const char* why;  // the reason for each false
  };
  static Sight sees() noexcept;
};

struct SealedRun {
  enum class Outcome { clean, system_call, failed, refused };
  Outcome outcome;
  std::string text;  // the outcome in words, with the reason if the machine refused
};

// Runs `work` in a forked child that the kernel kills at the first system call other than exit. `prepare` runs in the
// child before that (touch memory, warm caches). If `work` returns false, the outcome is `failed`. Refused under
// sanitizers and if the kernel has no seccomp filters.
SealedRun runSealed(const std::function<void()>& prepare, const std::function<bool()>& work);

}  // namespace filiform::test
