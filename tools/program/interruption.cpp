#include "tools/program/interruption.h"

#include "index/errors.h"
#include "solver/force/force_hold.h"

#include <csignal>

namespace filiform::tools {

namespace {

std::atomic<bool> interrupted{false};
std::atomic<int> interrupting_signal{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

extern "C" void onSignal(int signal) {
  interrupting_signal.store(signal);
  // A second signal sets all forces to zero and ends the program at once.
  if (interrupted.exchange(true)) {
    holdForces();
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
}

}  // namespace

void watchInterrupts() {
  std::signal(SIGINT, onSignal);
  std::signal(SIGTERM, onSignal);
}

const std::atomic<bool>& interruptFlag() { return interrupted; }

int interruptedExitCode() { return 128 + interrupting_signal.load(); }

void throwIfInterrupted() {
  if (interrupted.load(std::memory_order_relaxed)) throw Interrupted("interrupted");
}

}  // namespace filiform::tools
