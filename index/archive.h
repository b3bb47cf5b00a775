// The SWC entries of a zip archive, read in memory through its central directory: nothing is ever extracted, names are
// labels only.
//
// Thread-compatible: one Archive a thread.
#pragma once

#include "index/input_report.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

struct ArchiveEntry {
  std::uint64_t index = 0;  // in the central directory
  std::string name;         // raw bytes
  std::string
      label;  // where it differs from the name: `/` between folders, no root or drive, control characters escaped
  std::uint64_t bytes = 0, packed_bytes = 0;  // as declared
  bool skipped = false;                       // not to be read; the remarks say why
  std::vector<InputCode> remarks;             // W_ZIP_...

  const std::string& shown_label() const { return label.empty() ? name : label; }
};

class Archive {
 public:
  static constexpr std::uint64_t kMaxEntryBytes = std::uint64_t{1} << 32;

  // Reads the directory of the archive at `path`; the file is not kept open. Throws IoError. O(entries log entries).
  explicit Archive(std::string path);
  ~Archive();
  Archive(Archive&&) noexcept;
  Archive& operator=(Archive&&) noexcept;

  // Why nothing can be read from it: E_ZIP_TRUNCATED, E_ZIP_OVERLAP, E_ZIP_FORMAT or E_ZIP_NO_SWC.
  std::optional<InputCode> refusal() const { return refusal_; }
  // In the order of the directory: what ends in .swc, and inner .zip files to be named. Folders, __MACOSX, ._* and all
  // else are not there.
  const std::vector<ArchiveEntry>& entries() const { return entries_; }
  std::uint64_t file_bytes() const { return file_bytes_; }
  std::uint64_t digest() const { return digest_; }  // XXH3 of the central directory

  // Hands the entry's content to `sink` in blocks. What the sink got counts only if the answer is empty; otherwise it
  // says why not: E_ZIP_CRC, E_ZIP_SIZE, E_ZIP_METHOD or E_ZIP_FORMAT. Never hands over more than the declared size.
  // Opens the file when it is not open. Requires !entry.skipped. Throws IoError, and what `sink` throws.
  std::optional<InputCode> read(const ArchiveEntry& entry, const std::function<void(std::string_view)>& sink);

  // Closes the file until the next read().
  void close();

 private:
  struct Handle;
  std::string path_;
  std::optional<InputCode> refusal_;
  std::vector<ArchiveEntry> entries_;
  std::uint64_t file_bytes_ = 0, archive_at_ = 0, directory_entries_ = 0, digest_ = 0;
  std::unique_ptr<Handle> handle_;
};

}  // namespace filiform
