// Made-up sequences of calls of the C interface: some thousand seeded ones; with FILIFORM_CAMPAIGN a hundred times as
// many. tests/fuzz/c_interface_fuzzer.h makes the calls.
#include "tests/fuzz/c_interface_fuzzer.h"

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(CInterface, MadeUpSequencesOfCallsBreakNoPromise) {
  const bool whole = std::getenv("FILIFORM_CAMPAIGN") != nullptr;
  const unsigned seed = 1, sequences = whole ? 200'000 : 2'000;
  std::string folder = (std::filesystem::temp_directory_path() / "filiform-calls-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const fuzz::CallFiles files = fuzz::makeCallFiles(folder);
  std::mt19937_64 random(seed);
  for (unsigned i = 0; i < sequences; ++i) {
    std::vector<std::uint8_t> bytes(64 + random() % 1024);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    fuzz::fuzzCInterface(bytes, files);  // aborts at a broken promise
  }
  std::cout << "campaign: made-up sequences of C calls: " << sequences << ", seed " << seed << ", nothing found\n";
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace filiform
