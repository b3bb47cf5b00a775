// PairSorter: takes the pairs of a search in any order, and gives them back sorted, two cells at a time. It keeps them
// in blocks (pair_codec.h). What exceeds its memory goes to an unnamed file, in runs of blocks that ascend by cells.
#pragma once

#include "index/contacts/internal/pair_codec.h"
#include "index/file/internal/unnamed_file.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

namespace filiform::internal {

class PairSorter {
 public:
  // `are_counted`: as encodePairs() has it.
  PairSorter(std::uint64_t memory_bytes, unsigned workers, bool are_counted);

  // Sorts the pairs. Few calls with many pairs of the same cells take the least memory. Thread rule: one thread a
  // worker. Throws IoError if the disk is full.
  void add(std::size_t worker, std::span<ContactPair> pairs);
  std::uint64_t file_bytes() const { return file_end_; }
  std::uint64_t pairs() const;

  // Calls visit(pairs) for each two cells that have any: ascending by cells; pairs ascend by segments, and each comes
  // once. Call it once, after the last add(). Throws InputError if the pairs of two cells exceed the memory; IoError.
  void forEachCellPair(const std::function<void(std::span<const ContactPair>)>& visit);

 private:
  struct Kept {  // a block in memory
    std::uint64_t cells;
    const std::uint8_t* at;
  };
  struct Buffer {  // of a worker
    std::vector<std::unique_ptr<std::uint8_t[]>> pages;
    std::uint8_t* at = nullptr;  // in the last page
    std::size_t left = 0;        // of the last page
    std::vector<Kept> blocks;
    std::uint64_t pairs = 0;  // of all add()
  };
  struct Run {
    std::uint64_t begin, end;  // in the file, bytes
  };
  class Source;
  void keep(Buffer& buffer, std::span<const ContactPair> pairs);
  static void sortBlocks(Buffer& buffer);
  void spill(Buffer& buffer);

  const std::uint64_t memory_bytes_;
  const bool are_counted_;
  const std::size_t page_bytes_, most_pages_;  // most: of a worker
  std::vector<Buffer> buffers_;                // by worker
  std::mutex mutex_;
  UnnamedFile file_{"", "pairs of contacts"};
  std::vector<Run> runs_;
  std::uint64_t file_end_ = 0;
};

}  // namespace filiform::internal
