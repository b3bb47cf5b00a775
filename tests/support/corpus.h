// The folder of real reconstructions: FILIFORM_CORPUS names it.
#pragma once

#include <filesystem>
#include <optional>

namespace filiform::test {

std::optional<std::filesystem::path> corpusFolder();

}  // namespace filiform::test

// Skips the test, with the reason, if there is no corpus.
#define FILIFORM_NEEDS_CORPUS()        \
  if (!filiform::test::corpusFolder()) \
  GTEST_SKIP()                         \
      << "needs real reconstructions: set FILIFORM_CORPUS to the folder that holds malformed/ and morphologies/"
