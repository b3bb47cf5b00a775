// The fuzz target of the C interface, a program of its own, because it needs every room below the viewer.
#include "tests/fuzz/c_interface_fuzzer.h"

#include <cstdlib>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const filiform::fuzz::CallFiles files = [] {
    std::string folder = "/tmp/filiform-fuzz-XXXXXX";
    filiform::fuzz::require(mkdtemp(folder.data()) != nullptr, "there is a folder for the set");
    return filiform::fuzz::makeCallFiles(folder);
  }();
  filiform::fuzz::fuzzCInterface({bytes, size}, files);
  return 0;
}
