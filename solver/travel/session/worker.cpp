#include "solver/travel/session/worker.h"

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

namespace filiform {

struct Worker::Impl {
  struct Result {
    Done done;
    std::string error;
  };

  void run() {
    std::unique_lock lock(mutex);
    for (;;) {
      changed.wait(lock, [this] { return stopping || !works.empty(); });
      if (stopping) return;
      const Work work = std::move(works.front());
      works.pop_front();
      lock.unlock();
      Result result;
      try {
        result.done = work();
      } catch (const std::exception& error) {
        result.error = error.what();
      }
      lock.lock();
      results.push_back(std::move(result));
    }
  }

  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Work> works;
  std::deque<Result> results;
  bool stopping = false;
  std::size_t open = 0;  // works not served yet; used by the owner's thread only
  std::thread thread;
};

Worker::Worker() : impl_(std::make_unique<Impl>()) {
  impl_->thread = std::thread([this] { impl_->run(); });
}

Worker::~Worker() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stopping = true;
  }
  impl_->changed.notify_one();
  impl_->thread.join();
}

void Worker::ask(Work work) {
  ++impl_->open;
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->works.push_back(std::move(work));
  }
  impl_->changed.notify_one();
}

void Worker::serve(const std::function<void(const std::string&)>& failed) {
  std::deque<Impl::Result> results;
  {
    const std::lock_guard lock(impl_->mutex);
    results.swap(impl_->results);
  }
  for (Impl::Result& result : results) {
    --impl_->open;
    if (!result.error.empty())
      failed(result.error);
    else if (result.done)
      result.done();
  }
}

bool Worker::idle() const { return impl_->open == 0; }

}  // namespace filiform
