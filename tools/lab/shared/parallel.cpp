#include "tools/lab/shared/parallel.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace filiform::tools {

void parallelFor(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work,
                 const std::function<void()>& meanwhile) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stopping{false};
  std::mutex mutex;
  std::condition_variable ended;
  std::size_t running = std::max<std::size_t>(1, std::min<std::size_t>(threads, count));
  std::exception_ptr failure;
  const auto fail = [&] {
    const std::lock_guard lock(mutex);
    if (!failure) failure = std::current_exception();
    stopping = true;
  };
  const auto loop = [&] {
    try {
      for (std::size_t i; !stopping && (i = next++) < count;) work(i);
    } catch (...) {
      fail();
    }
    const std::lock_guard lock(mutex);
    --running;
    ended.notify_all();
  };
  std::vector<std::thread> pool;
  const std::size_t wanted = running;
  for (std::size_t i = 0; i < wanted; ++i) pool.emplace_back(loop);
  while (true) {
    {
      std::unique_lock lock(mutex);
      if (ended.wait_for(lock, std::chrono::milliseconds(100), [&] { return running == 0; })) break;
    }
    if (!meanwhile || stopping) continue;
    try {
      meanwhile();
    } catch (...) {
      fail();
    }
  }
  for (std::thread& thread : pool) thread.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace filiform::tools
