#include "index/file/read_threads.h"

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace filiform {

struct ReadThreads::Impl {
  const unsigned most;
  std::mutex mutex{};
  std::condition_variable asked{};
  std::deque<std::function<void()>> works{};
  std::vector<std::thread> threads{};
  std::size_t idle = 0;  // threads that wait, or have been woken and have not taken their work yet
  bool stop = false;

  void run() {
    std::unique_lock lock(mutex);
    for (;;) {
      ++idle;
      asked.wait(lock, [this] { return stop || !works.empty(); });
      --idle;
      if (stop) return;
      std::function<void()> work = std::move(works.front());
      works.pop_front();
      lock.unlock();
      work();
      work = nullptr;
      lock.lock();
    }
  }
};

ReadThreads::ReadThreads(unsigned most) : impl_(new Impl{.most = most}) {}

ReadThreads::~ReadThreads() {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->stop = true;
  }
  impl_->asked.notify_all();
  for (std::thread& thread : impl_->threads) thread.join();
}

void ReadThreads::add(std::function<void()> work) {
  const std::lock_guard lock(impl_->mutex);
  impl_->works.push_back(std::move(work));
  if (impl_->works.size() > impl_->idle && impl_->threads.size() < impl_->most) try {
      impl_->threads.emplace_back([impl = impl_.get()] { impl->run(); });
    } catch (const std::system_error&) {
      // Whoever waits for the work runs it.
    }
  impl_->asked.notify_one();
}

}  // namespace filiform
