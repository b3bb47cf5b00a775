// Font files of the system, for letters that the built-in font lacks. Thread rule: any thread; reads folders.
#pragma once

#include <filesystem>
#include <vector>

namespace filiform::internal {

// Where fontconfig looks by default: fonts/ in $XDG_DATA_HOME and in each of $XDG_DATA_DIRS, and ~/.fonts.
std::vector<std::filesystem::path> fontFolders();

// The fonts that the window uses of those in these folders and below: first the one for most letters, then those that
// have the letters of other scripts. Empty: none of those that are known here is installed. O(files).
std::vector<std::filesystem::path> findFonts(const std::vector<std::filesystem::path>& folders);

}  // namespace filiform::internal
