// The thread that never waits for anything but the clock or the device: exchange, tick, exchange, tick.
//
//   HapticLoop loop(device, [&](const DeviceState& state, double dt_s) {
//     return navigation.tick(state, dt_s).wrench;
//   });
//   loop.start();
//   std::this_thread::sleep_for(std::chrono::seconds(10));
//   loop.stop();
//   loop.metrics().writeCsv(out);
//
// Whatever ends the loop (stop(), a fault of the device, an exception in the tick, destruction), the last thing that
// the device is sent is zero force. While it runs, a force is never older than stall_s: a second thread, the guard,
// watches. If the haptic thread has not come back to the device for that long (a tick that blocks, a thread that is not
// scheduled), the guard exchanges in its place, zero force each time, until it comes back; what the late tick computed
// is not sent, and force grows from zero again over ramp_s. The same follows where the whole process had been stopped,
// and force_hold.h lets signal handlers ask for it.
//
// The device changes hands through one atomic word: the haptic thread takes it for an exchange and lays it back, the
// guard takes it only from where it lies. So the haptic thread never waits, except when it comes back late and meets
// the guard in the middle of an exchange. Within exchange() the device's own limits hold (haptic_device.h).
//
// Thread rule: start, stop and the destructor belong to one thread; running() and fault() to any; metrics() and
// refusals() may be read while the loop does not run, refusals() as soon as start() has returned. The device is
// exchanged with by two threads, never at once and each after the other in the sense of the memory model.
#pragma once

#include "device/haptic_device.h"
#include "solver/loop_gate.h"
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
  double watchdog_s = 0.015;
  // How old (s) a force may get before the guard takes the device; a period is added where the clock paces the loop,
  // and it is 2 periods at least. 0: no guard.
  double stall_s = 0.010;
  // After an interruption (stall, still clock, stopped process) force grows from zero over this time (s).
  double ramp_s = 0.5;
  double fade_s = 0.05;           // stop() lets the force fall to zero over this time (s), a force above 5 N at 100 N/s
  bool ramp_at_start = true;      // at the first ready state too; not where the tick does that itself
  std::size_t ring_ticks = 4096;  // kept whole by the metrics
  // Called on the haptic thread once a period, after its tick, with the time (s) until the next exchange: work that
  // must delay no force. 0 where the device paces the loop, because the force then goes out right after. The same
  // rules as for Tick. None: nothing is called.
  std::function<void(double free_s)> idle{};
};

class HapticLoop {
 public:
  // Called once a period with the newest state, whose sent_N is the force that was really sent, and the time since the
  // state before (s), as TickClock measures it. Must not allocate, lock or wait. What it returns goes out with the next
  // exchange as LoopGate lets it. An exception ends the loop.
  using Tick = std::function<Wrench(const DeviceState&, double dt_s)>;

  // The device must be open, and outlive the loop; nobody else may exchange with it while the loop runs. Throws
  // UsageError for a rate that is not > 0 and finite, and for a time that is negative or not finite.
  HapticLoop(HapticDevice& device, Tick tick, const HapticLoopOptions& options = {});
  ~HapticLoop();
  HapticLoop(const HapticLoop&) = delete;
  HapticLoop& operator=(const HapticLoop&) = delete;

  // Returns when the thread has its priority. Starting a loop that runs does nothing; metrics go on counting. Throws
  // std::system_error if a thread cannot be made; the loop then does not run.
  void start();
  // The force fades over fade_s, the tick being called meanwhile; then zero force, and the thread ends. Idempotent.
  void stop() noexcept;

  // While withheld the force is zero, whatever is computed; afterwards it grows from zero over ramp_s. Any thread.
  void withhold(bool withheld) noexcept { withheld_.store(withheld, std::memory_order_relaxed); }

  bool running() const noexcept { return running_.load(std::memory_order_acquire); }
  // Why the loop ended by itself; empty if it did not.
  std::string fault() const;
  // What the system refused, and what that means for the person: one line each.
  const std::vector<std::string>& refusals() const { return refusals_; }
  const LoopMetrics& metrics() const { return metrics_; }
  std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }              // any thread
  std::uint64_t stale_ticks() const noexcept { return stale_ticks_.load(std::memory_order_relaxed); }  // any thread
  // How often what had been computed was too old to be sent, and the exchanges of the guard. Any thread.
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
  void layDeviceBack() noexcept;

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
  std::atomic<std::int64_t> laid_back_ns_{0};  // when the haptic thread last did
  std::atomic<Fault> fault_{Fault::none};
  std::atomic<std::uint64_t> ticks_{0}, stale_ticks_{0}, interruptions_{0}, guard_exchanges_{0};
  bool memory_locked_ = false;
};

}  // namespace filiform
