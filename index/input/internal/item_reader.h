// ItemReader: reads one input, a file or an entry of an archive, into a cell. Thread rule: thread-compatible; one a
// thread. Several may read the same archive.
#pragma once

#include "index/cell/cell.h"
#include "index/input/internal/archive.h"
#include "index/input/internal/graph_file.h"
#include "index/input/internal/hdf5_process.h"
#include "index/input/swc.h"

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace filiform::internal {

// One input.
struct InputItem {
  const std::string* source = nullptr;      // named in messages
  const std::string* path = nullptr;        // of the file, if it is no archive
  std::uint64_t bytes = 0;                  // of the file or the entry, as listed
  std::optional<GraphFormat> format;        // of a graph file
  const SkeletonInfo* skeleton = nullptr;   // of a skeleton
  const std::string* morphology = nullptr;  // of an H5 file; an empty name: its only morphology
  const Archive* archive = nullptr;
  const ArchiveEntry* entry = nullptr;
};

class ItemReader {
 public:
  struct Limits {
    std::uint64_t memory = UINT64_MAX;  // bytes
    double cell_share = 1;              // fraction of `memory` that one cell may take while it is read
    std::size_t open_archives = 1;      // most archives that stay open
  };
  // Throws as SwcOptions::check() does.
  ItemReader(const SwcOptions& options, const Limits& limits);

  // Reads `item` into `cell`: all members except `source`. If the item is refused, `cell` has no samples.
  //
  // `progress` receives the bytes of the file on disk, block by block, sometimes 0; of an entry, at its end. Throws
  // IoError, ConservationError, what `progress` throws, and InputError if the cell exceeds the memory.
  InputReport read(const InputItem& item, Cell& cell, const std::function<void(std::uint64_t bytes)>& progress);
  // Closes all archives, and ends the process that reads HDF5.
  void close() {
    open_.clear();
    hdf5_.stop();
  }

 private:
  Archive::Reader& openArchive(const Archive& archive);
  InputReport readH5(const InputItem& item, Cell& cell, const std::function<void(std::uint64_t bytes)>& progress);
  InputReport readEntry(const InputItem& item, Cell& cell, const std::function<void(std::uint64_t bytes)>& progress);
  void refuseLargeCell(const InputItem& item, std::uint64_t fed) const;
  void refuseBeyondMemory(const InputItem& item, std::uint64_t cell_bytes) const;

  SwcOptions options_;
  Limits limits_;
  SwcReader reader_;
  Hdf5Process hdf5_;
  std::list<std::pair<const Archive*, Archive::Reader>> open_;  // the most recently read first
};

}  // namespace filiform::internal
