// RangeCache: parts of remote files, kept in a folder on disk. Several processes may use one folder.
//
// Each part is a file DIR/parts-1/XX/XXXXXXXXXXXXXX, named after the checksum of its key. The file holds the key, the
// bytes and a checksum of both, which get() compares. It is written aside and renamed, so a crash leaves no half part
// under such a name. The time of a file's last change is that of its last use: the least recently used parts are
// removed first.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>

namespace filiform::internal {

// Thread rule: internally synchronised, also between processes.
class RangeCache {
 public:
  // Makes the folder, for its owner alone, if it is missing. `most_bytes`: bytes of files, with their headers. A
  // process adds at most a sixteenth of it, or one part, before it removes what is too much. Throws IoError if the
  // folder cannot be made or written.
  RangeCache(const std::string& folder, std::uint64_t most_bytes);

  // Fills `bytes` with the part of this key and size. Returns false if there is none; a damaged one is removed.
  bool get(const std::string& key, std::span<std::uint8_t> bytes);
  // Keeps a part. Ignores failures such as a full disk: the part is then read from the server again. Parts larger than
  // an eighth of `most_bytes` are not kept.
  void put(const std::string& key, std::span<const std::uint8_t> bytes);
  void remove(const std::string& key);

  // Removes the least recently used parts until at most three quarters of `most_bytes` are left, and files of an
  // hour ago that a crash left behind. Returns without effect while another process does it. O(parts).
  void trim();

 private:
  std::string pathOf(const std::string& key) const;

  std::string folder_;
  std::uint64_t most_bytes_;
  std::mutex trimming_;
  std::atomic<std::uint64_t> added_{0};  // bytes since the last trim
  std::atomic<std::uint64_t> serial_{0};
};

}  // namespace filiform::internal
