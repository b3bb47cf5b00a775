// The thread that never waits for anything but the clock or the device: exchange, tick, exchange, tick.
//
//   HapticLoop loop(device, [&](const DeviceState& state, double dt_s) { return navigation.tick(state, dt_s).wrench; },
//   options); loop.start();  ...  loop.stop();  loop.metrics().writeCsv(out);
//
// Whatever ends the loop (stop(), a fault of the device, an exception in the tick, destruction), the last thing that
// the device is sent is zero force. Thread rule: start, stop and the destructor belong to one thread; running() and
// fault() to any; metrics() and refusals() may be read while the loop does not run, refusals() as soon as start() has
// returned.
#pragma once

#include "device/haptic_device.h"
#include "solver/loop_metrics.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

namespace filiform {

struct HapticLoopOptions {
  double rate_Hz = 1000;          // of the clock, where the device does not pace the loop itself
  bool realtime_priority = true;  // ask for SCHED_FIFO
  int priority = 80;              // 99 would compete with the kernel's own threads
  bool lock_memory = true;        // ask that nothing be paged out while the loop runs
  // A device whose time stands still for so long (s) is taken for dead: zero force until it moves again. 0: never.
  double watchdog_s = 0.1;
  std::size_t ring_ticks = 4096;  // kept whole by the metrics
};

class HapticLoop {
 public:
  // Called once a period with the newest state and the time since the one before (s; the period where the device's
  // clock does not say). Must not allocate, lock or wait. What it returns goes out with the next exchange, unless the
  // device is not ready or stale, or the force is not finite: then zero does. An exception ends the loop.
  using Tick = std::function<Wrench(const DeviceState&, double dt_s)>;

  // The device must be open, and outlive the loop; nobody else may exchange with it while the loop runs. Throws
  // UsageError for a rate that is not > 0 and finite.
  HapticLoop(HapticDevice& device, Tick tick, const HapticLoopOptions& options = {});
  ~HapticLoop();
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  // Returns when the thread has its priority. Starting a loop that runs does nothing; metrics go on counting.
  void start();
  // Zero force, then the thread ends. Idempotent.
  void stop() noexcept;

  bool running() const noexcept { return running_.load(std::memory_order_acquire); }
  // Why the loop ended by itself; empty if it did not.
  std::string fault() const;
  // What the system refused, and what that means for the person: one line each.
  const std::vector<std::string>& refusals() const { return refusals_; }
  const LoopMetrics& metrics() const { return metrics_; }
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }              // any thread
  std::uint64_t stale_ticks() const noexcept { return stale_ticks_.load(std::memory_order_relaxed); }  // any thread

 private:
  enum class Fault : std::uint8_t { none, device, tick };
  void prepareThread();
  void loop();
  void run() noexcept;

  HapticDevice& device_;
  Tick tick_;
  HapticLoopOptions options_;
  LoopMetrics metrics_;
  std::vector<std::string> refusals_;
  std::thread thread_;
  std::atomic<bool> running_{false}, stopping_{false};
  std::atomic<Fault> fault_{Fault::none};
  std::atomic<std::uint64_t> ticks_{0}, stale_ticks_{0};
  bool memory_locked_ = false;
};

}  // namespace filiform
