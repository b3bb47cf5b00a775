// Reads zip files in tests.
#pragma once

#include <map>
#include <string>

namespace filiform::test {

// The content of every entry, by path. Expects that the archive is consistent. O(bytes).
std::map<std::string, std::string> entriesOf(const std::string& path);

}  // namespace filiform::test
