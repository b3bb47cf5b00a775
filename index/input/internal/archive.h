// The SWC entries of a zip archive, read in memory through its central directory. Nothing is extracted to disk; entry
// names are only labels.
//
// Thread rule: an Archive is immutable. Archive::Reader is thread-compatible; one a thread.
#pragma once

#include "index/input/input_report.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

struct ArchiveEntry {
  std::uint64_t index = 0;  // position in the central directory
  std::string name;         // raw bytes
  std::string
      label;  // set if it differs from the name: `/` between folders, no root or drive, control characters escaped
  std::uint64_t bytes = 0, packed_bytes = 0;  // as the directory declares
  bool skipped = false;                       // must not be read; the remarks give the reason
  std::vector<InputCode> remarks;             // W_ZIP_...

  const std::string& shown_label() const { return label.empty() ? name : label; }
};

class Archive {
 public:
  static constexpr std::uint64_t kMaxEntryBytes = std::uint64_t{1} << 32;

  // Reads the central directory of the archive at `path`, then closes the file. Throws IoError. O(entries log entries).
  explicit Archive(std::string path);

  // Why the whole archive is refused: E_ZIP_TRUNCATED, E_ZIP_OVERLAP, E_ZIP_FORMAT or E_ZIP_NO_SWC. nullopt if it is
  // not.
  std::optional<InputCode> refusal() const { return refusal_; }
  // Entries that end in .swc, and inner .zip files (skipped, listed only to be reported), in the order of the central
  // directory. Folders, __MACOSX, ._* and all other entries are left out.
  const std::vector<ArchiveEntry>& entries() const { return entries_; }
  std::uint64_t file_bytes() const { return file_bytes_; }
  std::uint64_t digest() const { return digest_; }  // XXH3 of the central directory

  // Reads the entries of one archive, which must outlive it.
  class Reader {
   public:
    explicit Reader(const Archive& archive);
    ~Reader();
    Reader(Reader&&) noexcept;
    Reader& operator=(Reader&&) noexcept;

    // Passes the entry's content to `sink` in blocks, never more than the declared size. Returns nullopt on success.
    // Otherwise returns E_ZIP_CRC, E_ZIP_SIZE, E_ZIP_METHOD or E_ZIP_FORMAT; the caller must then discard what `sink`
    // received. The first call opens the file and reads its directory: some 300 bytes of memory an entry. The file
    // stays open until the end of this object. Requires !entry.skipped. Throws IoError, and what `sink` throws.
    std::optional<InputCode> read(const ArchiveEntry& entry, const std::function<void(std::string_view)>& sink);

   private:
    struct Handle;
    std::optional<InputCode> open();

    const Archive* archive_;
    std::unique_ptr<Handle> handle_;
  };

 private:
  std::string path_;
  std::optional<InputCode> refusal_;
  std::vector<ArchiveEntry> entries_;
  std::uint64_t file_bytes_ = 0, archive_at_ = 0, directory_entries_ = 0, digest_ = 0;
};

}  // namespace filiform
