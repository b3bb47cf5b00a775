// An archive whose files may hold several cells, or need a place in the file system: MouseLight, CATMAID, NML, H5. The
// cells of these files are its entries, named `FILE/CELL`; the cell of an H5 file of one is named like the file. Each
// such file is unpacked into memory while it is listed or read, one at a time for each reader. Thread rule: as
// Container.
#pragma once

#include "index/containers/internal/container.h"
#include "index/hdf5/internal/hdf5_process.h"

#include <functional>
#include <memory>
#include <vector>

namespace filiform::internal {

class ArchiveFiles final : public Container {
 public:
  // Puts the cells of its files in the place of the files, if the archive holds such files. A file that begins like
  // another kind of file is passed over; one that cannot be read, or that is larger than 256 MiB or an eighth of
  // `memory`, becomes a skipped entry with its refusal. `progress` is called between blocks. Throws IoError if the
  // process has no file descriptor or memory left, and what `progress` throws.
  static std::unique_ptr<Container> open(std::unique_ptr<Container> archive, std::uint64_t memory, Hdf5Process& hdf5,
                                         const std::function<void()>& progress);

  std::uint64_t reader_bytes() const override;
  std::unique_ptr<Reader> reader() const override;

 private:
  class FilesReader;
  ArchiveFiles(std::unique_ptr<Container> archive, std::uint64_t most_bytes, Hdf5Process& hdf5,
               const std::function<void()>& progress);
  void add(ArchiveEntry entry, Reader& reader, Hdf5Process& hdf5, const std::function<void()>& progress);
  void addCells(const ArchiveEntry& entry, const std::vector<ArchiveEntry>& cells);

  std::unique_ptr<Container> archive_;
  const std::uint64_t most_bytes_;   // of a file
  std::uint64_t largest_ = 0;        // file, bytes
  std::vector<ArchiveEntry> files_;  // by ArchiveEntry::file - 1; 0: the archive
};

}  // namespace filiform::internal
