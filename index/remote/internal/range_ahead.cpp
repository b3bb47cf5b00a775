#include "index/remote/internal/range_ahead.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace filiform::internal {
namespace {

constexpr int kReadsOfARun = 3;

}  // namespace

bool RangeAhead::take(const std::string& file, std::uint64_t offset, std::span<std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  if (file != file_ || offset < offset_ || offset - offset_ > piece_.size() ||
      bytes.size() > piece_.size() - (offset - offset_))
    return false;
  if (!bytes.empty()) std::memcpy(bytes.data(), piece_.data() + (offset - offset_), bytes.size());
  runs_[file].next = offset + bytes.size();
  return true;
}

std::uint64_t RangeAhead::plan(const std::string& file, std::uint64_t offset, std::uint64_t bytes,
                               std::uint64_t file_bytes) {
  const std::lock_guard lock(mutex_);
  Run& run = runs_[file];
  if (run.next != offset) run = {};
  run.next = offset + bytes;
  if (++run.reads < kReadsOfARun || offset >= file_bytes) return bytes;
  const std::uint64_t ahead = std::min(run.ahead, file_bytes - offset);
  run.ahead = std::min(2 * run.ahead, kMost);
  return std::max(bytes, ahead);
}

void RangeAhead::keep(const std::string& file, std::uint64_t offset, Bytes piece) {
  const std::lock_guard lock(mutex_);
  file_ = file;
  offset_ = offset;
  piece_ = std::move(piece);
}

void RangeAhead::forget() {
  const std::lock_guard lock(mutex_);
  runs_.clear();
  file_.clear();
  piece_.clear();
}

}  // namespace filiform::internal
