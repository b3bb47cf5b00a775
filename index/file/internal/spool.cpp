#include "index/file/internal/spool.h"

#include "index/internal/heap.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <iterator>
#include <new>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kReleased = UINT64_MAX;

}  // namespace

Spool::Spool(std::string folder, std::size_t block_bytes, std::uint64_t memory_bytes, std::string content)
    : block_bytes_(block_bytes),
      memory_blocks_(folder.empty() ? UINT64_MAX : memory_bytes / block_bytes),
      file_(std::move(folder), std::move(content)) {}

std::uint64_t Spool::file_bytes() const {
  const std::lock_guard lock(mutex_);
  return file_end_ * block_bytes_;
}

std::uint64_t Spool::blocks() const {
  const std::lock_guard lock(mutex_);
  return most_stored_;
}

void Spool::trim() {
  const std::lock_guard lock(mutex_);
  spare_ = std::vector<Buffer>();
}

Spool::Buffer Spool::buffer() {
  {
    const std::lock_guard lock(mutex_);
    if (!spare_.empty()) {
      Buffer buffer = std::move(spare_.back());
      spare_.pop_back();
      return buffer;
    }
  }
  Buffer buffer(new std::uint8_t[block_bytes_ + kSlack]);
  populate(buffer.get(), block_bytes_);
  return buffer;
}

void Spool::giveBack(Buffer buffer) noexcept {
  if (!buffer) return;
  const std::lock_guard lock(mutex_);
  try {
    spare_.push_back(std::move(buffer));
  } catch (const std::bad_alloc&) {
    // Without memory, this buffer is not kept for reuse.
  }
}

std::uint64_t Spool::placeInFile() {
  file_.create();
  if (free_.empty()) return file_end_++;
  const std::uint64_t at = free_.back();
  free_.pop_back();
  return at;
}

Spool::Block Spool::store(Buffer& filled, std::size_t used) {
  Block block{0, static_cast<std::uint32_t>(used), nullptr};
  {
    const std::lock_guard lock(mutex_);
    most_stored_ = std::max(most_stored_, ++stored_);
    if (memory_blocks_ > 0) {
      --memory_blocks_;
      block.memory = std::move(filled);
      return block;
    }
    block.at = placeInFile();
  }
  file_.write(block.at * block_bytes_, filled.get(), used);
  return block;
}

void Spool::spill(Block& block) {
  if (!block.memory) return;
  {
    const std::lock_guard lock(mutex_);
    block.at = placeInFile();
  }
  file_.write(block.at * block_bytes_, block.memory.get(), block.used);
  block.memory.reset();
}

const std::uint8_t* Spool::load(const Block& block, Buffer& scratch) {
  if (block.memory) return block.memory.get();
  if (!scratch) scratch = buffer();
  file_.read(block.at * block_bytes_, scratch.get(), block.used);
  return scratch.get();
}

void Spool::release(Block& block) noexcept {
  if (block.at == kReleased) return;
  const std::uint64_t at = std::exchange(block.at, kReleased);
  const bool in_memory = block.memory != nullptr;
  giveBack(std::move(block.memory));
  const std::lock_guard lock(mutex_);
  --stored_;
  if (in_memory) {
    ++memory_blocks_;
    return;
  }
  try {
    free_.push_back(at);
  } catch (const std::bad_alloc&) {
    // Without memory, the free block is not reused and the file grows.
  }
}

void ByteChain::turn() {
  if (current_) {
    blocks_.push_back(spool_->store(current_, used_));
    stored_bytes_ += used_;
  }
  if (!current_) current_ = spool_->buffer();
  used_ = 0;
}

void ByteChain::append(ByteSpan bytes) {
  while (!bytes.empty()) {
    if (!current_ || used_ == spool_->block_bytes()) turn();
    const std::size_t n = std::min(bytes.size(), spool_->block_bytes() - used_);
    std::memcpy(current_.get() + used_, bytes.data(), n);
    used_ += static_cast<std::uint32_t>(n);
    bytes = bytes.subspan(n);
  }
}

void ByteChain::close() {
  if (used_ > 0) {
    blocks_.push_back(spool_->store(current_, used_));
    stored_bytes_ += used_;
  }
  used_ = 0;
  spool_->giveBack(std::move(current_));
}

void ByteChain::take(ByteChain& other) {
  close();
  other.close();
  blocks_.insert(blocks_.end(), std::make_move_iterator(other.blocks_.begin()),
                 std::make_move_iterator(other.blocks_.end()));
  other.blocks_.clear();
  stored_bytes_ += std::exchange(other.stored_bytes_, 0);
}

void ByteChain::clear() {
  for (Spool::Block& block : blocks_) spool_->release(block);
  blocks_.clear();
  spool_->giveBack(std::move(current_));
  stored_bytes_ = used_ = 0;
}

void ByteChain::spill() {
  for (Spool::Block& block : blocks_) spool_->spill(block);
}

ByteChain::Reader::~Reader() {
  if (release_) chain_->clear();
  chain_->spool_->giveBack(std::move(scratch_));
}

ByteSpan ByteChain::Reader::next() {
  assert(!chain_->current_ && "read before close");
  if (release_ && at_ > 0) chain_->spool_->release(chain_->blocks_[at_ - 1]);
  if (at_ == chain_->blocks_.size()) return {};
  const Spool::Block& block = chain_->blocks_[at_++];
  return {chain_->spool_->load(block, scratch_), block.used};
}

void ByteChain::Reader::read(std::uint8_t* to, std::size_t n) {
  while (n > 0) {
    if (rest_.empty()) rest_ = next();
    assert(!rest_.empty());
    const std::size_t some = std::min(n, rest_.size());
    std::memcpy(to, rest_.data(), some);
    rest_ = rest_.subspan(some);
    to += some;
    n -= some;
  }
}

void ByteChain::read(std::uint64_t offset, std::span<std::uint8_t> to, Spool::Buffer& scratch) const {
  assert(!current_ && "read before close");
  std::size_t at = offset / spool_->block_bytes(), from = offset % spool_->block_bytes();
  while (!to.empty()) {
    const Spool::Block& block = blocks_[at++];
    const std::uint8_t* bytes = spool_->load(block, scratch);
    const std::size_t n = std::min<std::size_t>(to.size(), block.used - from);
    std::memcpy(to.data(), bytes + from, n);
    to = to.subspan(n);
    from = 0;
  }
}

}  // namespace filiform::internal
