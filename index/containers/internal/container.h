// Files that hold many inputs: archives, shards of skeletons, files with several neurons. Nothing is extracted to disk;
// names of entries are only labels.
//
// Thread rule: a Container is immutable once it is listed. Container::Reader is thread-compatible; one a thread.
#pragma once

#include "index/containers/internal/file_kind.h"
#include "index/containers/versions.h"
#include "index/formats/internal/graph_file.h"
#include "index/reports/input_report.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

struct ArchiveEntry {
  std::uint64_t index = 0;  // place in the container, as the container counts
  std::string name;         // raw bytes
  std::string
      label;  // set if it differs from the name: `/` between folders, no root or drive, control characters escaped
  std::uint64_t bytes = 0, packed_bytes = 0;  // as the container declares
  std::optional<GraphFormat> format = {};     // SWC if empty
  bool skipped = false;                       // must not be read; the remarks give the reason
  bool passed = false;                        // skipped too: holds no cell, or is of a format that is not read
  std::vector<InputCode> remarks = {};        // W_ZIP_..., OTHER_VERSION; E_... of a file that holds several cells
  std::string refusal_token = {};             // of that file, escaped
  internal::FileKind kind = internal::FileKind::cell;  // of a file inside, or of the file that holds the cell
  std::string morphology = {};                         // its name in an H5 file
  std::uint32_t file = 0;                              // the file that holds it (archive_files.h)

  const std::string& shown_label() const { return label.empty() ? name : label; }
};

class Container {
 public:
  static constexpr std::uint64_t kMaxEntryBytes = std::uint64_t{1} << 32;

  Container() = default;
  Container(const Container&) = delete;
  Container& operator=(const Container&) = delete;
  virtual ~Container() = default;

  // Why the whole container is refused, and what was wrong with it, escaped; nullopt if it is not refused.
  std::optional<InputCode> refusal() const { return refusal_; }
  const std::string& refusal_token() const { return refusal_token_; }
  // The inputs, and what looks like one but must not be read, in the order of the container.
  const std::vector<ArchiveEntry>& entries() const { return entries_; }
  std::uint64_t file_bytes() const { return file_bytes_; }
  // XXH3 of what lists the entries, such as the central directory.
  std::uint64_t digest() const { return digest_; }
  // The info of its skeletons; null if it holds none.
  virtual const SkeletonInfo* skeletons() const { return nullptr; }
  // Memory, bytes, that a reader holds beside the entry that it reads.
  virtual std::uint64_t reader_bytes() const { return 0; }

  // Reads the entries of one container, which must outlive it.
  class Reader {
   public:
    using Sink = std::function<void(std::string_view)>;

    Reader() = default;
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
    virtual ~Reader() = default;

    // Passes the entry's content to `sink` in blocks, never more than the declared size unless that is 0. Returns
    // nullopt on success. Otherwise returns the reason; the caller must then discard what `sink` received. The first
    // call opens the file, which stays open until the end of this object. Requires !entry.skipped. Throws IoError, and
    // what `sink` throws.
    virtual std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) = 0;
    // A path of the H5 file inside an archive that holds the entry, valid until the next call. Throws IoError.
    virtual std::string h5PathOf(const ArchiveEntry&) { return {}; }
    // Frees what it keeps for the next entry. Another container is read now.
    virtual void release() {}
  };
  // Null for an H5 file (h5_container.h).
  virtual std::unique_ptr<Reader> reader() const = 0;

  // Skips the entries that `versions` leaves out.
  void leaveOut(MorphologyVersion versions);

 protected:
  void refuse(InputCode code, std::string_view token = {});
  // Marks entries whose label came before, and refuses a container without any entry to read.
  void finishListing();
  void refuseWithoutInput();

  std::optional<InputCode> refusal_;
  std::string refusal_token_;
  std::vector<ArchiveEntry> entries_;
  std::uint64_t file_bytes_ = 0, digest_ = 0;
};

}  // namespace filiform
