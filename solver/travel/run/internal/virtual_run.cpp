#include "solver/travel/run/internal/virtual_run.h"

#include "solver/workspace/navigation_link.h"

#include <algorithm>
#include <cmath>

namespace filiform::internal {

namespace {

constexpr std::uint64_t kDrainEvery = 1024;  // number of ticks between two writes of the recording

class VirtualRun {
 public:
  explicit VirtualRun(RunParts& run)
      : run_(run),
        is_replay_(run.device.replaysMarks()),
        latency_ticks_(static_cast<std::uint64_t>(
            std::min(1e15, std::ceil(run.options.latency_ms * 1e-3 / run.time.period_s())))) {}

  void operator()(const OnTick& on_tick) {
    if (latency_ticks_ > 0 && !is_replay_ && run_.tiles.residency() != nullptr) awaitFirst();
    Wrench wrench;
    TickRow row;
    for (bool over = false; !over;) {
      if ((run_.was_interrupted = run_.isToldToStop())) return;
      const DeviceState state = run_.device->exchange(wrench);
      if (run_.device.replayEnded(state)) return;
      run_.time.setStep(run_.device.virtualStep_s(state, run_.time.period_s()));
      if (!run_.device.wasTicked()) {
        wrench = {};
        continue;
      }
      moveOn(state);
      const NavigationTick& tick = tickWith(state);
      run_.hand->publish(run_.legs->focus());
      wrench = tick.wrench;
      over = run_.account(tick, row);
      run_.hand->prepare(run_.time.period_s());
      tell(on_tick, row);
    }
  }

 private:
  void moveOn(const DeviceState& state) {
    LegTravel& legs = *run_.legs;
    if (is_replay_) return legs.moveOnAsRecorded(state, run_.time);
    if (!legs.isOver()) return;
    legs.past().reset();
    if (legs.wantsNext()) {
      std::unique_ptr<Leg> next = run_.itinerary.next();
      // Without latency, a requested tile is present at once, if it can be loaded.
      if (latency_ticks_ == 0 && run_.tiles.table().find(next->home) == nullptr)
        run_.tiles.loadTogether({&next->home, 1});
      legs.setNext(next.release());
    }
    legs.moveOn(state, run_.time);
  }

  // The time between two rounds of reads is skipped, because a latency may last for ever. At most four rounds more than
  // the run lasts.
  void awaitFirst() {
    const double most = run_.most_periods + 4 * static_cast<double>(latency_ticks_);
    bool plans = true;
    run_.legs->awaitFirst([&] {
      advance(ticks_before_);
      plans = !plans;
      ticks_before_ += plans ? latency_ticks_ : 1;  // the tick after a round of reads plans the next one
      return static_cast<double>(ticks_before_) < most && !run_.isToldToStop();
    });
  }

  void advance(std::uint64_t tick) { run_.tiles.residency()->advance(tick, latency_ticks_); }

  const NavigationTick& tickWith(const DeviceState& state) {
    const double step_s = run_.time.step_s();
    if (latency_ticks_ > 0 && run_.tiles.residency() != nullptr) advance(ticks_before_ + run_.statistics.ticks());
    if (is_replay_) return run_.hand->tickAsRecorded(state, step_s);
    return latency_ticks_ > 0 ? run_.hand->tick(state, step_s) : run_.hand->tickWithItsTiles(state, step_s);
  }

  void tell(const OnTick& on_tick, const TickRow& row) {
    if (on_tick) on_tick(row);
    if (run_.options.on_snapshot) {
      run_.hand->navigation().fill(snapshot_);
      run_.options.on_snapshot(snapshot_);
    }
    RecordingDevice* const recorder = run_.device.recorder();
    if (recorder != nullptr && run_.statistics.ticks() % kDrainEvery == 0) recorder->drain();
  }

  RunParts& run_;
  const bool is_replay_;
  const std::uint64_t latency_ticks_;
  std::uint64_t ticks_before_ = 0;  // that passed for the loader before the first tick
  NavigationSnapshot snapshot_;
};

}  // namespace

void runInVirtualTime(RunParts& run, const OnTick& on_tick) { VirtualRun{run}(on_tick); }

}  // namespace filiform::internal
