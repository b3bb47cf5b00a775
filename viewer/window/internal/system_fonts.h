// Finds font files of the system, for letters that the built-in font lacks. Thread rule: any thread. Reads folders.
#pragma once

#include <filesystem>
#include <vector>

namespace filiform::internal {

// The folders that fontconfig uses by default: fonts/ in $XDG_DATA_HOME and in each of $XDG_DATA_DIRS, and ~/.fonts.
std::vector<std::filesystem::path> fontFolders();

// The fonts for the window, from these folders and their subfolders: first the main font, then fonts for other scripts.
// Empty if no font that filiform knows is installed. O(files).
std::vector<std::filesystem::path> findFonts(const std::vector<std::filesystem::path>& folders);

}  // namespace filiform::internal
