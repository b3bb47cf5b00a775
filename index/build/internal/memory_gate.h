// MemoryGate: keeps the working memory of several threads within a common limit. A thread waits until its memory fits.
// Thread rule: internally synchronised; a Pass belongs to one thread.
#pragma once

#include "index/build/internal/heap.h"

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace filiform::internal {

class MemoryGate {
 public:
  // `threads`: number of threads that work at a time.
  MemoryGate(std::uint64_t limit, unsigned threads) : limit_(limit), share_(limit / threads) {}
  MemoryGate(const MemoryGate&) = delete;
  MemoryGate& operator=(const MemoryGate&) = delete;

  std::uint64_t limit() const { return limit_; }  // bytes
  std::uint64_t share() const { return share_; }  // bytes for each thread while all work

  // The memory of one thread; returned by the destructor.
  class Pass {
   public:
    explicit Pass(MemoryGate& gate) : gate_(&gate) {}
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;
    ~Pass() { gate_->leave(held_); }

    std::uint64_t bytes() const { return held_; }
    // True if at least `bytes` are held, and no more than the larger of the share and `bytes`.
    bool fits(std::uint64_t bytes) const {
      return held_ != 0 && bytes <= held_ && held_ <= std::max(bytes, gate_->share_);
    }
    // Holds the larger of the share and `bytes`. First returns what was held, then waits for room: the thread must have
    // freed its memory. Requires bytes <= limit().
    void change(std::uint64_t bytes) {
      gate_->leave(held_);
      held_ = 0;
      const std::uint64_t wanted = std::max(bytes, gate_->share_);
      gate_->enter(wanted);
      held_ = wanted;
      if (wanted > gate_->share_) returnFreedMemory();  // what other threads have freed
    }

   private:
    MemoryGate* gate_;
    std::uint64_t held_ = 0;
  };

 private:
  void enter(std::uint64_t bytes) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return bytes <= limit_ - taken_; });
    taken_ += bytes;
  }
  void leave(std::uint64_t bytes) {
    {
      const std::lock_guard lock(mutex_);
      taken_ -= bytes;
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  const std::uint64_t limit_, share_;
  std::uint64_t taken_ = 0;
};

}  // namespace filiform::internal
