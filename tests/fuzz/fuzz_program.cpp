// One program for all targets; the environment variable FILIFORM_FUZZ names the one that runs.
#include "tests/fuzz/fuzzers.h"

#include <cstring>

namespace {

using namespace filiform::fuzz;

const Target* chosen = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int LLVMFuzzerInitialize(int*, char***) {
  const char* const name = std::getenv("FILIFORM_FUZZ");
  for (const Target& target : kTargets) {
    if (name != nullptr && std::strcmp(name, "list") == 0) std::puts(target.name);
    if (name != nullptr && std::strcmp(name, target.name) == 0) chosen = &target;
  }
  if (chosen != nullptr) return 0;
  if (name == nullptr || std::strcmp(name, "list") != 0)
    std::fputs("set FILIFORM_FUZZ to the name of a target, or to list\n", stderr);
  std::exit(name != nullptr && std::strcmp(name, "list") == 0 ? 0 : 2);
}

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->run({data, size});
  return 0;
}
