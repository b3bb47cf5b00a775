// A ring between one writing and one reading thread: no lock, no system call, no allocation after construction. Written
// out here because the packaged ring relies on fences, which the thread sanitizer cannot follow.
#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace filiform::internal {

template <typename T>
class ExchangeRing {
 public:
  explicit ExchangeRing(std::size_t capacity) : slots_(capacity) {}

  // Writing thread only. False, and nothing kept, when the ring is full.
  bool push(const T& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == slots_.size()) return false;
    slots_[head % slots_.size()] = value;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  // Reading thread only. False when the ring is empty.
  bool pop(T& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    value = slots_[tail % slots_.size()];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

 private:
  std::vector<T> slots_;
  // Ever-growing counts, apart by a cache line so that the two threads do not disturb each other.
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
};

}  // namespace filiform::internal
