#include "tools/program/ending_watch.h"

#include "solver/force/force_hold.h"

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <iostream>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

namespace filiform::tools {

struct EndingWatch::Impl {
  std::chrono::duration<double> patience;
  std::function<void()> stuck;
  std::mutex mutex;
  std::condition_variable changed;
  bool ended = false;
  std::thread thread;
};

EndingWatch::EndingWatch(double patience_s, std::function<void()> stuck) : impl_(std::make_unique<Impl>()) {
  impl_->patience = std::chrono::duration<double>(patience_s);
  impl_->stuck = std::move(stuck);
}

EndingWatch::~EndingWatch() {
  if (!impl_->thread.joinable()) return;
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->ended = true;
  }
  impl_->changed.notify_one();
  impl_->thread.join();
}

void EndingWatch::begin() noexcept {
  if (impl_->thread.joinable()) return;
  try {
    impl_->thread = std::thread([&impl = *impl_] {
      std::unique_lock lock(impl.mutex);
      if (impl.changed.wait_for(lock, impl.patience, [&impl] { return impl.ended; })) return;
      lock.unlock();
      impl.stuck();
    });
  } catch (const std::system_error&) {
  }
}

EndingWatch watchForSilentFiles() {
  return EndingWatch(3, [] {
    holdForces();
    std::cerr << "filiform: the scene's files or the device do not respond: ended without waiting any longer\n"
              << std::flush;
    std::_Exit(3);
  });
}

}  // namespace filiform::tools
