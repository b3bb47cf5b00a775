// SIGINT and SIGTERM set a flag. Long work polls the flag and ends cleanly. Thread rule: internally synchronised.
#pragma once

#include <atomic>

namespace filiform::tools {

// Installs the handlers. A second signal sets all forces to zero and ends the program at once.
void watchInterrupts();
// The flag: true after a signal.
const std::atomic<bool>& interruptFlag();
// Throws Interrupted (index/errors.h) if the flag is set.
void throwIfInterrupted();
// 128 + the number of the signal that set the flag.
int interruptedExitCode();

}  // namespace filiform::tools
