#include "solver/force/force_hold.h"

#include <cerrno>
#include <csignal>
#include <time.h>

namespace filiform {

namespace internal {

namespace {
ForceHolds holds;
static_assert(std::atomic<int>::is_always_lock_free, "signal handlers use it");
}  // namespace

ForceHolds& forceHolds() noexcept { return holds; }

}  // namespace internal

namespace {

extern "C" void onDeadlySignal(int signal) {
  const int old_errno = errno;
  holdForces();
  errno = old_errno;
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

extern "C" void onStopSignal(int) {
  const int old_errno = errno;
  holdForces();
  std::raise(SIGSTOP);  // returns when the process is continued
  releaseForces();
  errno = old_errno;
}

}  // namespace

void holdForces() noexcept {
  internal::ForceHolds& holds = internal::forceHolds();
  holds.wanted.fetch_add(1);
  for (int ms = 0; ms < 50 && holds.held.load() < holds.guards.load(); ++ms) {
    timespec pause{0, 1'000'000};
    nanosleep(&pause, nullptr);
  }
}

void releaseForces() noexcept { internal::forceHolds().wanted.fetch_sub(1); }

void holdForcesOnSignals() {
  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  action.sa_handler = onDeadlySignal;
  // SA_NODEFER: the signal is not blocked while it is handled, so raising it again ends the process.
  action.sa_flags = SA_NODEFER;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGQUIT, SIGHUP})
    sigaction(signal, &action, nullptr);
  action.sa_handler = onStopSignal;
  action.sa_flags = SA_RESTART;
  sigaction(SIGTSTP, &action, nullptr);
}

}  // namespace filiform
