// Stands in for what emscripten lacks of a clock and of threads' priorities. See clock.h.
#include "viewer/web/clock.h"

#include <atomic>
#include <cerrno>
#include <pthread.h>
#include <sched.h>
#include <time.h>

namespace filiform::web {

namespace {

std::atomic<bool> is_hidden{false};
constexpr long kHiddenSleep_ns = 50'000'000;

}  // namespace

void setHidden(bool hidden) { is_hidden = hidden; }

}  // namespace filiform::web

extern "C" {

// Of CLOCK_MONOTONIC and absolute times alone, as HapticLoop calls it.
int clock_nanosleep(clockid_t clock, int, const timespec* until, timespec*) {
  const timespec long_sleep{0, filiform::web::kHiddenSleep_ns};
  while (filiform::web::is_hidden) nanosleep(&long_sleep, nullptr);
  timespec now;
  clock_gettime(clock, &now);
  const long long left_ns = (until->tv_sec - now.tv_sec) * 1'000'000'000LL + (until->tv_nsec - now.tv_nsec);
  if (left_ns <= 0) return 0;
  const timespec left{static_cast<time_t>(left_ns / 1'000'000'000), static_cast<long>(left_ns % 1'000'000'000)};
  nanosleep(&left, nullptr);
  return 0;
}

// A page may set no priorities, and its memory is never swapped out alone.
int pthread_setschedparam(pthread_t, int, const sched_param*) { return 0; }
int mlockall(int) { return 0; }
}
