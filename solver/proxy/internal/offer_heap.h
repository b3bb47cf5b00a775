// The priority queue of a uniform-cost search: lowest cost first, then lowest key. Comparisons have no branches,
// because a processor could not predict them. Thread rule: thread-compatible. All members except the constructor are
// noexcept and do not allocate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace filiform::internal {

struct Offer {
  double cost;
  std::uint64_t key;
  std::uint32_t node;

  bool before(const Offer& other) const noexcept {
    return (cost < other.cost) | ((cost == other.cost) & (key < other.key));
  }
};

class OfferHeap {
 public:
  explicit OfferHeap(std::size_t most) : offers_(most) {}

  bool empty() const noexcept { return size_ == 0; }
  void clear() noexcept { size_ = 0; }
  // Requires that the heap is not full.
  void push(const Offer& offer) noexcept { rise(size_++, offer); }
  // Requires that the heap is not empty.
  Offer pop() noexcept {
    const Offer least = offers_[0], last = offers_[--size_];
    std::size_t hole = 0;
    // Moves the hole down to a leaf: the last offer usually belongs near the leaves.
    for (std::size_t child = 1; child < size_; child = 2 * hole + 1) {
      child += child + 1 < size_ && offers_[child + 1].before(offers_[child]);
      offers_[hole] = offers_[child];
      hole = child;
    }
    rise(hole, last);
    return least;
  }

 private:
  void rise(std::size_t hole, const Offer& offer) noexcept {
    while (hole > 0 && offer.before(offers_[(hole - 1) / 2])) {
      offers_[hole] = offers_[(hole - 1) / 2];
      hole = (hole - 1) / 2;
    }
    offers_[hole] = offer;
  }

  std::vector<Offer> offers_;
  std::size_t size_ = 0;
};

}  // namespace filiform::internal
