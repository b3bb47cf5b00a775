#include "tools/serve/session/ticker.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <pthread.h>
#include <sched.h>

namespace filiform::tools {

namespace {

constexpr int kTickerPriority = 40;  // below that of a haptic loop of this machine

std::uint64_t now_ns(clockid_t clock = CLOCK_MONOTONIC) {
  timespec now{};
  ::clock_gettime(clock, &now);
  return static_cast<std::uint64_t>(now.tv_sec) * 1'000'000'000u + static_cast<std::uint64_t>(now.tv_nsec);
}

void sleepUntil_ns(std::uint64_t when_ns) {
  const timespec when{static_cast<time_t>(when_ns / 1'000'000'000u), static_cast<long>(when_ns % 1'000'000'000u)};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, nullptr) == EINTR) {
  }
}

}  // namespace

Ticker::Ticker(std::function<void()> after_round) : after_round_(std::move(after_round)), thread_([this] { run(); }) {}

Ticker::~Ticker() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    changed_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void Ticker::change(const std::function<void()>& edit) {
  std::unique_lock lock(mutex_);
  edit();
  const std::uint64_t version = ++wanted_version_;
  changed_ = true;
  wake_.notify_all();
  taken_.wait(lock, [&] { return taken_version_ >= version; });
}

void Ticker::add(Ticked& one, bool first) {
  change([&] { (first ? wanted_first_ : wanted_).push_back(&one); });
}

void Ticker::remove(Ticked& one) {
  change([&] {
    std::erase(wanted_first_, &one);
    std::erase(wanted_, &one);
  });
}

// Between rounds. Waits while there is nothing to tick; true if it waited.
bool Ticker::takeChange() {
  std::unique_lock lock(mutex_);
  bool waited = false;
  do {
    first_ = wanted_first_;
    all_ = wanted_;
    taken_version_ = wanted_version_;
    taken_.notify_all();
    changed_ = false;
    if (stopping_ || !all_.empty() || !first_.empty()) break;
    waited = true;
    wake_.wait(lock, [&] { return stopping_ || changed_; });
  } while (!stopping_);
  return waited;
}

void Ticker::run() {
  sched_param parameters{};
  parameters.sched_priority = kTickerPriority;
  if (const int error = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &parameters); error != 0) {
    const std::lock_guard lock(mutex_);
    refusal_ = std::string("real-time priority was refused (") + std::strerror(error) +
               "): other programs may delay ticks by milliseconds; raise the rtprio limit";
  }
  std::uint64_t begin_ns = now_ns(), period = 0;
  for (;;) {
    if (changed_ || (all_.empty() && first_.empty())) {
      const bool waited = takeChange();
      {
        const std::lock_guard lock(mutex_);
        if (stopping_) return;
      }
      if (waited) period = std::max(period, (now_ns() - begin_ns) / kPeriod_ns);  // nothing was missed meanwhile
    }
    sleepUntil_ns(begin_ns + (period + 1) * kPeriod_ns);
    const std::uint64_t woken_ns = now_ns();
    const std::uint64_t reached = std::max(period + 1, (woken_ns - begin_ns) / kPeriod_ns);
    const std::uint64_t left_out = reached - period - 1, count = all_.size();
    period = reached;
    const std::uint64_t end_ns = begin_ns + (period + 1) * kPeriod_ns;  // of this period
    for (Ticked* const one : first_) one->tick(period);
    std::uint64_t late = left_out * count;
    for (std::uint64_t i = 0; i < count; ++i) all_[(period + i) % count]->tick(period);
    const std::uint64_t ticked_ns = now_ns();
    if (ticked_ns > end_ns) late += count;
    after_round_();
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t now = now_ns();
      if (now >= end_ns) break;
      all_[(period + i) % count]->afterAll(1e-9 * static_cast<double>(end_ns - now));
    }
    rounds_.fetch_add(1, std::memory_order_relaxed);
    ticks_.fetch_add(count, std::memory_order_relaxed);
    due_.fetch_add(count * (left_out + 1), std::memory_order_relaxed);
    late_.fetch_add(late, std::memory_order_relaxed);
    const std::uint64_t us = (ticked_ns - woken_ns) / 1000;
    if (us > longest_us_.load(std::memory_order_relaxed)) longest_us_.store(us, std::memory_order_relaxed);
  }
}

TickerCounters Ticker::counters() const {
  clockid_t clock{};
  const bool known = ::pthread_getcpuclockid(const_cast<std::thread&>(thread_).native_handle(), &clock) == 0;
  return {rounds_.load(), ticks_.load(), due_.load(), late_.load(), longest_us_.load(), known ? now_ns(clock) : 0};
}

std::string Ticker::refusal() const {
  const std::lock_guard lock(mutex_);
  return refusal_;
}

}  // namespace filiform::tools
