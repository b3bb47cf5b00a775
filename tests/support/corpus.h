// The folder of real reconstructions, where there is one: FILIFORM_CORPUS names it.
#pragma once

#include <filesystem>
#include <optional>

namespace filiform::test {

std::optional<std::filesystem::path> corpusFolder();

}  // namespace filiform::test

// Skips the test, saying why, where the corpus is not at hand.
#define FILIFORM_NEEDS_CORPUS()        \
  if (!filiform::test::corpusFolder()) \
  GTEST_SKIP()                         \
      << "needs real reconstructions: set FILIFORM_CORPUS to the folder that holds malformed/ and morphologies/"
