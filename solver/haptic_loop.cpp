#include "solver/haptic_loop.h"

#include "index/errors.h"
#include "solver/force_hold.h"

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

constexpr std::int64_t kGuardPeriod_ns = 2'000'000;

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
  if (options_.stall_s > 0) {
    const double period_s = 1.0 / options_.rate_Hz;
    const double between_s = options_.stall_s + (device_.capabilities().paces_loop ? 0.0 : period_s);
    stall_ns_ = static_cast<std::int64_t>(1e9 * std::min(std::max(between_s, 2 * period_s), 1e6));
  }
}

HapticLoop::~HapticLoop() { stop(); }

void HapticLoop::start() {
  if (thread_.joinable()) {
    if (running()) return;
    stop();
  }
  refusals_.clear();
  stopping_ = false;
  fault_ = Fault::none;
  std::promise<void> prepared;
  std::future<void> is_prepared = prepared.get_future();
  running_ = true;
  laid_back_ns_ = now_ns();
  thread_ = std::thread([this, &prepared] {
    prepareThread(options_.priority, true);
    prepared.set_value();
    run();
  });
  is_prepared.wait();
  if (stall_ns_ > 0) {
    guard_stopping_ = false;
    internal::forceHolds().guards.fetch_add(1);
    guard_ = std::thread([this] {
      prepareThread(options_.priority + 1, false);  // a tick that spins must not keep the guard from running
      guard();
    });
  }
}

void HapticLoop::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  guard_stopping_.store(true, std::memory_order_release);
  if (guard_.joinable()) guard_.join();
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

void HapticLoop::prepareThread(int priority, bool tell) {
  touchStack();
  if (options_.lock_memory && tell) {
    const std::string refused = lockMemory();
    memory_locked_ = refused.empty();
    if (!memory_locked_)
      refusals_.push_back("memory could not be locked (" + refused +
                          "): a page that was swapped out may delay a tick by milliseconds; raise the memlock limit");
  }
  if (options_.realtime_priority) {
    sched_param parameters{};
    parameters.sched_priority = priority;
    if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters); error != 0 && tell)
      refusals_.push_back(std::string("real-time priority was refused (") + std::strerror(error) +
                          "): other programs may delay ticks by milliseconds; raise the rtprio limit");
  }
}

void HapticLoop::takeDevice() noexcept {
  const std::atomic<int>& holds_wanted = internal::forceHolds().wanted;
  for (;;) {
    // A device that paces the loop is nearly always taken: left lying for a hold, the guard comes to it.
    const bool leave =
        holds_wanted.load(std::memory_order_relaxed) > 0 && stall_ns_ > 0 && !stopping_.load(std::memory_order_relaxed);
    Holder nobody = Holder::nobody;
    if (!leave && holder_.compare_exchange_strong(nobody, Holder::haptic, std::memory_order_acquire)) return;
    sleepUntil(now_ns() + 100'000);
  }
}

void HapticLoop::layDeviceBack() noexcept {
  laid_back_ns_.store(now_ns(), std::memory_order_relaxed);
  holder_.store(Holder::nobody, std::memory_order_release);
}

void HapticLoop::run() noexcept {
  try {
    loop();
  } catch (...) {
    fault_.store(Fault::tick, std::memory_order_release);
  }
  takeDevice();
  device_.relax();
  layDeviceBack();
  running_.store(false, std::memory_order_release);
}

void HapticLoop::guard() noexcept {
  internal::ForceHolds& holds = internal::forceHolds();
  bool held = false;
  while (!guard_stopping_.load(std::memory_order_acquire)) {
    sleepUntil(now_ns() + kGuardPeriod_ns);
    const bool wanted = holds.wanted.load(std::memory_order_acquire) > 0 && !stopping_.load(std::memory_order_acquire);
    const bool stalled = running() && now_ns() - laid_back_ns_.load(std::memory_order_relaxed) > stall_ns_;
    if (!held && (wanted || stalled)) {
      Holder nobody = Holder::nobody;
      if (!holder_.compare_exchange_strong(nobody, Holder::guard, std::memory_order_acquire)) continue;
      // Between the two looks the haptic thread may have been at the device.
      if (wanted || now_ns() - laid_back_ns_.load(std::memory_order_relaxed) > stall_ns_) {
        device_.relax();
        guard_exchanges_.fetch_add(1, std::memory_order_relaxed);
      }
      held = wanted;
      if (held)
        holds.held.fetch_add(1);
      else
        holder_.store(Holder::nobody, std::memory_order_release);
    } else if (held && wanted) {
      device_.relax();
      guard_exchanges_.fetch_add(1, std::memory_order_relaxed);
    } else if (held) {
      held = false;
      holds.held.fetch_sub(1);
      holder_.store(Holder::nobody, std::memory_order_release);
    }
  }
  if (held) {
    holds.held.fetch_sub(1);
    holder_.store(Holder::nobody, std::memory_order_release);
  }
  holds.guards.fetch_sub(1);
}

void HapticLoop::loop() {
  const bool device_paces = device_.capabilities().paces_loop;
  const double period_s = 1.0 / options_.rate_Hz;
  const auto period_ns = std::max<std::int64_t>(1, static_cast<std::int64_t>(1e9 * period_s));
  const auto watchdog_ns = static_cast<std::int64_t>(1e9 * options_.watchdog_s);
  const std::int64_t begin_ns = now_ns();
  std::int64_t due_ns = begin_ns, last_start_ns = begin_ns, moved_ns = begin_ns;
  double device_time_s = -1;
  constexpr std::int64_t kFullForce = -1;
  const auto ramp_ns = static_cast<std::int64_t>(1e9 * std::max(options_.ramp_s, 0.0));
  std::int64_t ramp_from_ns = options_.ramp_at_start ? begin_ns : kFullForce;
  bool computed = false, was_ready = false;  // there is a wrench of a tick; the state before was ready
  Wrench wrench;
  while (!stopping_.load(std::memory_order_acquire)) {
    if (!device_paces) sleepUntil(due_ns);
    takeDevice();
    LoopTick times;
    const std::int64_t start_ns = now_ns();
    if (computed && stall_ns_ > 0 && start_ns - laid_back_ns_.load(std::memory_order_relaxed) > stall_ns_) {
      times.interrupted = true;
      interruptions_.fetch_add(1, std::memory_order_relaxed);
      ramp_from_ns = start_ns;
      wrench = Wrench{};
    }
    computed = true;
    if (!device_paces) times.wake_ns = start_ns - due_ns;
    times.start_ns = start_ns - begin_ns;
    times.period_ns = start_ns - last_start_ns;
    last_start_ns = start_ns;

    times.force_N = wrench.force_N.norm();
    const DeviceState state = device_.exchange(wrench);
    layDeviceBack();
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
    const bool ready = state.status == DeviceStatus::ready;
    const bool withheld = withheld_.load(std::memory_order_relaxed);
    if (stale || withheld || (ready && !was_ready && options_.ramp_at_start)) ramp_from_ns = exchanged_ns;
    was_ready = ready;
    if (stale || withheld || !ready || !wrench.force_N.allFinite() || !wrench.torque_Nm.allFinite()) wrench = Wrench{};
    if (ramp_from_ns != kFullForce) {
      const std::int64_t since_ns = exchanged_ns - ramp_from_ns;
      if (since_ns >= ramp_ns) {
        ramp_from_ns = kFullForce;
      } else {
        const double part = static_cast<double>(since_ns) / static_cast<double>(ramp_ns);
        wrench.force_N *= part;
        wrench.torque_Nm *= part;
      }
    }

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
