// Where the bytes of a tile set come from: named, immutable files, read by range. No listing, so that an object store
// serves as well as a folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace filiform {

// Thread rule: internally synchronised.
class TileSource {
 public:
  virtual ~TileSource() = default;

  // Bytes in the file. Throws IoError when it is missing or unreadable.
  virtual std::uint64_t size(const std::string& name) const = 0;
  // Fills all of `bytes` from `offset` on. Throws IoError; CorruptSet when the file ends before.
  virtual void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const = 0;
  // What messages call the file: a path, an address.
  virtual std::string describe(const std::string& name) const = 0;
};

// Relative paths of [A-Za-z0-9/._-] whose parts are neither empty nor start with a dot.
bool isTileFileName(const std::string& name);

// The files below a folder, by pread. A file is opened when it is first asked for, and stays open while it is among the
// `most_open` files used last, or is being read. 0: half of the process's limit of file descriptors (RLIMIT_NOFILE), at
// least one. A file that is open can be read to the end even when a newer revision replaces it. A file that was closed
// is opened again in the same folder, held open, and must be the same file (device and inode); otherwise IoError says
// that the set was replaced. If the process has no descriptor left, the file used least recently is closed first.
// Throws IoError when there is no such folder, UsageError for an impossible name.
std::unique_ptr<TileSource> openFolder(const std::string& folder, std::size_t most_open = 0);

}  // namespace filiform
