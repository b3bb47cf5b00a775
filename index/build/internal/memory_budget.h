// MemoryBudget: counts the memory that several threads take from one limit. Unlike MemoryGate it never waits. If memory
// does not fit, it throws, so that a thread may hold some memory and ask for more. Thread rule: internally
// synchronised; a Hold belongs to one thread at a time.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

namespace filiform::internal {

struct BeyondBudget {
  std::uint64_t bytes;  // a limit that suffices for this step
};

class MemoryBudget {
 public:
  explicit MemoryBudget(std::uint64_t limit) : limit_(limit) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  std::uint64_t limit() const { return limit_; }
  std::uint64_t used() const { return used_; }

  // A part of the budget; returned by the destructor.
  class Hold {
   public:
    Hold() = default;
    // Throws BeyondBudget.
    Hold(MemoryBudget& budget, std::uint64_t bytes) : budget_(&budget) { change(bytes); }
    Hold(Hold&& other) noexcept
        : budget_(std::exchange(other.budget_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Hold& operator=(Hold&& other) noexcept {
      std::swap(budget_, other.budget_);
      std::swap(bytes_, other.bytes_);
      return *this;
    }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;
    ~Hold() {
      if (budget_ != nullptr) budget_->used_ -= bytes_;
    }
    std::uint64_t bytes() const { return bytes_; }
    // Throws BeyondBudget, and then holds what it held. Requires a budget.
    void change(std::uint64_t bytes) {
      const std::uint64_t used = budget_->used_ += bytes - bytes_;  // modulo 2^64
      if (bytes > bytes_ && used > budget_->limit_) {
        budget_->used_ -= bytes - bytes_;
        throw BeyondBudget{used};
      }
      bytes_ = bytes;
    }

   private:
    MemoryBudget* budget_ = nullptr;
    std::uint64_t bytes_ = 0;
  };

 private:
  const std::uint64_t limit_;
  std::atomic<std::uint64_t> used_{0};
};

}  // namespace filiform::internal
