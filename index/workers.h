// Runs one function on several threads. Thread rule: any thread may call it; each call starts its own threads.
#pragma once

#include <algorithm>
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

// Calls run(i) once for each i below `count`, on at most `most` threads, in any order; none more after one throws.
template <typename Run>
void runItems(std::size_t count, std::size_t most, const Run& run) {
  std::atomic<std::size_t> next{0};
  runWorkers(std::clamp<std::size_t>(count, 1, std::max<std::size_t>(most, 1)),
             [&](std::size_t, const std::atomic<bool>& failed) {
               for (std::size_t i = next++; i < count && !failed; i = next++) run(i);
             });
}

}  // namespace filiform
