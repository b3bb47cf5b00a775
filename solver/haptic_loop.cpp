#include "solver/haptic_loop.h"

#include "index/errors.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <future>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>

namespace filiform {
namespace {

std::int64_t now_ns() noexcept {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

void sleepUntil(std::int64_t time_ns) noexcept {
  timespec t{};
  t.tv_sec = static_cast<time_t>(time_ns / 1'000'000'000);
  t.tv_nsec = static_cast<long>(time_ns % 1'000'000'000);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

// Faults in the pages of the stack that the tick may come to use, before the first tick.
[[gnu::noinline]] void touchStack() noexcept {
  volatile char pages[128 * 1024];
  for (std::size_t i = 0; i < sizeof pages; i += 1024) pages[i] = 0;
}

// Empty if all memory, present and to come, is now locked as it is touched.
std::string lockMemory() {
  // Locked under a small limit, later allocations of the whole program would fail: better not at all.
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur < (rlim_t{1} << 40))
    return "the limit is " + std::to_string(limit.rlim_cur / 1024) + " KiB";
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0) return std::strerror(errno);
  return {};
}

}  // namespace

HapticLoop::HapticLoop(HapticDevice& device, Tick tick, const HapticLoopOptions& options)
    : device_(device), tick_(std::move(tick)), options_(options), metrics_(options.ring_ticks) {
  if (!(options.rate_Hz > 0 && std::isfinite(options.rate_Hz)))
    throw UsageError("the rate of the haptic loop must be finite and > 0 Hz");
}

HapticLoop::~HapticLoop() { stop(); }

void HapticLoop::start() {
  if (thread_.joinable()) {
    if (running()) return;
    thread_.join();
  }
  refusals_.clear();
  stopping_ = false;
  fault_ = Fault::none;
  std::promise<void> prepared;
  std::future<void> is_prepared = prepared.get_future();
  running_ = true;
  thread_ = std::thread([this, &prepared] {
    prepareThread();
    prepared.set_value();
    run();
  });
  is_prepared.wait();
}

void HapticLoop::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  if (memory_locked_) munlockall();
  memory_locked_ = false;
}

std::string HapticLoop::fault() const {
  switch (fault_.load(std::memory_order_acquire)) {
    case Fault::none:
      break;
    case Fault::device:
      return "the device was lost: its force is off; reconnect it and start again";
    case Fault::tick:
      return "the haptic tick failed with an exception: the force is off";
  }
  return {};
}

void HapticLoop::prepareThread() {
  touchStack();
  if (options_.lock_memory) {
    const std::string refused = lockMemory();
    memory_locked_ = refused.empty();
    if (!memory_locked_)
      refusals_.push_back("memory could not be locked (" + refused +
                          "): a page that was swapped out may delay a tick by milliseconds; raise the memlock limit");
  }
  if (options_.realtime_priority) {
    sched_param parameters{};
    parameters.sched_priority = options_.priority;
    if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters))
      refusals_.push_back(std::string("real-time priority was refused (") + std::strerror(error) +
                          "): other programs may delay ticks by milliseconds; raise the rtprio limit");
  }
}

void HapticLoop::run() noexcept {
  try {
    loop();
  } catch (...) {
    fault_.store(Fault::tick, std::memory_order_release);
  }
  device_.exchange(Wrench{});
  running_.store(false, std::memory_order_release);
}

void HapticLoop::loop() {
  const bool device_paces = device_.capabilities().paces_loop;
  const double period_s = 1.0 / options_.rate_Hz;
  const auto period_ns = std::max<std::int64_t>(1, static_cast<std::int64_t>(1e9 * period_s));
  const auto watchdog_ns = static_cast<std::int64_t>(1e9 * options_.watchdog_s);
  const std::int64_t begin_ns = now_ns();
  std::int64_t due_ns = begin_ns, last_start_ns = begin_ns, moved_ns = begin_ns;
  double device_time_s = -1;
  Wrench wrench;
  while (!stopping_.load(std::memory_order_acquire)) {
    if (!device_paces) sleepUntil(due_ns);
    LoopTick times;
    const std::int64_t start_ns = now_ns();
    if (!device_paces) times.wake_ns = start_ns - due_ns;
    times.start_ns = start_ns - begin_ns;
    times.period_ns = start_ns - last_start_ns;
    last_start_ns = start_ns;

    const DeviceState state = device_.exchange(wrench);
    const std::int64_t exchanged_ns = now_ns();
    times.exchange_ns = exchanged_ns - start_ns;
    if (state.status == DeviceStatus::fault) {
      fault_.store(Fault::device, std::memory_order_release);
      return;
    }

    const double elapsed_s = state.time_s - device_time_s;
    const bool moved = state.time_s != device_time_s;
    if (moved) moved_ns = exchanged_ns;
    const double dt_s = device_time_s >= 0 && elapsed_s > 0 && elapsed_s < 1 ? elapsed_s : period_s;
    device_time_s = state.time_s;
    const bool stale = watchdog_ns > 0 && exchanged_ns - moved_ns > watchdog_ns;
    if (stale) stale_ticks_.fetch_add(1, std::memory_order_relaxed);

    wrench = tick_(state, dt_s);
    if (stale || state.status != DeviceStatus::ready || !wrench.force_N.allFinite() || !wrench.torque_Nm.allFinite())
      wrench = Wrench{};

    // Late ticks are skipped, never caught up: a burst of ticks would feed the hand stale forces.
    const std::int64_t end_ns = now_ns();
    due_ns += period_ns;
    times.compute_ns = end_ns - exchanged_ns;
    times.missed = device_paces ? metrics_.ticks() > 0 && 2 * times.period_ns > 3 * period_ns : end_ns > due_ns;
    if (end_ns > due_ns) due_ns += (end_ns - due_ns) / period_ns * period_ns + period_ns;
    metrics_.record(times);
    ticks_.fetch_add(1, std::memory_order_relaxed);
  }
}

}  // namespace filiform
