// Zero force from anywhere in the process, signal handlers too: every running haptic loop has a guard thread that takes
// the device from the haptic thread and sends zero until it is let go again.
//
// Signals that would end or stop the process without unwinding are so preceded by zero force, as far as a guard still
// runs and the device is not in the middle of an exchange that never ends. SIGKILL and SIGSTOP give no chance: what a
// device does when its host falls silent is the device's own. Thread rule: functions, any thread.
#pragma once

#include <atomic>

namespace filiform {

// Returns when all running loops have sent zero, or after 50 ms. Async-signal-safe.
void holdForces() noexcept;
void releaseForces() noexcept;

// From now on: before SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGQUIT and SIGHUP end the process, and before SIGTSTP
// (Ctrl-Z) stops it, forces are held; after a stop they are let go, and grow from zero. For programs that render force.
void holdForcesOnSignals();

namespace internal {

struct ForceHolds {  // between holdForces() and the guards
  std::atomic<int> wanted{0}, guards{0}, held{0};
};
ForceHolds& forceHolds() noexcept;

}  // namespace internal
}  // namespace filiform
