// Spool: stores bytes in memory up to a share, and beyond it in one unnamed file.
#pragma once

#include "index/file/internal/bytes.h"
#include "index/file/internal/unnamed_file.h"

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace filiform::internal {

// Stores blocks of equal size. Thread rule: internally synchronised.
class Spool {
 public:
  // Readers may load this number of bytes after the used bytes of a block.
  static constexpr std::size_t kSlack = 16;

  // Creates the file in `folder` once more than `memory_bytes` are stored; with an empty name, never. `content`: as of
  // UnnamedFile.
  Spool(std::string folder, std::size_t block_bytes, std::uint64_t memory_bytes,
        std::string content = "the working file of ingest");
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  std::size_t block_bytes() const { return block_bytes_; }
  std::uint64_t file_bytes() const;  // largest size of the file
  std::uint64_t blocks() const;      // largest number of blocks stored at a time
  void trim();                       // frees the buffers kept for reuse

  using Buffer = std::unique_ptr<std::uint8_t[]>;
  struct Block {
    std::uint64_t at;  // position in the file; unused in memory
    std::uint32_t used;
    Buffer memory;  // nullptr if in the file
  };
  Buffer buffer();  // of block_bytes() + kSlack
  void giveBack(Buffer buffer) noexcept;
  // Stores the first `used` bytes. `filled` is afterwards null, or still belongs to the caller, who may overwrite it.
  // Throws IoError.
  Block store(Buffer& filled, std::size_t used);
  // The block's bytes: its memory, or read into `scratch` (buffer() if null). Throws IoError.
  const std::uint8_t* load(const Block& block, Buffer& scratch);
  void release(Block& block) noexcept;  // a second call does nothing
  // Moves a block from memory to the file; no other block gets its memory. Requires a folder. Throws IoError.
  void spill(Block& block);

 private:
  std::uint64_t placeInFile();  // the caller holds the mutex
  std::size_t block_bytes_;
  std::uint64_t memory_blocks_;  // number of blocks that still fit in memory
  mutable std::mutex mutex_;
  UnnamedFile file_;
  std::uint64_t file_end_ = 0;       // in blocks
  std::vector<std::uint64_t> free_;  // of the file
  std::vector<Buffer> spare_;
  std::uint64_t stored_ = 0, most_stored_ = 0;
};

// A sequence of bytes in a spool, written once and then read. Use either append(), or reserve() and commit(). Thread
// rule: thread-compatible.
class ByteChain {
 public:
  explicit ByteChain(Spool& spool) : spool_(&spool) {}

  std::uint64_t bytes() const { return stored_bytes_ + used_; }

  // Returns room for `most` contiguous bytes. Requires most <= block_bytes.
  std::uint8_t* reserve(std::size_t most) {
    if (!current_ || used_ + most > spool_->block_bytes()) turn();
    return current_.get() + used_;
  }
  bool isOpen() const { return current_ != nullptr; }  // has a buffer
  void commit(std::size_t n) { used_ += static_cast<std::uint32_t>(n); }
  // Number of blocks begun.
  std::size_t blocks_begun() const { return blocks_.size() + (current_ ? 1 : 0); }
  // Appends bytes; they may continue in the next block.
  void append(ByteSpan bytes);
  // Releases the buffer. Call it before reading; later bytes begin a new block.
  void close();
  // Appends the blocks of another chain of the same spool, which is then empty. Both are closed. Offsets of read() hold
  // only for chains without this. O(blocks).
  void take(ByteChain& other);

  // Reads block by block. With `release`, a block's bytes are freed when the next is requested.
  class Reader {
   public:
    Reader(ByteChain& chain, bool release) : chain_(&chain), release_(release) {}
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
    ~Reader();
    // Bytes of the next block, empty at the end; kSlack more may be loaded. Throws IoError.
    ByteSpan next();
    // Reads the next n bytes, across blocks. Requires that there are n bytes. Throws IoError.
    void read(std::uint8_t* to, std::size_t n);

   private:
    ByteChain* chain_;
    bool release_;
    std::size_t at_ = 0;
    ByteSpan rest_;
    Spool::Buffer scratch_;
  };
  // Reads bytes from `offset` on, of a closed chain written by append(). Throws IoError.
  void read(std::uint64_t offset, std::span<std::uint8_t> to, Spool::Buffer& scratch) const;
  void clear();
  void spill();  // moves the blocks of a closed chain to the file, as Spool::spill()

 private:
  void turn();
  Spool* spool_;
  std::vector<Spool::Block> blocks_;
  std::uint64_t stored_bytes_ = 0;
  Spool::Buffer current_;
  std::uint32_t used_ = 0;
};

}  // namespace filiform::internal
