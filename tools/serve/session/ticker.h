// Ticker: one thread that ticks many things a thousand times a second, by an absolute clock. It sleeps while there is
// nothing to tick. Thread rule: internally synchronised; tick() and afterAll() of what it ticks run on its thread.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace filiform::tools {

class Ticked {
 public:
  virtual ~Ticked() = default;
  // `period`: number of the period since the ticker began, from 1; the same for all in a round. Haptic-safe.
  virtual void tick(std::uint64_t period) noexcept = 0;
  // After the ticks of all: work that may wait. `free_s`: until the next round. Haptic-safe.
  virtual void afterAll(double /*free_s*/) noexcept {}
};

struct TickerCounters {
  std::uint64_t rounds = 0;      // in which something was ticked
  std::uint64_t ticks = 0;       // of all
  std::uint64_t due = 0;         // ticks that were due, those of left-out periods included
  std::uint64_t late = 0;        // of those: left out, or ended more than a period after they were due
  std::uint64_t longest_us = 0;  // longest round
  std::uint64_t busy_ns = 0;     // processor time of the thread
};

class Ticker {
 public:
  static constexpr std::uint64_t kPeriod_ns = 1'000'000;

  // `after_round`: called on the ticking thread after the ticks of each round; it must not wait.
  explicit Ticker(std::function<void()> after_round);
  ~Ticker();
  Ticker(const Ticker&) = delete;
  Ticker& operator=(const Ticker&) = delete;

  // First are ticked those with `first`, then the others, which begin in turn from round to round. Waits for the end of
  // the round. What is added must stay until remove() has returned.
  void add(Ticked& one, bool first = false);
  void remove(Ticked& one);

  TickerCounters counters() const;
  // Why the thread has no real-time priority; empty if it has.
  std::string refusal() const;

 private:
  void run();
  void change(const std::function<void()>& edit);
  bool takeChange();

  const std::function<void()> after_round_;
  mutable std::mutex mutex_;
  std::condition_variable wake_, taken_;
  std::vector<Ticked*> wanted_first_, wanted_;  // under the mutex
  std::uint64_t wanted_version_ = 0, taken_version_ = 0;
  std::atomic<bool> changed_{false};
  bool stopping_ = false;
  std::string refusal_;
  std::vector<Ticked*> first_, all_;  // the ticking thread's
  std::atomic<std::uint64_t> rounds_{0}, ticks_{0}, due_{0}, late_{0}, longest_us_{0};
  std::thread thread_;
};

}  // namespace filiform::tools
