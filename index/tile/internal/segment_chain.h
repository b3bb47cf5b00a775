// SegmentChain: stores segments in a spool, in about 13 bytes each if they come in runs, as from a reader.
#pragma once

#include "index/file/internal/spool.h"
#include "index/tile/tile.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <utility>

namespace filiform::internal {

struct SegmentRecord {
  SegmentId id;
  std::uint32_t child_sample, parent_sample;  // equal: isolated
  GridPoint child, parent;
  float radius_um;  // of the child
  std::uint16_t type;
};

// Written once, then read any number of times. Thread rule: thread-compatible.
//
// A record is stored as a difference from the one before: a byte of flags, a byte with the widths of two steps (4 bits
// each, bytes a coordinate), then the values that the flags leave open. The bytes never leave the program.
class SegmentChain {
 public:
  explicit SegmentChain(Spool& spool) : chain_(spool) {}

  void add(const SegmentRecord& record);
  void close() { chain_.close(); }
  // Appends the records of another chain of the same spool, which is then empty. Both are closed. O(blocks).
  void take(SegmentChain& other) {
    chain_.take(other.chain_);
    count_ += std::exchange(other.count_, 0);
  }
  bool isOpen() const { return chain_.isOpen(); }  // has a buffer
  std::uint64_t count() const { return count_; }
  std::uint64_t bytes() const { return chain_.bytes(); }
  void clear() { chain_.clear(), count_ = 0; }

  class Reader {
   public:
    Reader(SegmentChain& chain, bool release) : blocks_(chain.chain_, release) {}
    bool next(SegmentRecord& record);  // false at the end; `record` must be unchanged since the last call

   private:
    ByteChain::Reader blocks_;
    const std::uint8_t* at_ = nullptr;
    const std::uint8_t* end_ = nullptr;
  };
  // The encoded bytes. Each block of them can be read alone.
  ByteChain& bytes_chain() { return chain_; }
  // Calls use(record) for each record of a block. Spool::kSlack more bytes must be readable.
  template <typename Use>
  static void forEach(ByteSpan block, const Use& use) {
    SegmentRecord record = first();
    for (const std::uint8_t *at = block.data(), *const end = at + block.size(); at != end;) {
      decode(at, record);
      use(record);
    }
  }

 private:
  static void decode(const std::uint8_t*& at, SegmentRecord& record);

  ByteChain chain_;
  SegmentRecord last_ = first();
  std::uint64_t count_ = 0;

 public:
  // The base of the first record of every block.
  static SegmentRecord first() { return {{0, 0}, 0, 0, GridPoint::Zero(), GridPoint::Zero(), 0, 0}; }
};

}  // namespace filiform::internal
