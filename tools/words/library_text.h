// Messages of the program in the words of its libraries. Thread rule: pure function.
#pragma once

#include <string>

namespace filiform::tools {

// Names options as fields and arguments: "--budget 1" becomes "budget 1". O(length).
std::string withPlainOptions(std::string message);

}  // namespace filiform::tools
