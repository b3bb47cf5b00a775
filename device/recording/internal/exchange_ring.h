// A queue from one writing thread to one reading thread. After construction: no lock, system call or allocation.
// Written here because the packaged ring uses fences, which the thread sanitizer cannot follow.
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace filiform::internal {

template <typename T>
class ExchangeRing {
 public:
  explicit ExchangeRing(std::size_t capacity) : slots_(capacity) {}

  // For the writing thread. Returns false, and drops the value, if the queue is full.
  bool push(const T& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == slots_.size()) return false;
    slots_[head % slots_.size()] = value;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  // For the reading thread. Returns false if the queue is empty.
  bool pop(T& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    value = slots_[tail % slots_.size()];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

 private:
  std::vector<T> slots_;
  // Counts that only grow; on separate cache lines, so that the two threads do not slow each other.
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
};

}  // namespace filiform::internal
