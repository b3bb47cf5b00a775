// ItemReader: reads one input, a file or an entry of a container, into a cell. Thread rule: thread-compatible; one a
// thread. Several may read the same container.
#pragma once

#include "index/cell/cell.h"
#include "index/containers/internal/container.h"
#include "index/formats/internal/graph_file.h"
#include "index/formats/neuroglancer/internal/segment_properties.h"
#include "index/formats/swc.h"
#include "index/hdf5/internal/hdf5_process.h"

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
  const std::string* source = nullptr;            // named in messages
  const std::string* path = nullptr;              // of the file, if it is no archive
  std::uint64_t bytes = 0;                        // of its content, as listed
  bool estimated = false;                         // `bytes` is a guess
  bool packed = false;                            // a file in gzip
  std::optional<GraphFormat> format;              // of a graph file
  const SkeletonInfo* skeleton = nullptr;         // of a skeleton
  const SegmentProperties* properties = nullptr;  // of skeletons; null: none
  std::uint64_t object = 0;                       // id of the skeleton
  const std::string* morphology = nullptr;        // of an H5 file; an empty name: its only morphology
  const Container* container = nullptr;
  const ArchiveEntry* entry = nullptr;
};

// The content of an input is larger than the guess; thrown only by reading ahead, which had set memory aside.
struct LargerThanEstimated {};

class ItemReader {
 public:
  struct Limits {
    std::uint64_t memory = UINT64_MAX;  // bytes
    double cell_share = 1;              // fraction of `memory` that one cell may take while it is read
    std::size_t open_archives = 1;      // most containers that stay open
  };
  // Throws as SwcOptions::check() does.
  ItemReader(const SwcOptions& options, const Limits& limits);

  // Reads `item` into `cell`: all members except `source`. If the item is refused, `cell` has no samples.
  //
  // `progress` receives the bytes of the file on disk, block by block, sometimes 0; of an entry, at its end. Throws
  // IoError, ConservationError, what `progress` throws, and InputError if the cell exceeds the memory. `ahead`: throws
  // LargerThanEstimated too.
  InputReport read(const InputItem& item, Cell& cell, const std::function<void(std::uint64_t bytes)>& progress,
                   bool ahead = false);
  // Closes all containers, and ends the process that reads HDF5.
  void close() {
    open_.clear();
    hdf5_.stop();
  }

 private:
  InputReport readShape(const InputItem& item, Cell& cell, const std::function<void(std::uint64_t bytes)>& progress);
  void remark(InputCode code, std::string_view token, InputReport& report, Cell& cell) const;
  Container::Reader& readerOf(const Container& container);
  InputReport readH5(const InputItem& item, Cell& cell, const std::function<void(std::uint64_t bytes)>& progress);
  InputReport readEntry(const InputItem& item, Cell& cell, const std::function<void(std::uint64_t bytes)>& progress);
  InputReport readPacked(const InputItem& item, Cell& cell, const std::function<void(std::uint64_t bytes)>& progress);
  void addRemarks(const ArchiveEntry& entry, InputReport& report, Cell& cell) const;
  // Reads content that comes in blocks: `pass` hands them on and returns why the input is refused.
  InputReport readContent(const InputItem& item, std::optional<GraphFormat> format, const SkeletonInfo* skeleton,
                          Cell& cell,
                          const std::function<std::optional<InputCode>(const Container::Reader::Sink&)>& pass);
  void refuseLargeCell(const InputItem& item, std::uint64_t fed) const;
  void refuseBeyondMemory(const InputItem& item, std::uint64_t cell_bytes) const;

  SwcOptions options_;
  Limits limits_;
  SwcReader reader_;
  Hdf5Process hdf5_;
  bool ahead_ = false;
  // The most recently read first.
  std::list<std::pair<const Container*, std::unique_ptr<Container::Reader>>> open_;
};

}  // namespace filiform::internal
