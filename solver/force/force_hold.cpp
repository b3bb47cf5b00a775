#include "solver/force/force_hold.h"

#include <cerrno>
#include <csignal>
#include <cstddef>
#include <sys/mman.h>
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

class SignalStack {
 public:
  SignalStack() noexcept {
    stack_t old{};
    if (sigaltstack(nullptr, &old) != 0 || (old.ss_flags & SS_DISABLE) == 0) return;
    stack_t mine{};
    mine.ss_sp = mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
    mine.ss_size = kBytes;
    if (mine.ss_sp != MAP_FAILED && sigaltstack(&mine, nullptr) == 0) stack_ = mine.ss_sp;
  }
  ~SignalStack() {
    if (stack_ == nullptr) return;
    stack_t none{};
    none.ss_flags = SS_DISABLE;
    sigaltstack(&none, nullptr);
    munmap(stack_, kBytes);
  }
  SignalStack(const SignalStack&) = delete;
  SignalStack& operator=(const SignalStack&) = delete;

 private:
  static constexpr std::size_t kBytes = 64 * 1024;  // the registers alone may take 11 KiB
  void* stack_ = nullptr;
};

}  // namespace

void giveSignalStack() noexcept { thread_local const SignalStack stack; }

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
  giveSignalStack();
  struct sigaction action {};
  sigemptyset(&action.sa_mask);
  action.sa_handler = onDeadlySignal;
  // SA_NODEFER: the signal is not blocked while it is handled, so raising it again ends the process.
  action.sa_flags = SA_NODEFER | SA_ONSTACK;
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGQUIT, SIGHUP})
    sigaction(signal, &action, nullptr);
  action.sa_handler = onStopSignal;
  action.sa_flags = SA_RESTART | SA_ONSTACK;
  sigaction(SIGTSTP, &action, nullptr);
}

}  // namespace filiform
