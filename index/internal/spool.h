// Bytes put aside: in memory up to a share, in one file beyond it. The file loses its name as soon as it is open, so
// that nothing is left of it however the program ends.
#pragma once

#include "index/internal/bytes.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace filiform::internal {

// Blocks of equal size, given out and taken back. Thread rule: internally synchronised.
class Spool {
 public:
  // Readers may load this many bytes beyond the used ones of a block.
  static constexpr std::size_t kSlack = 16;

  // The file is made in `folder` when more than `memory_bytes` are stored; with an empty name, never.
  Spool(std::string folder, std::size_t block_bytes, std::uint64_t memory_bytes);
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;
  ~Spool();

  std::size_t block_bytes() const { return block_bytes_; }
  std::uint64_t file_bytes() const;  // the most that the file has held
  std::uint64_t blocks() const;      // stored and not released, the most that there were
  void trim();                       // frees the buffers that are kept for later

  using Buffer = std::unique_ptr<std::uint8_t[]>;
  struct Block {
    std::uint64_t at;  // of the file; unused in memory
    std::uint32_t used;
    Buffer memory;  // null in the file
  };
  Buffer buffer();  // of block_bytes() + kSlack
  void giveBack(Buffer buffer) noexcept;
  // Stores the first `used` bytes; `filled` is then null, or still the caller's, to be written over. Throws IoError.
  Block store(Buffer& filled, std::size_t used);
  // The block's bytes: its memory, or read into `scratch` (buffer() if null). Throws IoError.
  const std::uint8_t* load(const Block& block, Buffer& scratch) const;
  void release(Block& block) noexcept;  // a second time does nothing

 private:
  std::string folder_;
  std::size_t block_bytes_;
  std::uint64_t memory_blocks_;  // that may still be stored in memory
  mutable std::mutex mutex_;
  int file_ = -1;
  std::uint64_t file_end_ = 0;       // in blocks
  std::vector<std::uint64_t> free_;  // of the file
  std::vector<Buffer> spare_;
  std::uint64_t stored_ = 0, most_stored_ = 0;
};

// A sequence of bytes in a spool, written once and then read. Thread-compatible. Either append() or reserve() and
// commit(), not both.
class Chain {
 public:
  explicit Chain(Spool& spool) : spool_(&spool) {}

  std::uint64_t bytes() const { return stored_bytes_ + used_; }

  // Room for `most` bytes in one piece, most <= block_bytes.
  std::uint8_t* reserve(std::size_t most) {
    if (!current_ || used_ + most > spool_->block_bytes()) turn();
    return current_.get() + used_;
  }
  bool isOpen() const { return current_ != nullptr; }  // has a buffer
  void commit(std::size_t n) { used_ += static_cast<std::uint32_t>(n); }
  // Number of blocks begun.
  std::size_t blocks_begun() const { return blocks_.size() + (current_ ? 1 : 0); }
  // Anywhere, cut where a block ends.
  void append(ByteSpan bytes);
  // Gives up the buffer. Required before reading; what is appended later begins a new block.
  void close();

  // One block after the other. With `release` the bytes are gone once the next is asked for.
  class Reader {
   public:
    Reader(Chain& chain, bool release) : chain_(&chain), release_(release) {}
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
    ~Reader();
    // Bytes of the next block, kSlack more may be loaded; empty at the end. Throws IoError.
    ByteSpan next();
    // The next n bytes, whatever the blocks. Requires that there are so many. Throws IoError.
    void read(std::uint8_t* to, std::size_t n);

   private:
    Chain* chain_;
    bool release_;
    std::size_t at_ = 0;
    ByteSpan rest_;
    Spool::Buffer scratch_;
  };
  // Bytes from `offset` on, of a closed chain that was written by append(). Throws IoError.
  void read(std::uint64_t offset, std::span<std::uint8_t> to, Spool::Buffer& scratch) const;
  void clear();

 private:
  void turn();
  Spool* spool_;
  std::vector<Spool::Block> blocks_;
  std::uint64_t stored_bytes_ = 0;
  Spool::Buffer current_;
  std::uint32_t used_ = 0;
};

}  // namespace filiform::internal
