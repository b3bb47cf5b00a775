// ReadOnce: a value that is read when it is first needed.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>

namespace filiform::internal {

// The first thread reads the value and the others wait; later calls never wait. After a failure, the next call reads
// again. Thread rule: internally synchronised.
template <typename T>
class ReadOnce {
 public:
  template <typename Read>  // returns std::unique_ptr<const T>, or throws
  const T& get(Read read) {
    if (const T* const there = known()) return *there;
    const std::lock_guard lock(mutex_);
    if (owned_ == nullptr) {
      owned_ = read();
      known_.store(owned_.get(), std::memory_order_release);
    }
    return *owned_;
  }
  const T* known() const { return known_.load(std::memory_order_acquire); }

 private:
  std::mutex mutex_;
  std::unique_ptr<const T> owned_;
  std::atomic<const T*> known_{nullptr};
};

}  // namespace filiform::internal
