// A bounded ring between two threads: one pushes, one pops. Both calls are
// wait-free, without allocation, lock or system call.
//
// Plain acquire/release atomics, so that the thread sanitizer of every compiler
// understands it; it reports the fences of readerwriterqueue as races under
// g++. Thread rule: push() by one thread, pop() by one thread.
#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <vector>

namespace filiform {

// Assigning a T must not throw or allocate.
template <class T>
class SpscRing {
 public:
  // Holds at least `capacity` elements; the only allocation.
  explicit SpscRing(std::size_t capacity) : slots_(std::bit_ceil(capacity < 2 ? std::size_t{2} : capacity)) {}

  std::size_t capacity() const noexcept { return slots_.size(); }

  // False, with nothing changed, when the ring is full.
  bool push(const T& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == slots_.size()) return false;
    slots_[tail & (slots_.size() - 1)] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  // False, with `value` untouched, when the ring is empty.
  bool pop(T& value) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head == tail_.load(std::memory_order_acquire)) return false;
    value = slots_[head & (slots_.size() - 1)];
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

 private:
  static constexpr std::size_t kLine = 64;
  std::vector<T> slots_;
  alignas(kLine) std::atomic<std::size_t> head_{0};
  alignas(kLine) std::atomic<std::size_t> tail_{0};
};

}  // namespace filiform
