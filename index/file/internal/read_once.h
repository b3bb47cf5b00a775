// ReadOnce: a value that is read when it is first needed.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <utility>

namespace filiform::internal {

// Use either get() or keep(). Thread rule: internally synchronised.
template <typename T>
class ReadOnce {
 public:
  // The first thread reads the value and the others wait; later calls never wait. After a failure, the next call reads
  // again. `read` returns std::unique_ptr<const T>, or throws.
  template <typename Read>
  const T& get(Read read) {
    if (const T* const there = known()) return *there;
    const std::lock_guard lock(mutex_);
    if (owned_ == nullptr) store(read());
    return *owned_;
  }
  // Keeps a value that several threads may have read, unless there is one: returns false then.
  bool keep(std::unique_ptr<const T> value) {
    const std::lock_guard lock(mutex_);
    if (owned_ != nullptr) return false;
    store(std::move(value));
    return true;
  }
  const T* known() const { return known_.load(std::memory_order_acquire); }

 private:
  void store(std::unique_ptr<const T> value) {
    owned_ = std::move(value);
    known_.store(owned_.get(), std::memory_order_release);
  }
  std::mutex mutex_;
  std::unique_ptr<const T> owned_;
  std::atomic<const T*> known_{nullptr};
};

}  // namespace filiform::internal
