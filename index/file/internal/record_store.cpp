#include "index/file/internal/record_store.h"

#include <algorithm>

namespace filiform::internal {

std::shared_ptr<RecordStore> RecordStore::shared() {
  static std::mutex mutex;
  static std::weak_ptr<RecordStore> known;
  const std::lock_guard lock(mutex);
  std::shared_ptr<RecordStore> store = known.lock();
  if (!store) known = store = std::make_shared<RecordStore>();
  return store;
}

std::uint64_t RecordStore::append(std::span<const std::uint8_t> bytes) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t begin = end_;
  if (end_ < kInMemory) {
    const std::size_t n = std::min<std::size_t>(bytes.size(), kInMemory - end_);
    memory_.insert(memory_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n));
    end_ += n;
    bytes = bytes.subspan(n);
  }
  if (bytes.empty()) return begin;
  file_.create();
  file_.write(end_ - kInMemory, bytes.data(), bytes.size());
  end_ += bytes.size();
  return begin;
}

void RecordStore::read(std::uint64_t at, std::span<std::uint8_t> bytes) const {
  const std::lock_guard lock(mutex_);
  if (at < kInMemory) {
    const std::size_t n = std::min<std::size_t>(bytes.size(), kInMemory - at);
    std::copy_n(memory_.begin() + static_cast<std::ptrdiff_t>(at), n, bytes.begin());
    bytes = bytes.subspan(n);
    at += n;
  }
  if (!bytes.empty()) file_.read(at - kInMemory, bytes.data(), bytes.size());
}

}  // namespace filiform::internal
