// The inputs of a zip archive, read in memory through its central directory. Nothing is extracted to disk; entry names
// are only labels.
//
// Thread rule: as Container.
#pragma once

#include "index/containers/internal/container.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace filiform {

class Archive final : public Container {
 public:
  // Reads the central directory of the archive at `path`, then closes the file. Its entries are those that
  // internal::entryOfName() gives, in the order of the central directory. Refusals: E_ZIP_TRUNCATED, E_ZIP_OVERLAP,
  // E_ZIP_FORMAT or E_ZIP_NO_SWC. Throws IoError. O(entries log entries).
  explicit Archive(std::string path);

  std::uint64_t reader_bytes() const override { return 512 * entries_.size(); }
  std::unique_ptr<Container::Reader> reader() const override;

  class Reader final : public Container::Reader {
   public:
    explicit Reader(const Archive& archive);
    ~Reader() override;

    // Refusals: E_ZIP_CRC, E_ZIP_SIZE, E_ZIP_METHOD or E_ZIP_FORMAT. The first call also reads the directory: some 300
    // bytes of memory an entry.
    std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) override;

   private:
    struct Handle;
    std::optional<InputCode> open();

    const Archive* archive_;
    std::unique_ptr<Handle> handle_;
  };

 private:
  std::string path_;
  std::uint64_t archive_at_ = 0, directory_entries_ = 0;
};

}  // namespace filiform
