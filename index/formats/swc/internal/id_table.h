// Maps the sample ids of one id block to ranks. Consecutive ids in file order take two numbers; otherwise a flat hash
// table is used. Thread rule: thread-compatible.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

namespace filiform::internal {

class IdTable {
 public:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  // Starts an empty block; keeps the memory unless it is large.
  void clear() {
    size_ = 0;
    hashed_ = false;
    if (slots_.size() > kSlotsKept) slots_ = {};
  }
  // Bytes with `times` as many ids; twice as many more where the table is about to grow.
  std::uint64_t bytes(double times = 1) const {
    if (!hashed_) return slots_.capacity() * sizeof(Slot);
    const auto ids = static_cast<std::uint64_t>(size_ * times);
    std::size_t slots = slots_.size();
    while (ids > most(slots)) slots *= 2;
    return slots * sizeof(Slot) * (ids + ids / 32 > most(slots) ? 3 : 1);
  }

  std::uint32_t size() const { return size_; }

  // Rank of the sample, or kNone. O(1) expected.
  std::uint32_t find(std::int64_t id) const {
    if (!hashed_) {
      const std::uint64_t steps = static_cast<std::uint64_t>(id) - static_cast<std::uint64_t>(first_id_);
      return steps < size_ ? first_rank_ + static_cast<std::uint32_t>(steps) : kNone;
    }
    for (std::size_t at = slotOf(id);; at = (at + 1) & (slots_.size() - 1)) {
      if (slots_[at].rank == kNone || slots_[at].id == id) return slots_[at].rank;
    }
  }

  // Requires a new id, and ranks that increase by one.
  void insert(std::int64_t id, std::uint32_t rank) {
    if (size_ == 0) {
      first_id_ = id;
      first_rank_ = rank;
    } else if (!hashed_ && static_cast<std::uint64_t>(id) - static_cast<std::uint64_t>(first_id_) != size_) {
      const std::uint32_t count = size_;
      hashed_ = true;
      slots_.assign(std::bit_ceil(std::size_t{4} * (count + 4)), Slot{});
      for (std::uint32_t i = 0; i < count; ++i) place({first_id_ + i, first_rank_ + i});
    }
    ++size_;
    if (!hashed_) return;
    if (size_ > most(slots_.size())) {
      std::vector<Slot> old(slots_.size() * 2);
      old.swap(slots_);
      for (const Slot& slot : old) {
        if (slot.rank != kNone) place(slot);
      }
    }
    place({id, rank});
  }

 private:
  struct Slot {
    std::int64_t id = 0;
    std::uint32_t rank = kNone;
  };

  static constexpr std::size_t kSlotsKept = std::size_t{1} << 18;
  // Half of the slots, three quarters where the table is large.
  static std::size_t most(std::size_t slots) { return slots > kSlotsKept ? slots / 4 * 3 : slots / 2; }

  std::size_t slotOf(std::int64_t id) const {
    std::uint64_t h = static_cast<std::uint64_t>(id);
    h = (h ^ (h >> 32)) * 0xD6E8FEB86659FD93u;
    h = (h ^ (h >> 32)) * 0xD6E8FEB86659FD93u;
    return static_cast<std::size_t>(h ^ (h >> 32)) & (slots_.size() - 1);
  }

  void place(const Slot& slot) {
    std::size_t at = slotOf(slot.id);
    while (slots_[at].rank != kNone) at = (at + 1) & (slots_.size() - 1);
    slots_[at] = slot;
  }

  std::uint32_t size_ = 0;
  bool hashed_ = false;
  std::int64_t first_id_ = 0;
  std::uint32_t first_rank_ = 0;
  std::vector<Slot> slots_;
};

}  // namespace filiform::internal
