// A bounded queue between two threads. Both calls are wait-free, without allocation, lock or system call. Thread rule:
// one thread calls push(), one calls pop().
//
// It uses plain acquire/release atomics, which every thread sanitizer understands. Under g++, the sanitizer reports the
// fences of readerwriterqueue as races.
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
  // Allocates room for at least `capacity` elements; the only allocation.
  explicit SpscRing(std::size_t capacity) : slots_(std::bit_ceil(capacity < 2 ? std::size_t{2} : capacity)) {}

  std::size_t capacity() const noexcept { return slots_.size(); }

  // Appends a value. Returns false, with the queue unchanged, if the queue is full.
  bool push(const T& value) noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail - head_.load(std::memory_order_acquire) == slots_.size()) return false;
    slots_[tail & (slots_.size() - 1)] = value;
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  // Removes the oldest value. Returns false, with `value` unchanged, if the queue is empty.
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
