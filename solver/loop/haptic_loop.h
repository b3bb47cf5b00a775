// The haptic thread: once a period, it exchanges data with the device and computes a tick.
//
//   HapticLoop loop(device, [&](const DeviceState& state, double dt_s) {
//     return navigation.tick(state, dt_s).wrench;
//   });
//   loop.start();
//   std::this_thread::sleep_for(std::chrono::seconds(10));
//   loop.stop();
//   loop.metrics().writeCsv(out);
//
// The last wrench that the device gets is zero, however the loop ends: by stop(), by a fault of the device, by an
// exception in the tick, or by destruction.
//
// While the loop runs, a force is never older than stall_s. A second thread, the guard, ensures this. If the haptic
// thread does not come back to the device in time (a tick blocks, or the thread is not scheduled), the guard exchanges
// instead, and sends zero force until the haptic thread comes back. The wrench of the late tick is not sent, and force
// grows from zero over ramp_s. The same happens after the whole process was stopped. Signal handlers can request zero
// force from the guard (force_hold.h).
//
// A device with renders_model (a bridge) renders the local model of the last wrench for its time to live, and then lets
// the force fade by itself. So the guard leaves it alone, a late wrench is sent, and the bridge alone ramps.
//
// One atomic word says which thread has the device. The haptic thread has the device only during an exchange; the guard
// can take it between exchanges. So the haptic thread waits for the guard only if it comes back late while the guard
// exchanges. The device's contract bounds the duration of an exchange (haptic_device.h).
//
// Thread rule: start(), stop() and the destructor belong to one thread. Any thread may call running() and fault().
// metrics() may be read while the loop does not run, refusals() as soon as start() has returned. Two threads exchange
// with the device, never at the same time, and each sees what the other did before.
#pragma once

#include "device/haptic_device.h"
#include "solver/loop/loop_gate.h"
#include "solver/loop/loop_metrics.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace filiform {

struct HapticLoopOptions {
  double rate_Hz = 1000;          // of the clock; not used if the device paces the loop
  bool realtime_priority = true;  // ask for SCHED_FIFO
  int priority = 80;              // 99 would compete with the kernel's own threads
  bool lock_memory = true;        // ask to keep all memory from being paged out while the loop runs
  // If the device's time stands still for this long (s), the force is zero until it moves again. 0: never.
  double watchdog_s = 0.015;
  // Greatest age (s) of a force before the guard takes the device; at least 2 periods. If the clock paces the loop, a
  // period is added. 0: no guard.
  double stall_s = 0.010;
  // After an interruption (stall, still clock, stopped process) force grows from zero over this time (s).
  double ramp_s = 0.5;
  double fade_s = 0.05;           // stop() lets the force fall to zero over this time (s); above 5 N, at 100 N/s
  bool ramp_at_start = true;      // also at the first ready state; false if the tick has its own ramp
  std::size_t ring_ticks = 4096;  // the metrics keep all figures of this number of newest ticks
  // Called on the haptic thread once a period, after the tick, with the time (s) until the next exchange: for work that
  // must not delay the force. If the device paces the loop, the time is 0, because the force is sent right after. The
  // rules of Tick apply. Empty: not called.
  std::function<void(double free_s)> idle{};
};

class HapticLoop {
 public:
  // Called once a period with the newest state and the time since the state before (s), as TickClock measures it. The
  // state's sent_N is the force that was really sent. Must not allocate, lock or wait. The next exchange sends the
  // returned wrench, limited by LoopGate. An exception ends the loop.
  using Tick = std::function<Wrench(const DeviceState&, double dt_s)>;

  // The device must be open and outlive the loop. While the loop runs, no other code may exchange with it. Throws
  // UsageError for a rate that is not > 0 and finite, and for a time that is negative or not finite.
  HapticLoop(HapticDevice& device, Tick tick, const HapticLoopOptions& options = {});
  ~HapticLoop();
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  // Returns when the thread has its priority. Does nothing while the loop runs. Metrics are not reset. Throws
  // std::system_error if a thread cannot be created; the loop then does not run.
  void start();
  // Lets the force fade over fade_s while ticks continue, then sends zero force and ends the thread. Further calls do
  // nothing.
  void stop() noexcept;

  // While withheld, the force is zero whatever the tick computes. Afterwards it grows from zero over ramp_s. Any
  // thread.
  void withhold(bool withheld) noexcept { withheld_.store(withheld, std::memory_order_relaxed); }

  bool running() const noexcept { return running_.load(std::memory_order_acquire); }
  // Why the loop ended by itself; empty if it did not end by itself.
  std::string fault() const;
  // For the user, one line each: the setting that the system refused, and the consequence.
  const std::vector<std::string>& refusals() const { return refusals_; }
  const LoopMetrics& metrics() const { return metrics_; }
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }              // any thread
  std::uint64_t stale_ticks() const noexcept { return stale_ticks_.load(std::memory_order_relaxed); }  // any thread
  // Number of wrenches that were too old to be sent; number of exchanges by the guard. Any thread.
  std::uint64_t interruptions() const noexcept { return interruptions_.load(std::memory_order_relaxed); }
  std::uint64_t guard_exchanges() const noexcept { return guard_exchanges_.load(std::memory_order_relaxed); }

 private:
  enum class Fault : std::uint8_t { none, device, tick };
  enum class Holder : std::uint8_t { nobody, haptic, guard };
  void startGuard();
  LoopGateOptions gateOptions() const noexcept;
  void prepareThread(int priority, bool tell);
  void loop();
  void run() noexcept;
  void guard() noexcept;
  void takeDevice() noexcept;
  void releaseDevice() noexcept;

  HapticDevice& device_;
  Tick tick_;
  HapticLoopOptions options_;
  LoopMetrics metrics_;
  std::vector<std::string> refusals_;
  std::int64_t stall_ns_ = 0;
  std::thread thread_, guard_;
  std::atomic<bool> running_{false}, stopping_{false}, guard_stopping_{false};
  std::atomic<bool> withheld_{false};
  std::atomic<Holder> holder_{Holder::nobody};
  std::atomic<std::int64_t> released_ns_{0};  // when the haptic thread last released the device
  std::atomic<Fault> fault_{Fault::none};
  std::atomic<std::uint64_t> ticks_{0}, stale_ticks_{0}, interruptions_{0}, guard_exchanges_{0};
  bool memory_locked_ = false;
  bool device_fades_ = false;  // renders_model
};

}  // namespace filiform
