// Makes a session and starts it, on a thread that may wait: the device opens, and the haptic loop's thread begins.
// The window's thread must not wait for another thread. In a browser the other one may only begin once it returns.
#pragma once

#include "solver/travel/session/session.h"

#include <future>
#include <memory>
#include <utility>

namespace filiform::internal {

// The store must outlive the session. The future throws what Session's constructor and start() throw.
inline std::future<std::unique_ptr<Session>> startSession(const TileStore& store, SessionOptions options) {
  return std::async(std::launch::async, [&store, wanted = std::move(options)] {
    auto session = std::make_unique<Session>(store, wanted);
    session->start();
    return session;
  });
}

}  // namespace filiform::internal
