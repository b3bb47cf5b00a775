// Passes the latest value from one thread to another. publish() never waits; take() gets the newest complete value, or
// none. Both are wait-free and do not allocate, lock or call the system. Thread rule: one thread calls publish(), one
// calls take().
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace filiform {

// Requires that a T is made without arguments, and that copying one to another does not throw, wait or allocate. The
// buffer keeps copies of up to three values.
template <class T>
class TripleBuffer {
 public:
  // Offers a value. It replaces an earlier value that was not taken.
  void publish(const T& value) noexcept {
    slots_[back_] = value;
    back_ = middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel) & kIndex;
  }

  // Copies the newest value to `value`. Returns false, with `value` unchanged, if nothing was published since the last
  // value was taken.
  bool take(T& value) noexcept {
    if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    value = slots_[front_];
    return true;
  }

 private:
  static constexpr std::uint8_t kIndex = 3, kFresh = 4;  // of middle_: which slot; whether its value was not taken yet
  std::array<T, 3> slots_{};
  std::uint8_t back_ = 0, front_ = 1;  // the slot that the writer fills; the slot that the reader read last
  std::atomic<std::uint8_t> middle_{2};
};

}  // namespace filiform
