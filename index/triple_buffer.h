// Passes the latest value from one thread to another. The writer never waits; the reader gets the newest complete value
// or none. Both calls are wait-free, without allocation, lock or system call. Thread rule: one thread calls publish(),
// one calls take().
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace filiform {

// Assigning a T must not throw or allocate.
template <class T>
class TripleBuffer {
 public:
  // Offers a value; a value not yet taken is lost.
  void publish(const T& value) noexcept {
    slots_[back_] = value;
    back_ = middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel) & kIndex;
  }

  // Copies the newest value to `value`. Returns false, with `value` unchanged, if nothing was published since the last
  // call.
  bool take(T& value) noexcept {
    if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    value = slots_[front_];
    return true;
  }

 private:
  static constexpr std::uint8_t kIndex = 3, kFresh = 4;
  std::array<T, 3> slots_{};
  std::uint8_t back_ = 0, front_ = 1;  // the writer's, the reader's
  std::atomic<std::uint8_t> middle_{2};
};

}  // namespace filiform
