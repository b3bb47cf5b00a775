#include "tools/python/internal/calls.h"

#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <pybind11/pybind11.h>
#include <utility>

namespace filiform::python {

namespace py = pybind11;

void SignalCheck::operator()() {
  constexpr auto kPause = std::chrono::milliseconds(50);
  if (std::this_thread::get_id() != thread_ || ++calls_ % 16 != 0) return;
  const auto now = std::chrono::steady_clock::now();
  if (now - last_ < kPause) return;
  last_ = now;
  const py::gil_scoped_acquire lock;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

void runLong(std::atomic<bool>& cancel, const std::function<void(const std::function<void(WorkProgress)>& tell)>& work,
             const std::function<void(const WorkProgress&)>& on_progress) {
  std::mutex mutex;
  std::condition_variable changed;
  std::optional<WorkProgress> newest;
  bool ended = false;
  std::exception_ptr failure;
  std::thread worker([&] {
    try {
      work([&](WorkProgress progress) {
        const std::lock_guard lock(mutex);
        newest = std::move(progress);
      });
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    ended = true;
    changed.notify_one();
  });
  std::exception_ptr raised;  // by Python
  while (true) {
    std::optional<WorkProgress> told;
    bool over = false;
    {
      const py::gil_scoped_release released;
      std::unique_lock lock(mutex);
      changed.wait_for(lock, std::chrono::milliseconds(50), [&] { return ended; });
      told = std::exchange(newest, std::nullopt);
      over = ended;
    }
    try {
      if (told && !raised) on_progress(*told);
      if (!raised && PyErr_CheckSignals() != 0) throw py::error_already_set();
    } catch (...) {
      raised = std::current_exception();
      cancel = true;
    }
    if (over) break;
  }
  worker.join();
  if (raised) std::rethrow_exception(raised);
  if (failure) std::rethrow_exception(failure);
}

}  // namespace filiform::python
