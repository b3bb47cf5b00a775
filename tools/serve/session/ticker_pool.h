// TickerPool: the threads that tick the sessions of a server, and which of them takes the next one.
//
// A thread takes another session while its processor time and that of one session more stay below kMostShare of the
// time, and while it is not late by its own work. So the number of sessions follows what hands do on this machine.
// Thread rule: internally synchronised.
#pragma once

#include "tools/serve/session/ticker.h"

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

namespace filiform::tools {

// What is known of a thread when a session asks for a place.
struct TickerLoad {
  std::size_t sessions = 0;
  std::size_t newcomers = 0;  // of those: came after the figures below were taken
  double share = 0;           // of a second: processor time
  double late = 0;            // share of its ticks
};

inline constexpr double kMostShare = 0.7;
inline constexpr double kShareOfHand = 0.02;  // of a second: what a moving hand takes where none was measured
inline constexpr double kMostLate = 0.01;     // share of ticks; counts only above half of kMostShare

// The thread with the least load that takes another session; nullopt if none does. A session is thought to take at
// least half of kShareOfHand, because a hand that rests now may move later.
std::optional<std::size_t> placeOfNext(std::span<const TickerLoad> threads);

class TickerPool {
 public:
  TickerPool(std::size_t threads, const std::function<void()>& after_round);

  std::vector<Ticker*> tickers() const;
  Ticker& ticker(std::size_t thread) const { return *threads_[thread].ticker; }
  // Takes a place on a thread until leave(); nullopt if every thread has enough to do.
  std::optional<std::size_t> enter();
  void leave(std::size_t thread);
  // Takes the figures of all threads anew if the last ones are half a second old. Call it some times a second.
  void observe();
  // Of all threads together; of longest_us the largest.
  TickerCounters counters() const;

 private:
  struct Thread {
    std::unique_ptr<Ticker> ticker;
    TickerCounters seen{};  // when the figures of `load` were taken
    TickerLoad load{};
  };
  mutable std::mutex mutex_;
  std::vector<Thread> threads_;
  std::chrono::steady_clock::time_point observed_ = std::chrono::steady_clock::now();
};

}  // namespace filiform::tools
