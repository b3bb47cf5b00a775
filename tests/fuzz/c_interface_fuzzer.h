// Sequences of calls of the C interface (tools/c/filiform.h), made from bytes. Thread rule: one thread.
#pragma once

#include "tests/fuzz/fuzzers.h"

#include <string>

namespace filiform::fuzz {

// Files for the calls: a small set, and the SWC file that it was made from.
struct CallFiles {
  std::string set, swc;
};
// Makes them in a folder. Aborts if that fails.
CallFiles makeCallFiles(const std::string& folder);

// Aborts if a call ends with an internal error or breaks a promise of the header.
void fuzzCInterface(Input input, const CallFiles& files);

}  // namespace filiform::fuzz
