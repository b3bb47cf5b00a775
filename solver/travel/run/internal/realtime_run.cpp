#include "solver/travel/run/internal/realtime_run.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/spsc_ring.h"
#include "solver/force/force_gate.h"
#include "solver/loop/haptic_loop.h"
#include "solver/travel/run/internal/leg_planner.h"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <exception>
#include <thread>

namespace filiform::internal {

namespace {

constexpr std::size_t kRowsInFlight = 1 << 14;  // 16 s at 1 kHz

struct IoThreads {
  Residency* residency;  // nullptr: none
  ~IoThreads() {
    if (residency != nullptr) residency->stop();
  }
};

class RealTimeRun {
 public:
  explicit RealTimeRun(RunParts& run)
      : run_(run),
        io_{run.tiles.residency()},
        loop_(
            *run.device, [this](const DeviceState& state, double dt_s) { return tick(state, dt_s); }, loopOptions()) {
    if (run.itinerary.isTour()) planner_.emplace(run.itinerary);
  }

  void operator()(const OnTick& on_tick) {
    try {
      travel(on_tick);
      run_.end();
    } catch (...) {
      loop_.stop();
      run_.fail(std::current_exception());
      throw;
    }
  }

 private:
  void travel(const OnTick& on_tick) {
    if (io_.residency != nullptr) {
      io_.residency->start();
      double left = run_.legs->longestJumpWaitPeriods(run_.time);
      run_.legs->awaitFirst([&] {
        std::this_thread::sleep_for(std::chrono::duration<double>(run_.time.period_s()));
        run_.tiles.reader()->apply();
        return --left > 0 && !run_.isToldToStop();
      });
    }
    loop_.start();
    while (loop_.running() && !over_.load(std::memory_order_acquire)) {
      drain(on_tick);
      if ((run_.was_interrupted = run_.isToldToStop()) || (planner_ && planner_->failed())) break;
      loop_.withhold(run_.hand->waitsForFailedTile());
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    loop_.stop();
    drain(on_tick);
    if (!loop_.fault().empty()) throw DeviceError(loop_.fault() + writeLastTicks());
    if (planner_ && planner_->failed() && !run_.was_interrupted) planner_->rethrow();
    report();
  }

  HapticLoopOptions loopOptions() {
    HapticLoopOptions options;
    options.rate_Hz = run_.options.rate_Hz;
    options.ramp_at_start = false;  // the force law has its own ramp
    options.idle = [this](double free_s) { run_.hand->prepare(free_s); };
    return options;
  }

  // Haptic-safe.
  Wrench tick(const DeviceState& state, double dt_s) noexcept {
    run_.time.setStep(dt_s);
    if (over_.load(std::memory_order_relaxed)) return fade(dt_s);
    if (run_.device.replayEnded(state)) {
      over_.store(true, std::memory_order_release);
      return {};
    }
    if (!run_.device.wasTicked()) return {};
    if (TileReader* const reader = run_.tiles.reader()) reader->apply();
    moveOn(state);
    const NavigationTick& tick = run_.hand->tick(state, dt_s);
    run_.hand->publish(run_.legs->focus());
    TickRow row;
    const bool is_last = run_.account(tick, row);
    rows_lost_ += !rows_.push(row);
    if (is_last) beginFade(tick.wrench);
    return tick.wrench;
  }

  void moveOn(const DeviceState& state) noexcept {
    if (!planner_) return;
    LegTravel& legs = *run_.legs;
    if (legs.past() && planner_->giveBack(legs.past().get())) static_cast<void>(legs.past().release());
    if (legs.wantsNext()) legs.setNext(planner_->take());
    legs.moveOn(state, run_.time);
  }

  // After the last tick the force fades to zero while the loop continues.
  void beginFade(const Wrench& last) noexcept {
    ForceGate::Input whole;
    whole.wanted = last;
    last_force_.pass(whole);
    last_force_.restart();
    over_.store(true, std::memory_order_release);
  }

  Wrench fade(double dt_s) noexcept {
    ForceGate::Input rest;
    rest.wanted = last_force_.sent();
    rest.dt_s = dt_s;
    return last_force_.fading() ? last_force_.pass(rest) : Wrench{};
  }

  void drain(const OnTick& on_tick) {
    TickRow row;
    while (rows_.pop(row))
      if (on_tick) on_tick(row);
  }

  void report() {
    run_.missed_deadlines = loop_.metrics().missed_deadlines();
    run_.loop = {loop_.metrics(), loop_.stale_ticks(), loop_.interruptions(), loop_.guard_exchanges()};
    if (loop_.interruptions() > 0)
      run_.notes.push_back("the haptic loop was interrupted " + counted(loop_.interruptions(), "time") +
                           "; each time the force fell to zero and grew again");
    run_.notes.insert(run_.notes.end(), loop_.refusals().begin(), loop_.refusals().end());
    if (rows_lost_ > 0)
      run_.notes.push_back(counted(rows_lost_, "row was", "rows were") +
                           " lost, because they could not be written as fast as the loop ran");
  }

  // Writes the last ticks to fault_csv. Returns a clause for the error message.
  std::string writeLastTicks() const {
    const std::string& file = run_.options.fault_csv;
    if (file.empty()) return {};
    try {
      Output out(file, {.cancel = run_.options.stop});
      loop_.metrics().writeCsv(out.stream());
      out.finish();
    } catch (const Error& error) {
      return std::string("; its last ticks could not be written: ") + error.what();
    }
    return "; its last ticks are in " + file;
  }

  RunParts& run_;
  SpscRing<TickRow> rows_{kRowsInFlight};
  std::atomic<bool> over_{false};
  std::uint64_t rows_lost_ = 0;
  ForceGate last_force_{{.ramp_s = 0}, true};
  // Members are destroyed from the last to the first: the loop has ended, then the other threads end.
  IoThreads io_;
  std::optional<LegPlanner> planner_;
  HapticLoop loop_;
};

}  // namespace

void runInRealTime(RunParts& run, const OnTick& on_tick) { RealTimeRun{run}(on_tick); }

}  // namespace filiform::internal
