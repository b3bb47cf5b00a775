// SIGINT and SIGTERM: long work polls a flag, and ends in its own time. Thread rule: internally synchronised.
#pragma once

#include <atomic>

namespace filiform::tools {

// From now on the two signals set the flag. A second one sets all forces to zero and ends the program at once.
void watchInterrupts();
// True once a signal came.
const std::atomic<bool>& interruptFlag();
// Throws Interrupted (index/errors.h) once the flag is set.
void throwIfInterrupted();
// 128 + the signal that set the flag.
int interruptedExitCode();

}  // namespace filiform::tools
