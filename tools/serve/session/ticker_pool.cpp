#include "tools/serve/session/ticker_pool.h"

#include <algorithm>

namespace filiform::tools {

std::optional<std::size_t> placeOfNext(std::span<const TickerLoad> threads) {
  std::optional<std::size_t> best;
  double least = 0;
  for (std::size_t i = 0; i < threads.size(); ++i) {
    const TickerLoad& load = threads[i];
    const std::size_t measured = load.sessions - load.newcomers;
    const double hand =
        measured > 0 ? std::max(load.share / static_cast<double>(measured), kShareOfHand / 2) : kShareOfHand;
    const double rest = std::max(load.share, static_cast<double>(measured) * kShareOfHand / 2);
    const double then = rest + static_cast<double>(load.newcomers + 1) * hand;
    if (then > kMostShare || (best && then >= least) || (load.late > kMostLate && load.share > kMostShare / 2))
      continue;
    best = i;
    least = then;
  }
  return best;
}

TickerPool::TickerPool(std::size_t threads, const std::function<void()>& after_round) : threads_(threads) {
  for (Thread& thread : threads_) thread.ticker = std::make_unique<Ticker>(after_round);
}

std::vector<Ticker*> TickerPool::tickers() const {
  std::vector<Ticker*> all;
  for (const Thread& thread : threads_) all.push_back(thread.ticker.get());
  return all;
}

std::optional<std::size_t> TickerPool::enter() {
  const std::lock_guard lock(mutex_);
  std::vector<TickerLoad> loads;
  for (const Thread& thread : threads_) loads.push_back(thread.load);
  const std::optional<std::size_t> place = placeOfNext(loads);
  if (place) {
    ++threads_[*place].load.sessions;
    ++threads_[*place].load.newcomers;
  }
  return place;
}

void TickerPool::leave(std::size_t thread) {
  const std::lock_guard lock(mutex_);
  TickerLoad& load = threads_[thread].load;
  --load.sessions;
  load.newcomers = std::min(load.newcomers, load.sessions);
}

void TickerPool::observe() {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const double since_s = std::chrono::duration<double>(now - observed_).count();
  if (since_s < 0.5) return;
  observed_ = now;
  for (Thread& thread : threads_) {
    const TickerCounters counters = thread.ticker->counters();
    const std::uint64_t due = counters.due - thread.seen.due;
    thread.load.share = 1e-9 * static_cast<double>(counters.busy_ns - thread.seen.busy_ns) / since_s;
    thread.load.late = due == 0 ? 0 : static_cast<double>(counters.late - thread.seen.late) / static_cast<double>(due);
    thread.load.newcomers = 0;
    thread.seen = counters;
  }
}

TickerCounters TickerPool::counters() const {
  TickerCounters all;
  for (const Thread& thread : threads_) {
    const TickerCounters one = thread.ticker->counters();
    all.rounds += one.rounds;
    all.ticks += one.ticks;
    all.due += one.due;
    all.late += one.late;
    all.busy_ns += one.busy_ns;
    all.longest_us = std::max(all.longest_us, one.longest_us);
  }
  return all;
}

}  // namespace filiform::tools
