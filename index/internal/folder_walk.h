// The files below a folder that hold cells, by name. Follows symbolic links. Stateless: any thread may call.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

struct WalkedFile {
  std::string path;        // as the system opens it
  std::string shown;       // below the folder, parts joined by '/'; raw bytes
  std::string unreadable;  // why it cannot be read; empty for a regular file
};

enum class WalkDepth { folder_only, all };

// The files below `folder` whose name `wanted` accepts, in byte order of `shown`. Never enters or lists `._*` and
// `__MACOSX`.
//
// A real file (device and inode) is listed once, and a real folder is entered once, each under its lowest path in byte
// order; so a link that leads back to a folder ends there. What cannot be read is listed with the reason: a folder that
// cannot be listed, a wanted file that cannot be looked up or that is a pipe or a device, and a link without a target
// whose name is wanted or has no ending (its target may have been a folder).
// Throws IoError if the process has no file descriptor or memory left. O(files log files) and one look-up a name.
std::vector<WalkedFile> walkFolder(const std::string& folder, bool (*wanted)(std::string_view file_name),
                                   WalkDepth depth = WalkDepth::all);

}  // namespace filiform::internal
