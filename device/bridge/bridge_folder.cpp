#include "device/bridge/bridge_folder.h"

#include "device/bridge/internal/bridge_socket.h"

#include <algorithm>
#include <cstdlib>
#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace filiform {

std::string bridgeCookieFile() {
  const char* const named = std::getenv("FILIFORM_BRIDGE_COOKIE");
  return named != nullptr && named[0] != 0 ? named : bridgeFolder() + "/cookie";
}

std::string bridgeFolder() {
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime != nullptr && runtime[0] == '/') return std::string(runtime) + "/filiform";
  return "/tmp/filiform-" + std::to_string(::geteuid());
}

std::vector<FoundBridge> findBridges() {
  std::vector<FoundBridge> found;
  const std::string folder = bridgeFolder();
  struct stat of {};
  if (::lstat(folder.c_str(), &of) != 0 || !S_ISDIR(of.st_mode) || of.st_uid != ::geteuid()) return found;
  DIR* const entries = ::opendir(folder.c_str());
  if (entries == nullptr) return found;
  while (const dirent* const entry = ::readdir(entries)) {
    const std::string path = folder + "/" + entry->d_name;
    if (!path.ends_with(".bridge") || ::lstat(path.c_str(), &of) != 0 || !S_ISSOCK(of.st_mode)) continue;
    if (of.st_uid != ::geteuid()) continue;
    FoundBridge bridge{path, false};
    try {
      bridge.listens = internal::connectToPath(path).number >= 0;
    } catch (const DeviceError&) {
      bridge.listens = false;
    }
    found.push_back(std::move(bridge));
  }
  ::closedir(entries);
  std::sort(found.begin(), found.end(), [](const FoundBridge& a, const FoundBridge& b) { return a.path < b.path; });
  return found;
}

std::string onlyBridge() {
  std::string only, others;
  for (const FoundBridge& bridge : findBridges()) {
    if (!bridge.listens) continue;
    if (!only.empty()) others += ", bridge:" + bridge.path;
    if (only.empty()) only = bridge.path;
  }
  if (only.empty()) throw DeviceError("no bridge listens in " + bridgeFolder() + "; start one, or give bridge:PATH");
  if (!others.empty()) throw DeviceError("several bridges listen: choose bridge:" + only + others);
  return only;
}

}  // namespace filiform
