// Names for new files. Thread rule: a function without state.
#pragma once

#include <filesystem>
#include <string>

namespace filiform::internal {

// folder/NAME.ending, else folder/NAME-2.ending and so on: the first that does not exist. Makes the folder.
inline std::string newFileIn(const std::string& folder, const std::string& name, const std::string& ending) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  for (int number = 1;; ++number) {
    const std::filesystem::path path =
        std::filesystem::path(folder) / (name + (number == 1 ? "" : "-" + std::to_string(number)) + ending);
    if (!std::filesystem::exists(path, error)) return path.string();
  }
}

}  // namespace filiform::internal
