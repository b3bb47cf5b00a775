// MemoryBudget: memory that several threads take from one limit. Thread rule: internally synchronised; a Hold belongs
// to one thread at a time.
#pragma once

#include "index/internal/heap.h"

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <utility>

namespace filiform::internal {

struct BeyondBudget {
  std::uint64_t bytes;  // a limit that suffices for this step
};

class MemoryBudget {
 public:
  // `threads`: number of threads that work at a time.
  explicit MemoryBudget(std::uint64_t limit, unsigned threads = 1) : limit_(limit), share_(limit / threads) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  std::uint64_t limit() const { return limit_; }  // bytes
  std::uint64_t share() const { return share_; }  // bytes for each thread while all work
  std::uint64_t used() const {
    const std::lock_guard lock(mutex_);
    return used_;
  }

  // A part of the budget; returned by the destructor.
  class Hold {
   public:
    Hold() = default;
    // Throws BeyondBudget.
    explicit Hold(MemoryBudget& budget, std::uint64_t bytes = 0) : budget_(&budget) { change(bytes); }
    Hold(Hold&& other) noexcept
        : budget_(std::exchange(other.budget_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Hold& operator=(Hold&& other) noexcept {
      std::swap(budget_, other.budget_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    ~Hold() {
      if (budget_ != nullptr) budget_->take(0, bytes_);
    }

    // These require a budget.
    const MemoryBudget& budget() const { return *budget_; }
    std::uint64_t bytes() const { return bytes_; }
    // Throws BeyondBudget if more memory does not fit, and then holds what it held. So a thread may hold some memory
    // and ask for more.
    void change(std::uint64_t bytes) {
      budget_->take(bytes, bytes_);
      bytes_ = bytes;
    }
    // True if at least `bytes` are held, and no more than the larger of the share and `bytes`.
    bool fits(std::uint64_t bytes) const {
      return bytes_ != 0 && bytes <= bytes_ && bytes_ <= std::max(bytes, budget_->share_);
    }
    // Holds the larger of the share and `bytes`. First returns what was held, then waits for room: the thread must have
    // freed its memory. Requires bytes <= limit().
    void wait(std::uint64_t bytes) {
      change(0);
      bytes_ = std::max(bytes, budget_->share_);
      {
        std::unique_lock lock(budget_->mutex_);
        budget_->changed_.wait(lock, [&] { return bytes_ <= budget_->limit_ - budget_->used_; });
        budget_->used_ += bytes_;
      }
      if (bytes_ > budget_->share_) returnFreedMemory();  // what other threads have freed
    }

   private:
    MemoryBudget* budget_ = nullptr;
    std::uint64_t bytes_ = 0;
  };

 private:
  void take(std::uint64_t bytes, std::uint64_t instead_of) {
    {
      const std::lock_guard lock(mutex_);
      const std::uint64_t used = used_ - instead_of + bytes;
      if (bytes > instead_of && used > limit_) throw BeyondBudget{used};
      used_ = used;
    }
    changed_.notify_all();
  }

  const std::uint64_t limit_, share_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t used_ = 0;
};

}  // namespace filiform::internal
