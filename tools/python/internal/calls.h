// Long calls: Python's global lock is released meanwhile, and Ctrl-C ends them. Thread rule: as stated.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

namespace filiform::python {

// Looks for signals such as Ctrl-C now and then, from the thread that made it. Made with or without the global lock;
// called without it.
class SignalCheck {
 public:
  SignalCheck() : thread_(std::this_thread::get_id()), last_(std::chrono::steady_clock::now()) {}
  // Any thread may call it; only the calls of its own thread look. Throws py::error_already_set if the handler of a
  // signal raises, as that of Ctrl-C does.
  void operator()();

 private:
  const std::thread::id thread_;
  std::chrono::steady_clock::time_point last_;
  unsigned calls_ = 0;
};

// What a long work tells while it runs.
struct WorkProgress {
  std::string phase;
  std::uint64_t done = 0, total = 0;
};
// Runs `work` on a thread of its own, without the global lock. Meanwhile the calling thread, which holds the lock at
// first, looks for signals every 50 ms, and calls `on_progress` (with the lock) with the newest progress. If either
// raises, `cancel` becomes true, the work is waited for, and the error is thrown. Otherwise throws what `work` throws.
void runLong(std::atomic<bool>& cancel, const std::function<void(const std::function<void(WorkProgress)>& tell)>& work,
             const std::function<void(const WorkProgress&)>& on_progress);

}  // namespace filiform::python
