#include "solver/loop/haptic_loop.h"

#include "index/errors.h"
#include "solver/force/force_hold.h"
#include "solver/loop/loop_gate.h"

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

// Touches the stack pages that a tick may use, so that no tick causes a page fault.
[[gnu::noinline]] void touchStack() noexcept {
  volatile char pages[128 * 1024];
  for (std::size_t i = 0; i < sizeof pages; i += 1024) pages[i] = 0;
}

// Locks all current and future memory pages as they are touched. Returns an empty string, or the reason of a refusal.
std::string lockMemory() {
  // With a small limit, later allocations of the whole program would fail: do not lock at all.
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
  device_fades_ = device.capabilities().renders_model;
  if (!(options.rate_Hz > 0 && std::isfinite(options.rate_Hz)))
    throw UsageError("the rate of the haptic loop must be finite and > 0 Hz");
  if (!(options.stall_s >= 0 && std::isfinite(options.stall_s)))
    throw UsageError("the stall time of the haptic loop must be finite and >= 0 s");
  static_cast<void>(LoopGate(gateOptions()));  // throws now, not on the haptic thread
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
  released_ns_ = now_ns();
  try {
    thread_ = std::thread([this, &prepared] {
      prepareThread(options_.priority, true);
      prepared.set_value();
      run();
    });
    is_prepared.wait();
    if (stall_ns_ > 0) startGuard();
  } catch (...) {
    stop();
    running_ = false;
    throw;
  }
}

void HapticLoop::startGuard() {
  guard_stopping_ = false;
  internal::forceHolds().guards.fetch_add(1);
  try {
    guard_ = std::thread([this] {
      prepareThread(options_.priority + 1, false);  // higher priority: a tick that spins must not block the guard
      guard();
    });
  } catch (...) {
    internal::forceHolds().guards.fetch_sub(1);
    throw;
  }
}

LoopGateOptions HapticLoop::gateOptions() const noexcept {
  return {1.0 / options_.rate_Hz, options_.watchdog_s, options_.ramp_s, options_.fade_s, options_.ramp_at_start};
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
      if (const char* const advice = device_.advice(); *advice != '\0')
        return std::string(advice) + "; the force is off" +
               (std::strstr(advice, "start again") == nullptr ? "; start again afterwards" : "");
      return "the device was lost and its force is off; reconnect the device and start again";
    case Fault::tick:
      return "an exception ended the haptic tick; the force is off";
  }
  return {};
}

void HapticLoop::prepareThread(int priority, bool tell) {
  giveSignalStack();
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
    // If the device paces the loop, this thread holds it nearly always: leave it free when a hold is wanted, for the
    // guard.
    const bool leave =
        holds_wanted.load(std::memory_order_relaxed) > 0 && stall_ns_ > 0 && !stopping_.load(std::memory_order_relaxed);
    Holder nobody = Holder::nobody;
    if (!leave && holder_.compare_exchange_strong(nobody, Holder::haptic, std::memory_order_acquire)) return;
    sleepUntil(now_ns() + 100'000);
  }
}

void HapticLoop::releaseDevice() noexcept {
  released_ns_.store(now_ns(), std::memory_order_relaxed);
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
  releaseDevice();
  running_.store(false, std::memory_order_release);
}

void HapticLoop::guard() noexcept {
  internal::ForceHolds& holds = internal::forceHolds();
  bool held = false;
  while (!guard_stopping_.load(std::memory_order_acquire)) {
    sleepUntil(now_ns() + kGuardPeriod_ns);
    const bool wanted = holds.wanted.load(std::memory_order_acquire) > 0 && !stopping_.load(std::memory_order_acquire);
    const bool stalled =
        !device_fades_ && running() && now_ns() - released_ns_.load(std::memory_order_relaxed) > stall_ns_;
    if (!held && (wanted || stalled)) {
      Holder nobody = Holder::nobody;
      if (!holder_.compare_exchange_strong(nobody, Holder::guard, std::memory_order_acquire)) continue;
      // The haptic thread may have exchanged between the two tests: test again.
      if (wanted || now_ns() - released_ns_.load(std::memory_order_relaxed) > stall_ns_) {
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
  const auto period_ns = std::max<std::int64_t>(1, static_cast<std::int64_t>(1e9 / options_.rate_Hz));
  const std::int64_t begin_ns = now_ns();
  std::int64_t due_ns = begin_ns, last_start_ns = begin_ns;
  LoopGate gate(gateOptions());
  std::uint64_t guarded_before = guard_exchanges_.load(std::memory_order_relaxed);
  bool computed = false, ending = false;
  for (;;) {
    if (!ending && stopping_.load(std::memory_order_acquire)) {
      ending = true;
      gate.end();
    }
    if (ending && gate.ended()) return;
    if (!device_paces) sleepUntil(due_ns);
    takeDevice();
    LoopTick times;
    const std::int64_t start_ns = now_ns();
    const std::uint64_t guarded = guard_exchanges_.load(std::memory_order_relaxed);
    const bool late = !device_fades_ && start_ns - released_ns_.load(std::memory_order_relaxed) > stall_ns_;
    if (computed && stall_ns_ > 0 && (late || guarded != guarded_before)) {
      times.interrupted = true;
      interruptions_.fetch_add(1, std::memory_order_relaxed);
      gate.interrupt();
    }
    computed = true;
    guarded_before = guarded;
    if (!device_paces) times.wake_ns = start_ns - due_ns;
    times.start_ns = start_ns - begin_ns;
    times.period_ns = start_ns - last_start_ns;
    last_start_ns = start_ns;

    times.force_N = gate.wrench().force_N.norm();
    DeviceState state = device_.exchange(gate.wrench());
    releaseDevice();
    const std::int64_t exchanged_ns = now_ns();
    times.exchange_ns = exchanged_ns - start_ns;
    if (state.status == DeviceStatus::fault) {
      fault_.store(Fault::device, std::memory_order_release);
      return;
    }

    const double dt_s = gate.take(state, 1e-9 * static_cast<double>(exchanged_ns - begin_ns));
    if (gate.stale()) stale_ticks_.fetch_add(1, std::memory_order_relaxed);
    gate.put(tick_(state, dt_s), withheld_.load(std::memory_order_relaxed));

    // Late ticks are skipped, not repeated: a burst of ticks would send outdated forces to the hand.
    const std::int64_t end_ns = now_ns();
    due_ns += period_ns;
    times.compute_ns = end_ns - exchanged_ns;
    times.missed = device_paces ? metrics_.ticks() > 0 && 2 * times.period_ns > 3 * period_ns : end_ns > due_ns;
    if (end_ns > due_ns) due_ns += (end_ns - due_ns) / period_ns * period_ns + period_ns;
    metrics_.record(times);
    ticks_.fetch_add(1, std::memory_order_relaxed);
    if (options_.idle) options_.idle(device_paces ? 0.0 : 1e-9 * static_cast<double>(due_ns - end_ns));
  }
}

}  // namespace filiform
