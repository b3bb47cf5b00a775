// PairSorter: takes the pairs of a search in any order, and gives them back sorted, two cells at a time. What exceeds
// its memory goes to an unnamed file, in sorted runs.
#pragma once

#include "index/contacts/internal/contact_pair.h"
#include "index/file/internal/unnamed_file.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <vector>

namespace filiform::internal {

class PairSorter {
 public:
  PairSorter(std::uint64_t memory_bytes, unsigned workers);

  // Thread rule: one thread a worker. Throws IoError if the disk is full.
  void add(std::size_t worker, const ContactPair& pair) {
    std::vector<ContactPair>& buffer = buffers_[worker];
    if (buffer.size() == most_buffered_) spill(buffer);
    if (buffer.size() == buffer.capacity()) buffer.reserve(std::min(most_buffered_, 2 * buffer.size() + 64));
    buffer.push_back(pair);
  }
  std::uint64_t file_bytes() const { return file_end_; }
  std::uint64_t pairs() const;

  // Calls visit(pairs) for each two cells that have any: ascending by cells; pairs ascend by segments, and each comes
  // once. Call it once, after the last add(). Throws InputError if the pairs of two cells exceed the memory; IoError.
  void forEachCellPair(const std::function<void(std::span<const ContactPair>)>& visit);

 private:
  struct Run {
    std::uint64_t at, count;  // in the file, bytes; pairs
  };
  class Source;
  void spill(std::vector<ContactPair>& buffer);

  const std::uint64_t memory_bytes_;
  std::size_t most_buffered_;
  std::vector<std::vector<ContactPair>> buffers_;  // by worker
  std::mutex mutex_;
  UnnamedFile file_{"", "pairs of contacts"};
  std::vector<Run> runs_;
  std::uint64_t file_end_ = 0;
};

}  // namespace filiform::internal
