// What a search has visited: segments and nodes, stamped with the epoch of the search, in one open-addressed table of
// fixed size.
//
// Forgetting everything is one addition (a new epoch makes every slot stale). Every change since beginTick() is logged,
// so that a tick can be taken back exactly, at a cost bounded by what the tick marked. Thread rule: haptic thread only;
// every member but the constructor is noexcept, without allocation, lock or system call.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

namespace filiform {

class Marks {
 public:
  enum class Kind : std::uint64_t { segment = 0, node = 1 };
  enum class Put : std::uint8_t { fresh, present, full };

  // Room for `capacity` marks in an epoch, and for `most_in_tick` between two calls of beginTick(); what goes beyond
  // either is answered `full` and not marked. The slots are at most half full, 16 bytes each.
  Marks(std::uint32_t capacity, std::uint32_t most_in_tick)
      : capacity_(capacity), slots_(std::bit_ceil(2 * std::uint64_t{capacity} + 4)), log_(most_in_tick) {}

  std::uint32_t size() const noexcept { return size_; }  // in this epoch

  // `key` is SegmentId::key() or NodeId::key(): the two kinds do not meet. O(1) expected.
  bool contains(Kind kind, std::uint64_t key) const noexcept {
    const Slot& slot = slots_[find(kind, key)];
    return slot.stamp == stamp(kind);
  }
  Put put(Kind kind, std::uint64_t key) noexcept {
    const std::uint64_t at = find(kind, key);
    if (slots_[at].stamp == stamp(kind)) return Put::present;
    if (size_ == capacity_ || logged_ == log_.size()) return Put::full;
    log_[logged_++] = {at, slots_[at]};
    slots_[at] = {key, stamp(kind)};
    ++size_;
    return Put::fresh;
  }
  // It will be asked for soon.
  void prefetch(Kind kind, std::uint64_t key) const noexcept {
    __builtin_prefetch(&slots_[start(kind, key) & (slots_.size() - 1)], 1);
  }
  void newEpoch() noexcept {
    ++epoch_;
    size_ = 0;
  }

  void beginTick() noexcept {
    logged_ = 0;
    epoch_before_ = epoch_;
    size_before_ = size_;
  }
  // Back to the state at beginTick(), to the last bit. O(marks since then).
  void undo() noexcept {
    while (logged_ > 0) {
      --logged_;
      slots_[log_[logged_].at] = log_[logged_].before;
    }
    epoch_ = epoch_before_;
    size_ = size_before_;
  }

 private:
  struct Slot {
    std::uint64_t key = 0;
    std::uint64_t stamp = 0;  // epoch * 2 + kind; another epoch than the present one: free
  };
  struct Change {
    std::uint64_t at = 0;
    Slot before;
  };

  std::uint64_t stamp(Kind kind) const noexcept { return epoch_ * 2 + static_cast<std::uint64_t>(kind); }

  static std::uint64_t start(Kind kind, std::uint64_t key) noexcept {
    // Two neighbouring ranks, segment and node each, share a cache line: a search along a thread takes them in turn.
    const auto k = static_cast<std::uint64_t>(kind);
    std::uint64_t x = (key >> 1 ^ key >> 33) * 0xd6e8feb86659fd93u;
    x = (x ^ x >> 32) * 0xd6e8feb86659fd93u;
    return (x ^ x >> 32) << 2 | (key & 1) << 1 | k;
  }

  // The slot that holds the mark, or the free one where it would go. Terminates: at least a quarter of the slots is
  // free.
  std::uint64_t find(Kind kind, std::uint64_t key) const noexcept {
    const std::uint64_t mask = slots_.size() - 1;
    const std::uint64_t wanted = stamp(kind);
    for (std::uint64_t at = start(kind, key) & mask;; at = (at + 1) & mask) {
      const Slot& slot = slots_[at];
      if (slot.stamp / 2 != epoch_ || (slot.key == key && slot.stamp == wanted)) return at;
    }
  }

  std::uint32_t capacity_, size_ = 0, size_before_ = 0;
  std::uint64_t epoch_ = 1, epoch_before_ = 1;  // 63 bits: never wraps
  std::vector<Slot> slots_;
  std::vector<Change> log_;
  std::size_t logged_ = 0;
};

}  // namespace filiform
