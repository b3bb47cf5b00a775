// The nodes that one search has met, numbered from 0 in the order in which it met them, in one open-addressed table of
// fixed size. Forgetting them all is one addition. Thread rule: haptic thread only; every member but the constructor is
// noexcept, without allocation, lock or system call.
#pragma once

#include "index/tile.h"

#include <bit>
#include <cstdint>
#include <vector>

namespace filiform::internal {

class NodeNumbers {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  // Room for `capacity` nodes at a time, fewer than 2^22; the slots are at most half full, 16 bytes each.
  explicit NodeNumbers(std::uint32_t capacity) : slots_(std::bit_ceil(2 * std::uint64_t{capacity} + 4)) {}

  std::uint32_t size() const noexcept { return size_; }
  void forget() noexcept {
    epoch_ += kStep;
    size_ = 0;
  }
  // The node's number, or kNone. O(1) expected.
  std::uint32_t find(NodeId id) const noexcept {
    const std::uint64_t stamp = slots_[slotOf(id.key())].stamp;
    return stamp >= epoch_ ? static_cast<std::uint32_t>(stamp - epoch_) : kNone;
  }
  // The same; a node not met so far gets the next number, size() before the call. Requires room.
  std::uint32_t put(NodeId id) noexcept {
    Slot& slot = slots_[slotOf(id.key())];
    if (slot.stamp < epoch_) slot = {id.key(), epoch_ + size_++};
    return static_cast<std::uint32_t>(slot.stamp - epoch_);
  }

 private:
  // Below it a stamp counts nodes, above it searches: 2^42 of them, 139 years at 1 kHz.
  static constexpr std::uint64_t kStep = std::uint64_t{1} << 22;
  struct Slot {
    std::uint64_t key = 0;
    std::uint64_t stamp = 0;  // epoch + number; below the present epoch: free
  };

  std::uint64_t slotOf(std::uint64_t key) const noexcept {
    const std::uint64_t mask = slots_.size() - 1;
    // Four neighbouring samples share a cache line.
    std::uint64_t x = (key >> 2) * 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 32) << 2 | (key & 3);
    for (std::uint64_t at = x & mask;; at = (at + 1) & mask)
      if (slots_[at].stamp < epoch_ || slots_[at].key == key) return at;
  }

  std::vector<Slot> slots_;
  std::uint64_t epoch_ = kStep;
  std::uint32_t size_ = 0;
};

}  // namespace filiform::internal
