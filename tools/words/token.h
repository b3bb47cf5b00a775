// The token of a server, as users give it. Functions without state.
#pragma once

#include <string>
#include <string_view>

namespace filiform::tools {

// Returns the token in a text: its first line, without a byte-order mark and blanks around it. `named`: of the text,
// for messages. Throws UsageError for a line that is empty, holds a blank or a character that is not visible ASCII, or
// is longer than 4 KiB.
std::string tokenIn(std::string_view text, const std::string& named);

// Returns the token in a file, such as that of --token-file. Throws as tokenIn(), and IoError for a file that cannot be
// read.
std::string readTokenFile(const std::string& option, const std::string& path);

}  // namespace filiform::tools
