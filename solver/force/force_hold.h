// Sends zero force from anywhere in the process, including signal handlers. Every running haptic loop has a guard
// thread. On request, the guard takes the device from the haptic thread and sends zero until the forces are released.
//
// So zero force precedes every signal that would end or stop the process without cleanup. This needs a running guard,
// and a device that is not in an exchange that never ends: if the exchange itself crashes, no zero is sent. SIGKILL and
// SIGSTOP cannot be caught. A device behind a process of its own (device/process/process_device.h) fades in all these
// cases. Thread rule: functions, any thread.
#pragma once

#include <atomic>

namespace filiform {

// Returns when all running loops have sent zero, at the latest after 50 ms. Async-signal-safe.
void holdForces() noexcept;
void releaseForces() noexcept;

// Installs signal handlers for programs that render force. Before SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGQUIT and
// SIGHUP end the process, forces are held. Before SIGTSTP (Ctrl-Z) stops the process, forces are held; when it
// continues, they are released and grow from zero.
// The handlers run on a stack of their own: that of the calling thread, of the threads of haptic loops, and of threads
// that call giveSignalStack().
void holdForcesOnSignals();
// Gives the calling thread a stack for signal handlers, until it ends: a handler then also runs after the thread's own
// stack has overflowed. Keeps a stack that it already has. Without memory, does nothing.
void giveSignalStack() noexcept;

namespace internal {

struct ForceHolds {  // shared by holdForces() and the guards
  std::atomic<int> wanted{0}, guards{0}, held{0};
};
ForceHolds& forceHolds() noexcept;

}  // namespace internal
}  // namespace filiform
