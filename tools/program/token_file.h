// The file of --token-file. Function without state.
#pragma once

#include <string>

namespace filiform::tools {

// Returns the first line, without a byte-order mark and trailing blanks. Throws IoError for a file that cannot be
// opened; UsageError for a line that is empty, has a control character or is longer than 4 KiB.
std::string readTokenFile(const std::string& path);

}  // namespace filiform::tools
