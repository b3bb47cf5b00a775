// Messages of the program in the words of its libraries. Thread rule: pure function.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace filiform::tools {

// Names options as fields and arguments: "--budget 1" becomes "budget 1". O(length).
std::string withPlainOptions(std::string message);

// The same after phrases of the program (first) became those of a library, and long words short. O(length of all).
std::string inLibraryWords(std::string message, std::span<const std::pair<std::string_view, std::string_view>> phrases);

}  // namespace filiform::tools
