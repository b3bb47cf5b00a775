// Revision: the manifest of the revision that CURRENT names, and its files.
#pragma once

#include "index/errors.h"
#include "index/file/internal/set_files.h"
#include "index/file/tile_source.h"
#include "index/set/internal/manifest.h"

#include <map>
#include <memory>
#include <span>
#include <string>

namespace filiform::internal {

// Calls a decoder of the file's bytes from `offset` on, and adds file and offset to its Damage.
template <typename Decode>
auto decoded(const std::string& file, std::uint64_t offset, Decode decode) {
  try {
    return decode();
  } catch (const Damage& damage) {
    throw CorruptSet(file, offset + damage.offset, damage.what);
  }
}

// Thread rule: internally synchronised. Its members throw IoError, CorruptSet.
class Revision {
 public:
  // Reads CURRENT, unless `wanted` names a revision, and the manifest. Calls TileSource::expect() for the other files.
  // Throws InputError for a set of another format version, IoError if `wanted` is no longer there.
  explicit Revision(std::unique_ptr<TileSource> source, const std::string& wanted = {});

  const std::string& name() const { return name_; }  // of the revision's folder
  const std::string& text() const { return text_; }  // of the manifest
  const Manifest& manifest() const { return manifest_; }

  const SetFile* find(const std::string& file) const;  // nullptr if the manifest does not list it
  const SetFile& file(const std::string& file) const;  // throws CorruptSet if the manifest does not list it
  std::string describe(const std::string& file) const;
  // Both read a part of a file, unchecked. The second reads large parts piece by piece, so that memory follows the
  // bytes that arrive, not those that the set states.
  void read(const std::string& file, std::uint64_t offset, std::span<std::uint8_t> bytes) const;
  Bytes read(const std::string& file, std::uint64_t offset, std::uint64_t bytes) const;
  // Reads a part of a file. Throws CorruptSet if its checksum differs; `part` names it in the message.
  Bytes readChecked(const std::string& file, std::uint64_t offset, std::uint64_t bytes, std::uint64_t checksum,
                    const std::string& part) const;
  std::uint64_t sizeOnDisk(const std::string& file) const;
  bool isRemote() const { return source_->isRemote(); }
  std::optional<RemoteCounters> remoteCounters() const { return source_->remoteCounters(); }
  bool discard(const std::string& file, std::uint64_t offset, std::uint64_t bytes) const;  // as TileSource
  // Reads a part of a file and returns decode(ByteSpan). After Damage, reads once more if discard() allows it.
  template <typename Decode>
  auto readDecoded(const std::string& file, std::uint64_t offset, std::uint64_t bytes, Decode decode) const {
    for (bool again = false;; again = true) {
      const Bytes part = read(file, offset, bytes);
      try {
        return decoded(describe(file), offset, [&] { return decode(ByteSpan(part)); });
      } catch (const CorruptSet&) {
        if (again || !discard(file, offset, bytes)) throw;
      }
    }
  }

 private:
  std::string readCurrent() const;
  void readManifest();
  std::string key(const std::string& file) const;

  std::unique_ptr<TileSource> source_;
  std::string name_, text_;
  Manifest manifest_;
  std::map<std::string, const SetFile*> files_;
};

}  // namespace filiform::internal
