#include "tests/support/corpus.h"

#include <cstdlib>

namespace filiform::test {

std::optional<std::filesystem::path> corpusFolder() {
  const char* folder = std::getenv("FILIFORM_CORPUS");
  if (folder == nullptr || *folder == '\0') return std::nullopt;
  return std::filesystem::path(folder);
}

}  // namespace filiform::test
