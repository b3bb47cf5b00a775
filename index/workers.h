// Runs one function on several threads. Thread rule: any thread may call it; each call starts its own threads.
#pragma once

#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <system_error>
#include <thread>
#include <vector>

namespace filiform {

// Calls run(worker, failed) on `threads` threads and waits for them; worker 0 is the calling thread. If the system
// grants fewer threads, fewer run. `failed` becomes true when one throws. The exception of the lowest worker is
// rethrown.
template <typename Run>
void runWorkers(std::size_t threads, const Run& run) {
  std::atomic<bool> failed{false};
  std::vector<std::exception_ptr> failures(threads);
  const auto guarded = [&](unsigned worker) {
    try {
      run(worker, failed);
    } catch (...) {
      failures[worker] = std::current_exception();
      failed = true;
    }
  };
  {
    std::vector<std::jthread> pool;
    try {
      for (unsigned i = 1; i < threads; ++i) pool.emplace_back(guarded, i);
    } catch (const std::system_error&) {
      // The threads already started do the work.
    }
    guarded(0);
  }
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
}

}  // namespace filiform
