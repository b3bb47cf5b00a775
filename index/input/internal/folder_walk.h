// Lists the files below a folder. Follows symbolic links. Thread rule: pure functions, any thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

struct WalkedFile {
  std::string path;        // path for the system
  std::string shown;       // path below the folder, parts joined by '/'; raw bytes
  std::string unreadable;  // why it cannot be read; empty for a regular file
  bool wanted = true;      // by its name
};

enum class WalkDepth { folder_only, all };

// Lists the files below `folder` in byte order of `shown`; `wanted` accepts names. `._*` and what lies below `__MACOSX`
// are not wanted.
//
// Lists each real file (device and inode) once and enters each real folder once, under its lowest path in byte order.
// So a link back to a folder ends there. Files that are not wanted are not looked up. Unreadable entries are listed
// with the reason:
//   - a folder that cannot be listed
//   - a wanted file that cannot be looked up, or that is a pipe or a device
//   - a link without a target, if its name is wanted or has no ending (the target may have been a folder)
//
// Throws IoError if the process has no file descriptor or memory left. O(files log files) and one look-up a wanted
// name.
std::vector<WalkedFile> walkFolder(const std::string& folder, bool (*wanted)(std::string_view file_name),
                                   WalkDepth depth = WalkDepth::all);

}  // namespace filiform::internal
