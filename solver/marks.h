// What a search has visited: segments and nodes, in one open-addressed table of fixed size, each slot a bitmap of 64
// neighbouring keys of both kinds, stamped with the epoch of the search.
//
// Ranks that follow one another lie on one thread, and are visited together: a search along a thread stays on one slot,
// and one that finds the table out of the caches waits for it once in 64 marks.
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
  // either is answered `full` and not marked. The slots are at most half full, 32 bytes each.
  Marks(std::uint32_t capacity, std::uint32_t most_in_tick)
      : capacity_(capacity), slots_(std::bit_ceil(2 * std::uint64_t{capacity} + 4)), log_(most_in_tick) {}

  std::uint32_t size() const noexcept { return size_; }  // in this epoch

  // `key` is SegmentId::key() or NodeId::key(): the two kinds do not meet. O(1) expected.
  bool contains(Kind kind, std::uint64_t key) const noexcept {
    const Slot& slot = slots_[find(key)];
    return slot.epoch == epoch_ && (slot.marked[index(kind)] & bit(key)) != 0;
  }
  Put put(Kind kind, std::uint64_t key) noexcept {
    const std::uint64_t at = find(key);
    Slot& slot = slots_[at];
    const bool known = slot.epoch == epoch_;
    if (known && (slot.marked[index(kind)] & bit(key)) != 0) return Put::present;
    if (size_ == capacity_ || logged_ == log_.size()) return Put::full;
    log_[logged_++] = {at, slot};
    if (!known) slot = {key >> kShift, epoch_, {0, 0}};
    slot.marked[index(kind)] |= bit(key);
    ++size_;
    return Put::fresh;
  }
  // It will be asked for soon.
  void prefetch(std::uint64_t key) const noexcept { __builtin_prefetch(&slots_[start(key) & (slots_.size() - 1)], 1); }
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
  static constexpr int kShift = 6;
  struct Slot {
    std::uint64_t block = 0;           // of keys: key >> kShift
    std::uint64_t epoch = 0;           // another than the present one: free
    std::uint64_t marked[2] = {0, 0};  // by kind, a bit a key
  };
  struct Change {
    std::uint64_t at = 0;
    Slot before;
  };

  static std::size_t index(Kind kind) noexcept { return static_cast<std::size_t>(kind); }
  static std::uint64_t bit(std::uint64_t key) noexcept { return std::uint64_t{1} << (key & 63); }
  static std::uint64_t start(std::uint64_t key) noexcept {
    std::uint64_t x = (key >> kShift ^ key >> (32 + kShift)) * 0xd6e8feb86659fd93u;
    x = (x ^ x >> 32) * 0xd6e8feb86659fd93u;
    return x ^ x >> 32;
  }

  // The slot of the key's block, or the free one where it would go. Terminates: at least half of the slots are free.
  std::uint64_t find(std::uint64_t key) const noexcept {
    const std::uint64_t mask = slots_.size() - 1;
    for (std::uint64_t at = start(key) & mask;; at = (at + 1) & mask) {
      const Slot& slot = slots_[at];
      if (slot.epoch != epoch_ || slot.block == key >> kShift) return at;
    }
  }

  std::uint32_t capacity_, size_ = 0, size_before_ = 0;
  std::uint64_t epoch_ = 1, epoch_before_ = 1;  // never wraps
  std::vector<Slot> slots_;
  std::vector<Change> log_;
  std::size_t logged_ = 0;
};

}  // namespace filiform
