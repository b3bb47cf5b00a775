// FutureRead: a read of a set that another thread may begin before its result is asked for.
//
//   ReadThreads threads(2);
//   FutureRead<std::shared_ptr<const Tile>> ahead(&threads, [&] { return store.load(next); });
//   draw(*store.load(now));
//   draw(*ahead.get());
//
// Thread rule: thread-compatible. A read may begin reads of its own.
#pragma once

#include "index/file/read_threads.h"

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <utility>

namespace filiform {

template <typename Result>
class FutureRead {
 public:
  FutureRead() = default;  // empty: only to be assigned to or destroyed
  // `read` runs on one of these threads as soon as one is free; in get() if none was until then, or without threads.
  template <typename Read>
  FutureRead(ReadThreads* threads, Read read) : job_(std::make_shared<Job>(std::move(read))) {
    if (threads == nullptr) return;
    threads->add([job = job_] {
      if (!job->is_begun.exchange(true)) job->task();
    });
  }
  // Waits for a read under way; one that has not begun never does.
  ~FutureRead() { forget(); }
  FutureRead(FutureRead&&) noexcept = default;
  FutureRead& operator=(FutureRead&& other) noexcept {
    forget();
    job_ = std::move(other.job_);
    return *this;
  }

  // Makes this object empty and returns true, unless the read is under way. Never waits.
  bool giveUp() noexcept {
    if (job_->is_begun.exchange(true) && job_->result.valid() &&
        job_->result.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
      return false;
    job_.reset();
    return true;
  }
  // Throws what the read throws. Call it once.
  Result get() {
    if (!job_->is_begun.exchange(true)) job_->task();
    return job_->result.get();
  }

 private:
  struct Job {
    template <typename Read>
    explicit Job(Read read) : task(std::move(read)), result(task.get_future()) {}
    std::atomic<bool> is_begun{false};
    std::packaged_task<Result()> task;
    std::future<Result> result;
  };

  void forget() noexcept {
    if (job_ && job_->is_begun.exchange(true) && job_->result.valid()) job_->result.wait();
    job_.reset();
  }
  std::shared_ptr<Job> job_;
};

}  // namespace filiform
