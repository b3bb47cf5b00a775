// TileSource: where the bytes of a tile set come from. It reads byte ranges of named, immutable files. It does not list
// files, so an object store can serve as well as a folder.
#pragma once

#include "index/errors.h"
#include "index/file/remote_counters.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace filiform {

// Thread rule: internally synchronised.
class TileSource {
 public:
  virtual ~TileSource() = default;

  // Size of the file, bytes. Throws IoError if the file is missing or unreadable.
  virtual std::uint64_t size(const std::string& name) const = 0;
  // Fills all of `bytes`, starting at `offset` of the file. Throws IoError, or CorruptSet if the file ends too soon.
  virtual void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const = 0;
  // States that the file will be read later and has this size. A folder opens it, so that it stays readable if it is
  // removed meanwhile, and throws IoError if it is missing and CorruptSet if its size differs. An object store, where a
  // request is slow, need not do anything.
  virtual void expect(const std::string&, std::uint64_t) const {}
  // True if reads travel over a network: each takes long, but several may be under way at once.
  virtual bool isRemote() const { return false; }
  // What was asked of a server so far; nullopt: there is none.
  virtual std::optional<RemoteCounters> remoteCounters() const { return std::nullopt; }
  // States that these bytes were damaged. Returns true if another read may give others, because copies of them were
  // removed or because a transfer may have damaged them.
  virtual bool discard(const std::string&, std::uint64_t, std::uint64_t) const { return false; }
  // The file's name for messages: a path or an address.
  virtual std::string describe(const std::string& name) const = 0;
};

// True for valid names: relative paths of [A-Za-z0-9/._-] whose parts are not empty and do not start with a dot.
bool isTileFileName(const std::string& name);

// Reads the files below a folder. A file is opened at first use. It stays open while it is being read or is one of the
// `most_open` files used last. 0: half of the process's limit of file descriptors (RLIMIT_NOFILE), at least one. If the
// process has no descriptor left, the least recently used file is closed first.
//
// An open file stays readable even if a newer revision replaces it. A closed file is reopened in the same folder and
// must be the same file (device and inode); otherwise IoError says that the set was replaced. Throws IoError if there
// is no such folder, UsageError for an invalid file name.
std::unique_ptr<TileSource> openFolder(const std::string& folder, std::size_t most_open = 0);

}  // namespace filiform
