// Helpers for tests that run a haptic loop in real time.
#pragma once

#include "solver/loop/haptic_loop.h"

#include <chrono>
#include <thread>

namespace filiform::test {

// Options without real-time priority and locked memory, which a test machine may refuse.
inline HapticLoopOptions quietLoop() {
  HapticLoopOptions options;
  options.realtime_priority = options.lock_memory = false;
  return options;
}

// Waits up to 20 s for a condition that normally holds within milliseconds.
template <class Condition>
bool soon(Condition condition) {
  for (int i = 0; i < 20000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return condition();
}

inline Wrench push(double force_N) {
  Wrench wrench;
  wrench.force_N.x() = force_N;
  return wrench;
}

}  // namespace filiform::test
