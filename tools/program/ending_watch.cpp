#include "tools/program/ending_watch.h"

#include "index/text.h"
#include "solver/force/force_hold.h"

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <mutex>
#include <string>
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

EndingWatch watchForSilentFiles(std::function<std::string()> close, double patience_s) {
  return EndingWatch(patience_s, [close = std::move(close)] {
    holdForces();
    std::string why;
    try {
      if (close) why = close();
      std::cout.flush();
    } catch (const std::exception& error) {
      why = error.what();
    }
    if (why.empty()) why = "the scene's files or the device do not respond: ended without waiting any longer";
    std::cerr << "filiform: " + escaped(why) + "\n" << std::flush;
    std::_Exit(3);
  });
}

}  // namespace filiform::tools
