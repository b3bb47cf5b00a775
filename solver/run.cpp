#include "solver/run.h"

#include "device/device_factory.h"
#include "device/replay.h"
#include "device/simulated_hand.h"
#include "index/cell_graph.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/spsc_ring.h"
#include "solver/force_gate.h"
#include "solver/graph_view.h"
#include "solver/haptic_loop.h"
#include "solver/navigation.h"
#include "solver/parameters.h"
#include "solver/route.h"
#include "solver/tick_clock.h"
#include "solver/tour.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <exception>
#include <iterator>
#include <memory>
#include <ostream>
#include <thread>

namespace filiform {
namespace {

constexpr std::size_t kRowsInFlight = 1 << 14;  // of a real-time run: 16 s at 1 kHz
constexpr std::size_t kLegsAhead = 4;           // of a tour, planned while another is travelled
constexpr double kTourTime_s = 60;
constexpr double kJumpPatience_s = 20;       // beyond the latency, for a jump's tile
constexpr std::uint64_t kDrainEvery = 1024;  // ticks; a recording in virtual time is written between them

// What happened at an exchange, beyond its state: the bits of RunMarks, whose values are the tiles that its tick met
// absent. With them a replay does the same whenever tiles come to it.
constexpr std::uint32_t kTicked = 1, kJumped = 2, kLegDropped = 4, kMoreAbsent = 8, kMeasured = 16;

// A replay is led, and rendered, as the recording was.
std::string ledBy(const RunOptions& options, const ReplayDevice* replay) {
  return replay != nullptr && !replay->device().empty() ? replay->device() : options.device;
}

std::optional<HandParameters> handOf(const std::string& device) {
  if (device != "sim" && device.rfind("sim:", 0) != 0) return std::nullopt;
  return handParameters(device.size() > 4 ? device.substr(4) : "medium");
}

void check(const RunOptions& options) {
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  if (!positive(options.rate_Hz) || options.rate_Hz > 1e6) throw UsageError("the rate must be between 0 and 1e6 Hz");
  if (!positive(options.zoom_um)) throw UsageError("the zoom must be finite and > 0 um");
  if (options.seconds && !positive(*options.seconds)) throw UsageError("the time limit must be finite and > 0 s");
  if (!(options.latency_ms >= 0 && std::isfinite(options.latency_ms)))
    throw UsageError("the latency must be finite and >= 0 ms");
  if (options.realtime && options.latency_ms > 0)
    throw UsageError("a latency belongs to virtual time; in real time the disk has its own: leave one of the two out");
}

// Where the haptic thread's tiles come from: the loader, or a table that holds them all.
class Tiles {
 public:
  Tiles(const TileStore& store, const RunOptions& options, bool replaying) : store_(store) {
    if (replaying && !options.in_memory) {
      most_bytes_ = options.budget_bytes.value_or(UINT64_MAX);
      replayed_.resize(store.tile_count());
      table_ = std::make_unique<TileTable>(store.tile_count());
      if (const TileId pinned = store.long_tile(); pinned != kNoTile) hold(pinned);
      return;
    }
    if (options.in_memory) {
      table_ = std::make_unique<TileTable>(store.tile_count());
      for (TileId id = 0; id < store.tile_count(); ++id) {
        held_.push_back(store.load(id));
        table_->add(*held_.back());
      }
      return;
    }
    ResidencyOptions residency;
    if (options.budget_bytes) residency.budget_bytes = *options.budget_bytes;
    residency.prefetch = options.prefetch;
    residency.io_threads = options.io_threads;
    residency_ = std::make_unique<Residency>(store, residency);
    reader_ = &residency_->addReader("haptic loop");
  }

  const TileTable& table() const { return table_ ? *table_ : reader_->tiles(); }
  Residency* residency() { return residency_.get(); }
  TileReader* reader() { return reader_; }

  // False if they do not fit together. A tile that cannot be read throws what is wrong with it.
  bool loadTogether(std::span<const TileId> tiles) {
    if (!replayed_.empty()) return loadForReplay(tiles);
    if (!residency_) return false;
    if (residency_->loadTogether(tiles)) return true;
    for (const TileId tile : tiles)
      if (residency_->state(tile) == TileState::failed) store_.load(tile);
    return false;
  }

  // Of a replay: these are absent until shown again, as they were when the recording was made.
  void hide(std::span<const std::uint32_t> tiles) {
    if (replayed_.empty()) return;
    hidden_.assign(tiles.begin(), tiles.end());
    for (const TileId tile : hidden_)
      if (tile < store_.tile_count()) table_->retire(tile);
  }
  bool hides(TileId tile) const { return std::find(hidden_.begin(), hidden_.end(), tile) != hidden_.end(); }
  void show() {
    for (const TileId tile : hidden_)
      if (tile < replayed_.size() && replayed_[tile]) table_->add(*replayed_[tile]);
    hidden_.clear();
  }

  void fill(RunSummary& summary) const {
    if (!replayed_.empty()) {
      summary.tiles_read = reads_;
      summary.peak_bytes = peak_bytes_;
      return;
    }
    if (!residency_) {
      summary.peak_bytes = summary.decoded_bytes;
      return;
    }
    const ResidencyCounters counters = residency_->counters();
    summary.streaming = counters;
    summary.tiles_read = counters.reads;
    summary.evictions = counters.evictions;
    summary.peak_bytes = counters.peak_bytes;
    summary.failures = residency_->failures();
  }

 private:
  void hold(TileId tile) {
    if (replayed_[tile]) return;
    replayed_[tile] = store_.load(tile);
    ++reads_;
    bytes_ += store_.entry(tile).decoded_bytes;
    peak_bytes_ = std::max(peak_bytes_, bytes_);
    if (!hides(tile)) table_->add(*replayed_[tile]);
  }
  bool loadForReplay(std::span<const TileId> tiles) {
    std::uint64_t more = 0;
    for (const TileId tile : tiles) more += replayed_[tile] ? 0 : store_.entry(tile).decoded_bytes;
    if (bytes_ + more > most_bytes_) {  // all but what is wanted now: simple, and rare
      for (TileId tile = 0; tile < replayed_.size(); ++tile) {
        if (!replayed_[tile] || tile == store_.long_tile() ||
            std::find(tiles.begin(), tiles.end(), tile) != tiles.end())
          continue;
        table_->retire(tile);
        replayed_[tile].reset();
        bytes_ -= store_.entry(tile).decoded_bytes;
      }
    }
    for (const TileId tile : tiles) hold(tile);
    return true;
  }

  const TileStore& store_;
  std::vector<std::shared_ptr<const Tile>> replayed_;  // by tile; empty unless a recording is replayed
  std::vector<TileId> hidden_;
  std::uint64_t bytes_ = 0, peak_bytes_ = 0, most_bytes_ = UINT64_MAX, reads_ = 0;
  std::vector<std::shared_ptr<const Tile>> held_;
  std::unique_ptr<TileTable> table_;
  std::unique_ptr<Residency> residency_;
  TileReader* reader_ = nullptr;
};

// Closes on every path out: zero force, then closed.
struct OpenDevice {
  explicit OpenDevice(HapticDevice& opened) : device(opened) { device.open(); }
  ~OpenDevice() { device.close(); }
  OpenDevice(const OpenDevice&) = delete;
  OpenDevice& operator=(const OpenDevice&) = delete;
  HapticDevice& device;
};

// A route, and the person who travels it. Made and freed off the haptic path, used on it.
struct Leg {
  Leg(const TileStore& store, const RunOptions& options, Route planned, std::uint64_t number)
      : route(std::move(planned)), home(store.home(store.grid().snap(route.points().front().p_W))) {
    if (home == kNoTile) throw UsageError("the route's first sample lies in no tile: verify the set");
    // Each leg trembles in its own way, the first as a run of one route does.
    person = std::make_unique<SimulatedPerson>(route, options.person, options.seed + number);
    const double device_m = route.length_um() / (options.zoom_um / Workspace::kZoomSpan_m);
    nominal_limit_s = 10 * device_m / options.person.speed_m_s + 20;
  }
  Leg(const Leg&) = delete;
  Leg& operator=(const Leg&) = delete;

  Route route;
  TileId home;  // where it begins
  RouteTracker tracker{route};
  std::unique_ptr<SimulatedPerson> person;
  double nominal_limit_s = 0;
};

// The legs of a run, one after the other: one, or those of a tour.
class Itinerary {
 public:
  Itinerary(const TileStore& store, const RunOptions& options)
      : store_(store), options_(options), tour_seed_(Tour::seedOf(options.route)) {
    if (tour_seed_) tour_ = std::make_unique<Tour>(store, *tour_seed_, options.cell);
  }
  bool isTour() const { return tour_ != nullptr; }

  std::unique_ptr<Leg> next() {
    if (tour_) return std::make_unique<Leg>(store_, options_, tour_->next(), legs_++);
    const std::uint32_t cell = options_.cell ? *options_.cell : defaultCell(store_);
    return std::make_unique<Leg>(store_, options_, planRoute(readCell(store_, cell, false), cell, options_.route), 0);
  }

 private:
  const TileStore& store_;
  const RunOptions& options_;
  std::optional<std::uint64_t> tour_seed_;
  std::unique_ptr<Tour> tour_;
  std::uint64_t legs_ = 0;
};

// Plans legs ahead in a thread of its own, and frees those that were travelled. take() and giveBack() are for the
// haptic thread, the rest for the one that owns this.
class LegPlanner {
 public:
  explicit LegPlanner(Itinerary& itinerary) : itinerary_(itinerary), thread_([this] { plan(); }) {}
  ~LegPlanner() {
    stopping_.store(true, std::memory_order_relaxed);
    thread_.join();
    Leg* leg = nullptr;
    while (planned_.pop(leg)) delete leg;
    while (travelled_.pop(leg)) delete leg;
  }
  LegPlanner(const LegPlanner&) = delete;
  LegPlanner& operator=(const LegPlanner&) = delete;

  Leg* take() noexcept {
    Leg* leg = nullptr;
    planned_.pop(leg);
    return leg;
  }
  // False: keep it, and try again after a tick.
  bool giveBack(Leg* leg) noexcept { return travelled_.push(leg); }

  bool failed() const { return failed_.load(std::memory_order_acquire); }
  void rethrow() const { std::rethrow_exception(error_); }  // Requires failed()

 private:
  void plan() {
    std::unique_ptr<Leg> next;
    try {
      while (!stopping_.load(std::memory_order_relaxed)) {
        Leg* leg = nullptr;
        while (travelled_.pop(leg)) delete leg;
        if (!next) next = itinerary_.next();
        if (planned_.push(next.get()))
          static_cast<void>(next.release());  // the loop has it
        else
          std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    } catch (...) {
      error_ = std::current_exception();
      failed_.store(true, std::memory_order_release);
    }
  }

  Itinerary& itinerary_;
  SpscRing<Leg*> planned_{kLegsAhead}, travelled_{2 * kLegsAhead};
  std::atomic<bool> stopping_{false}, failed_{false};
  std::exception_ptr error_;
  std::thread thread_;
};

class Run {
 public:
  Run(const TileStore& store, const RunOptions& options)
      : store_(store),
        options_(options),
        dt_s_(1.0 / options.rate_Hz),
        itinerary_(store_, options_),
        leg_(itinerary_.next()),
        first_cell_(leg_->route.cell()),
        device_(options.make_device ? options.make_device(options.device, dt_s_)
                                    : makeDevice(options.device, {dt_s_, options.delay_samples})),
        hand_(dynamic_cast<SimulatedHand*>(device_.get())),
        replay_(dynamic_cast<ReplayDevice*>(device_.get())),
        led_by_(ledBy(options, replay_)),
        tiles_(store, options, replaysMarks() && !options.realtime),
        graph_(tiles_.table(), store.leaves(), store.grid()),
        touched_(store.tile_count(), 0) {
    if (!options.record.empty()) {
      RecordingOptions recording;
      recording.writer_thread = options.realtime;
      recording.device = led_by_;
      recording.options = options.record_options;
      recording.marked = true;
      record_ = std::make_unique<Output>(options.record, OutputOptions{.cancel = options.stop});
      auto recorder = std::make_unique<RecordingDevice>(std::move(device_), record_->stream(), recording);
      recorder_ = recorder.get();
      device_ = std::move(recorder);
    }
    summary_.stiffness_N_m =
        options.stiffness_N_m.value_or(!handOf(led_by_)         ? defaultStiffness(device_->capabilities(), dt_s_)
                                       : led_by_ == "sim:loose" ? 50.0
                                                                : 200.0);
    NavigationOptions navigation;
    navigation.force.stiffness_N_m = summary_.stiffness_N_m;
    summary_.passivity = options.passivity.value_or(summary_.stiffness_N_m >= bound_N_m());
    navigation.force.passivity.on = summary_.passivity;
    navigation.force.passivity.delay_samples =
        std::clamp(device_->capabilities().delay_samples, 0, PassivityOptions::kMaxDelay);
    navigation.workspace.lo_D = device_->capabilities().workspace_lo_D;
    navigation.workspace.hi_D = device_->capabilities().workspace_hi_D;
    navigation.workspace.zoom_um = options.zoom_um;
    navigation.rate_control = device_->capabilities().rate_control;
    if (navigation.rate_control && !options.realtime && !replay_)
      throw UsageError("a " + device_->capabilities().name + " moves in real time only: add --realtime");
    navigation.buttons.fill(ButtonAction::none);
    const SolverParameters parameters = options.solver ? *options.solver : automaticParameters(store, first_cell_);
    navigation_ = std::make_unique<Navigation>(graph_, makeProxySolver(options.method, parameters), navigation);
    if (itinerary_.isTour() && !hand_ && !(replaysMarks() && handOf(led_by_)))
      throw UsageError("a tour is planned by the simulated person: it needs a simulated hand, as --device sim:medium");
    if (itinerary_.isTour() && replay_ && options.realtime)
      throw UsageError(
          "a tour is replayed in virtual time, where its jumps can be made when they were: leave "
          "--realtime out");
    if (device_->capabilities().paces_loop && !options.realtime)
      throw UsageError("device " + options.device + " keeps its own time: add --realtime");
    noteStability();
    // A replay ends with its recording.
    const double limit_s = replaysMarks() ? 1e12 : itinerary_.isTour() ? kTourTime_s : leg_->nominal_limit_s;
    most_periods_ = periodsOf(options.seconds.value_or(limit_s));
    jump_patience_periods_ = periodsOf(1e-3 * options.latency_ms + kJumpPatience_s);
  }

  RunSummary operator()(const std::function<void(const TickRow&)>& on_tick) {
    try {
      {
        OpenDevice open(*device_);
        placeAtStart();
        if (options_.realtime)
          runRealTime(on_tick);
        else
          runVirtualTime(on_tick);
      }
      if (recorder_) recorder_->finish();
    } catch (...) {
      keepRecording();
      throw;
    }
    finishSummary();
    if (interrupted_)
      keepRecording();
    else if (record_)
      record_->finish();
    return std::move(summary_);
  }

 private:
  bool toldToStop() const noexcept {
    return options_.stop != nullptr && options_.stop->load(std::memory_order_relaxed);
  }

  // Of a run that did not come to its end: up to there it can be replayed.
  void keepRecording() noexcept {
    if (!recorder_) return;
    try {
      try {
        recorder_->finish();
      } catch (const std::exception&) {
        // What failed before is told; what was written may be whole all the same.
      }
      if (!recorder_->whole()) return;
      const std::string kept = record_->finishAside();
      if (kept != options_.record && options_.recording_kept) options_.recording_kept(kept);
    } catch (const std::exception&) {
      // The first failure is told.
    }
  }

  // The largest stable stiffness (N/m): with the hand's damping where that is known, else with the device's alone.
  double bound_N_m() const {
    double damping_Ns_m = device_->capabilities().damping_Ns_m;
    if (const auto hand = handOf(led_by_)) damping_Ns_m += hand->damping_Ns_m;
    return stiffnessBound(damping_Ns_m, dt_s_, device_->capabilities().delay_samples);
  }

  void noteStability() {
    if (!handOf(led_by_) || summary_.stiffness_N_m < bound_N_m()) return;
    summary_.notes.push_back(
        "stiffness " + std::to_string(std::lround(summary_.stiffness_N_m)) + " N/m is outside the stability bound of " +
        std::to_string(std::lround(bound_N_m())) + " N/m for this hand, rate and delay: " +
        (summary_.passivity ? "the passivity controller weakens the force instead" : "the proxy may vibrate"));
  }

  // Whole periods; 0 for a time that is not a number.
  double periodsOf(double time_s) const {
    const double periods = std::ceil(time_s * options_.rate_Hz);
    return periods >= 0 ? std::min(1e15, periods) : 0.0;
  }

  void placeAtStart() {
    if (!tiles_.table().find(leg_->home)) tiles_.loadTogether({&leg_->home, 1});
    if (!enter(*leg_, navigation_->workspace().centre_D()))
      throw UsageError("the route's first segment is not in its tile: verify the set");
    if (TileReader* reader = tiles_.reader()) reader->publishFocus(focus());
  }

  // Puts the leg's first point under the hand. Requires its tile. Haptic-safe.
  bool enter(const Leg& leg, const Vector3d& h_D) noexcept {
    NavigationCommand command;
    command.kind = NavigationCommand::Kind::jump;
    command.place = graph_.placeAt(leg.home, leg.route.first_segment(), leg.route.first_t());
    if (!navigation_->apply(command, h_D)) return false;
    ++summary_.legs;
    leg_end_periods_ = periods_ + periodsOf(leg.nominal_limit_s);
    arrived_ = leg_over_ = false;
    return true;
  }

  static NodeId firstNode(const Leg& leg) noexcept { return {leg.route.cell(), leg.route.points().front().rank}; }

  // With the jump that waits for its tiles, if there is one. Haptic-safe.
  ReaderFocus focus() const noexcept {
    ReaderFocus focus = navigation_->focus();
    if (leg_over_ && next_) {
      focus.target_tile = next_->home;
      focus.target_node = firstNode(*next_);
      focus.target_W = next_->route.points().front().p_W;
    }
    return focus;
  }

  // Before a tick of a tour whose leg is over: jumps to the next as soon as it is planned and its tile is there. `take`
  // answers the next leg, or nullptr; the one that was travelled is left in past_. Haptic-safe as far as `take` is.
  template <class Take>
  void moveOn(const DeviceState& state, Take&& take) {
    if (!leg_over_ || past_) return;
    TileReader* reader = tiles_.reader();
    // Without latency the tiles of each tick are loaded with it.
    const bool comes_at_once = reader == nullptr || (!options_.realtime && options_.latency_ms == 0);
    if (!next_) next_.reset(take());
    if (next_) {
      if (tiles_.table().find(next_->home) && (comes_at_once || reader->isTargetReady(firstNode(*next_)))) {
        past_.swap(leg_);
        leg_.swap(next_);
        jump_waited_periods_ = 0;
        leavePast(state);
        return;
      }
      if (reader != nullptr && !tiles_.table().find(next_->home)) reader->request(next_->home);
      jump_waited_periods_ += step_periods_;
      if (jump_waited_periods_ > jump_patience_periods_) {
        past_.swap(next_);
        jump_waited_periods_ = 0;
        ++legs_dropped_;
        marks_.bits |= kLegDropped;
      }
    }
    ++summary_.jump_wait_ticks;
  }

  // The leg that was travelled is past_, the next one leg_: jumps to where that begins. Haptic-safe.
  void leavePast(const DeviceState& state) noexcept {
    marks_.bits |= kJumped;
    summary_.back_offs += past_->person->back_offs();
    summary_.route_um += past_->route.length_um();
    summary_.reached_um += past_->tracker.reached_um();
    if (enter(*leg_, state.p_D))
      ++summary_.jumps;
    else
      ++legs_dropped_;  // leg_over_ still holds: the next tick moves on
  }

  // The same, of a replay: when the recording did.
  void moveOnAsRecorded(const DeviceState& state) {
    const std::uint32_t bits = replay_->marks().bits;
    if ((bits & (kJumped | kLegDropped)) != 0 && !next_) next_ = itinerary_.next();
    if (bits & kLegDropped) {
      next_.reset();
      ++legs_dropped_;
    }
    if (bits & kJumped) {
      tiles_.loadTogether({&next_->home, 1});
      past_ = std::move(leg_);
      leg_ = std::move(next_);
      leavePast(state);
      past_.reset();
    } else if (leg_over_) {
      ++summary_.jump_wait_ticks;
    }
  }

  void setStep(double step_s) noexcept {
    step_s_ = step_s;
    step_periods_ = step_s == dt_s_ ? 1.0 : step_s / dt_s_;
  }

  bool replaysMarks() const { return replay_ && replay_->marked(); }

  // What the recording of this tick needs beyond its state. Haptic-safe.
  void mark(const NavigationTick& tick) noexcept {
    if (!recorder_) return;
    marks_.bits |= kTicked | (options_.realtime ? kMeasured : 0u);
    if (tick.frontier) {
      const TileList& absent = tick.step.absent;
      marks_.count = static_cast<std::uint32_t>(std::min<std::size_t>(absent.count, marks_.values.size()));
      std::copy_n(absent.ids.begin(), marks_.count, marks_.values.begin());
      if (absent.overflow || absent.count > marks_.count) marks_.bits |= kMoreAbsent;
    }
    recorder_->mark(marks_);
    marks_ = {};
  }

  // After a tick that stands: what it counts, and where the hand goes next. Haptic-safe. True when the run is over.
  bool account(const NavigationTick& tick, TickRow& row) noexcept {
    row.tick = summary_.ticks;
    row.time_s = periods_ * dt_s_;
    row.h_W = tick.h_W;
    row.p_W = tick.p_W;
    row.segment = navigation_->place().segment;
    row.force_N = tick.wrench.force_N;
    row.visited = tick.step.visited;
    row.frontier = tick.frontier;

    const double force_N = row.force_N.norm();
    force_sum_N_ += force_N;
    force_periods_N_ += force_N * step_periods_;
    summary_.max_force_N = std::max(summary_.max_force_N, force_N);
    summary_.max_force_step_N = std::max(summary_.max_force_step_N, (row.force_N - last_force_N_).norm());
    last_force_N_ = row.force_N;
    summary_.visited += tick.step.visited;
    summary_.capped_ticks += tick.step.capped;
    summary_.frontiers += tick.frontier;
    for (std::uint32_t i = 0; i < tick.step.touched.count; ++i) touched_[tick.step.touched.ids[i]] = 1;
    ++summary_.ticks;
    periods_ += step_periods_;
    const bool time_over = periods_ >= most_periods_;
    if (leg_over_) return time_over;  // the hand stays where it is until the jump

    const Route::Progress progress = leg_->tracker.update(navigation_->place());
    const double tolerance_um = options_.person.arrive_m * navigation_->workspace().scale_um_m();
    arrived_ = progress.on_route && progress.arc_um >= leg_->route.length_um() - tolerance_um;
    leg_over_ = arrived_;
    if (hand_ || (itinerary_.isTour() && replay_)) {  // a replayed tour: the person gives up when it did
      SimulatedPerson& person = *leg_->person;
      const Vector3d target_D = person.target_D(navigation_->place(), navigation_->workspace(), step_s_);
      if (hand_) hand_->setTarget(target_D);
      leg_over_ = leg_over_ || person.status() == PersonStatus::gave_up;
    }
    summary_.legs_completed += arrived_;
    if (!itinerary_.isTour()) return leg_over_ || time_over;
    leg_over_ = leg_over_ || periods_ >= leg_end_periods_;
    return time_over;
  }

  bool recordingEnded(const DeviceState& state) const { return replay_ && state.status == DeviceStatus::closed; }

  void runVirtualTime(const std::function<void(const TickRow&)>& on_tick) {
    const auto latency_ticks =
        static_cast<std::uint64_t>(std::min(1e15, std::ceil(options_.latency_ms * 1e-3 / dt_s_)));
    Wrench wrench;
    TickRow row;
    NavigationSnapshot snapshot;
    TickClock clock(dt_s_);
    for (bool over = false; !over;) {
      if ((interrupted_ = toldToStop())) break;
      const DeviceState state = device_->exchange(wrench);
      if (recordingEnded(state)) break;
      const double measured_s = clock.step_s(state.time_s);
      if (replaysMarks()) {
        setStep((replay_->marks().bits & kMeasured) != 0 ? measured_s : dt_s_);
        if ((replay_->marks().bits & kTicked) == 0) {  // nobody computed with it
          wrench = {};
          continue;
        }
        moveOnAsRecorded(state);
      } else if (leg_over_) {
        past_.reset();
        // Without latency a tile is there when it is asked for, unless it cannot be.
        moveOn(state, [&] {
          std::unique_ptr<Leg> next = itinerary_.next();
          if (latency_ticks == 0 && !tiles_.table().find(next->home)) tiles_.loadTogether({&next->home, 1});
          return next.release();
        });
      }
      if (latency_ticks > 0 && tiles_.residency()) tiles_.residency()->advance(summary_.ticks, latency_ticks);
      const NavigationTick& tick = replaysMarks()      ? tickAsRecorded(state)
                                   : latency_ticks > 0 ? navigation_->tick(state, step_s_)
                                                       : tickWithItsTiles(state);
      wrench = tick.wrench;
      mark(tick);
      if (TileReader* reader = tiles_.reader()) {
        for (std::uint32_t i = 0; i < tick.step.absent.count; ++i) reader->request(tick.step.absent.ids[i]);
        reader->publishFocus(focus());
      }
      over = account(tick, row);
      if (on_tick) on_tick(row);
      if (options_.on_snapshot) {
        navigation_->fill(snapshot);
        options_.on_snapshot(snapshot);
      }
      if (recorder_ && summary_.ticks % kDrainEvery == 0) recorder_->drain();
    }
  }

  // With the tiles absent that were, and all others there.
  const NavigationTick& tickAsRecorded(const DeviceState& state) {
    const RunMarks& marks = replay_->marks();
    uncertain_ticks_ += (marks.bits & kMoreAbsent) != 0;
    tiles_.hide({marks.values.data(), marks.count});
    const NavigationTick& tick = tickWithItsTiles(state);
    tiles_.show();
    return tick;
  }

  // Latency 0. Each repetition has the tiles of the one before and some more, so that it cannot go on for long.
  const NavigationTick& tickWithItsTiles(const DeviceState& state) {
    const NavigationTick* tick = &navigation_->tick(state, step_s_);
    bool stalled = false;
    while (tick->frontier) {
      wanted_.assign(tick->step.touched.ids.begin(), tick->step.touched.ids.begin() + tick->step.touched.count);
      const std::size_t before = wanted_.size();
      std::copy_if(tick->step.absent.ids.begin(), tick->step.absent.ids.begin() + tick->step.absent.count,
                   std::back_inserter(wanted_), [this](TileId tile) { return !tiles_.hides(tile); });
      // A list that ran over cannot be loaded whole: what is missing could push out what is there, for ever.
      if (before == wanted_.size() || tick->step.touched.overflow || !tiles_.loadTogether(wanted_)) break;
      navigation_->undoSolve();
      stalled = true;
      tick = &navigation_->tick(state, step_s_);
    }
    summary_.stalls += stalled;
    return *tick;
  }

  // The first leg begins as a jump does: with what the hand can reach at once, or after as long as a jump waits.
  void awaitStart(TileReader& reader) const {
    ReaderFocus start = navigation_->focus();
    start.target_tile = leg_->home;
    start.target_node = firstNode(*leg_);
    start.target_W = leg_->route.points().front().p_W;
    reader.publishFocus(start);
    for (double waited = 0; waited < jump_patience_periods_; ++waited) {
      reader.apply();
      if (reader.isTargetReady(start.target_node)) break;
      std::this_thread::sleep_for(std::chrono::duration<double>(dt_s_));
    }
    reader.publishFocus(focus());
  }

  void runRealTime(const std::function<void(const TickRow&)>& on_tick) {
    SpscRing<TickRow> rows(kRowsInFlight);
    std::atomic<bool> over{false};
    std::atomic<TileId> waited_for{kNoTile};  // by the proxy, which rests at it
    std::uint64_t rows_lost = 0;
    struct IoThread {
      Residency* residency;
      ~IoThread() {
        if (residency) residency->stop();
      }
    } io{tiles_.residency()};  // outlives the loop
    TileReader* reader = tiles_.reader();
    std::optional<LegPlanner> planner;  // outlives the loop too
    if (itinerary_.isTour()) planner.emplace(itinerary_);
    struct Ending {
      const std::function<void()>& tell;
      ~Ending() {
        if (tell) tell();
      }
    } ending{options_.ending};
    HapticLoopOptions loop_options;
    loop_options.rate_Hz = options_.rate_Hz;
    loop_options.ramp_at_start = false;         // the force law's
    ForceGate last_force({.ramp_s = 0}, true);  // fades when the run is over
    HapticLoop loop(
        *device_,
        [&](const DeviceState& state, double dt_s) -> Wrench {
          setStep(dt_s);
          if (over.load(std::memory_order_relaxed)) {
            ForceGate::Input rest;
            rest.wanted = last_force.sent();
            rest.dt_s = dt_s;
            return last_force.fading() ? last_force.pass(rest) : Wrench{};
          }
          if (recordingEnded(state)) {
            over.store(true, std::memory_order_release);
            return {};
          }
          if (replaysMarks() && (replay_->marks().bits & kTicked) == 0) return {};
          if (reader) reader->apply();
          if (planner) {
            if (past_ && planner->giveBack(past_.get())) static_cast<void>(past_.release());
            moveOn(state, [&]() noexcept { return planner->take(); });
          }
          const NavigationTick& tick = navigation_->tick(state, step_s_);
          if (reader) {
            for (std::uint32_t i = 0; i < tick.step.absent.count; ++i) reader->request(tick.step.absent.ids[i]);
            reader->publishFocus(focus());
            waited_for.store(tick.frontier && tick.step.absent.count > 0 ? tick.step.absent.ids[0] : kNoTile,
                             std::memory_order_relaxed);
          }
          TickRow row;
          mark(tick);
          const bool last = account(tick, row);
          rows_lost += !rows.push(row);
          if (last) {
            ForceGate::Input whole;
            whole.wanted = tick.wrench;
            last_force.pass(whole);
            last_force.restart();
            over.store(true, std::memory_order_release);
          }
          return tick.wrench;
        },
        loop_options);

    if (io.residency) {
      io.residency->start();
      awaitStart(*reader);
    }
    loop.start();
    TickRow row;
    const auto drain = [&] {
      while (rows.pop(row))
        if (on_tick) on_tick(row);
    };
    while (loop.running() && !over.load(std::memory_order_acquire)) {
      drain();
      if ((interrupted_ = toldToStop()) || (planner && planner->failed())) break;
      // A proxy that rests because the source fails is no place for the hand to be held at.
      const TileId tile = waited_for.load(std::memory_order_relaxed);
      loop.withhold(tile != kNoTile && io.residency->state(tile) == TileState::failed);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    loop.stop();
    drain();
    if (!loop.fault().empty()) throw DeviceError(loop.fault() + lastTicksOf(loop));
    if (planner && planner->failed()) planner->rethrow();
    summary_.missed_deadlines = loop.metrics().missed_deadlines();
    summary_.loop = {loop.metrics(), loop.stale_ticks(), loop.interruptions(), loop.guard_exchanges()};
    if (loop.interruptions() > 0)
      summary_.notes.push_back("the haptic loop was interrupted " + std::to_string(loop.interruptions()) +
                               " times: the force was zero, and grew again");
    summary_.notes.insert(summary_.notes.end(), loop.refusals().begin(), loop.refusals().end());
    if (rows_lost > 0)
      summary_.notes.push_back(std::to_string(rows_lost) +
                               " rows were lost: they could not be written as fast as the loop ran");
  }

  // Writes them down, and says where.
  std::string lastTicksOf(const HapticLoop& loop) const {
    if (options_.fault_csv.empty()) return {};
    try {
      Output out(options_.fault_csv, {.cancel = options_.stop});
      loop.metrics().writeCsv(out.stream());
      out.finish();
    } catch (const Error& error) {
      return std::string("; its last ticks could not be written: ") + error.what();
    }
    return "; its last ticks are in " + options_.fault_csv;
  }

  void finishSummary() {
    RunSummary& s = summary_;
    const bool time_over = periods_ >= most_periods_;
    s.outcome = interrupted_                      ? RunOutcome::interrupted
                : arrived_ || itinerary_.isTour() ? RunOutcome::completed
                : time_over                       ? RunOutcome::time_over
                                                  : RunOutcome::stuck;
    s.route_um += leg_->route.length_um();
    s.reached_um += leg_->tracker.reached_um();
    s.back_offs += leg_->person->back_offs();
    s.sim_s = periods_ * dt_s_;
    for (std::uint32_t id = 0; id < store_.cell_count(); ++id) s.segments += store_.cell(id).segments;
    for (TileId tile = 0; tile < store_.tile_count(); ++tile) s.decoded_bytes += store_.entry(tile).decoded_bytes;
    s.tiles = static_cast<std::uint64_t>(std::count(touched_.begin(), touched_.end(), 1));
    s.budget_bytes = options_.budget_bytes;
    s.force_integral_Ns = force_periods_N_ * dt_s_;
    s.mean_force_N = s.ticks ? force_sum_N_ / static_cast<double>(s.ticks) : 0.0;
    s.cell = store_.cell(first_cell_).name;
    s.energy = navigation_->force_law().energy();
    if (legs_dropped_ > 0)
      s.notes.push_back(std::to_string(legs_dropped_) +
                        " legs of the tour were dropped: their first tile did not come");
    if (replay_ && replay_->differingWrenches() > 0)
      s.notes.push_back(
          std::to_string(replay_->differingWrenches()) +
          " forces differ from those of the recording: the set, an option or the program is not the same, or the "
          "recorded loop was interrupted");
    if (uncertain_ticks_ > 0)
      s.notes.push_back(std::to_string(uncertain_ticks_) +
                        " ticks of the recording met more absent tiles than it could hold: from the first of them on "
                        "the replay may differ");
    tiles_.fill(s);
  }

  const TileStore& store_;
  RunOptions options_;
  double dt_s_;
  Itinerary itinerary_;
  std::unique_ptr<Leg> leg_;          // being travelled
  std::unique_ptr<Leg> next_, past_;  // of a tour: to jump to, and to be freed
  std::uint32_t first_cell_;
  std::unique_ptr<Output> record_;  // outlives the device, which writes to it
  std::unique_ptr<HapticDevice> device_;
  SimulatedHand* hand_;  // the device, if it is one of these
  ReplayDevice* replay_;
  RecordingDevice* recorder_ = nullptr;
  std::string led_by_;  // what made the device, of a replay the recorded one
  Tiles tiles_;
  GraphView graph_;
  RunMarks marks_;  // of the tick under way
  std::unique_ptr<Navigation> navigation_;
  std::vector<std::uint8_t> touched_;  // by tile
  std::vector<TileId> wanted_;
  // Time is counted in periods of the rate that was asked for: exact where every tick takes one, as in virtual time.
  double step_s_ = dt_s_, step_periods_ = 1;  // of the tick under way
  double periods_ = 0, most_periods_ = 0, leg_end_periods_ = 0;
  double jump_patience_periods_ = 0, jump_waited_periods_ = 0;
  std::uint64_t legs_dropped_ = 0, uncertain_ticks_ = 0;
  double force_sum_N_ = 0, force_periods_N_ = 0;
  Vector3d last_force_N_ = Vector3d::Zero();
  bool arrived_ = false, leg_over_ = false, interrupted_ = false;
  RunSummary summary_;
};

}  // namespace

const char* toString(RunOutcome outcome) {
  switch (outcome) {
    case RunOutcome::completed:
      return "completed";
    case RunOutcome::stuck:
      return "stuck";
    case RunOutcome::time_over:
      return "time_over";
    case RunOutcome::interrupted:
      return "interrupted";
  }
  return "";
}

RunSummary run(const TileStore& store, const RunOptions& options, const std::function<void(const TickRow&)>& on_tick) {
  check(options);
  if (options.cell && *options.cell >= store.cell_count())
    throw UsageError("the set has no cell number " + std::to_string(*options.cell));
  return Run(store, options)(on_tick);
}

std::uint32_t defaultCell(const TileStore& store) {
  if (store.cell_count() == 0) throw UsageError("the set holds no cell: there is nothing to navigate");
  std::uint32_t best = 0;
  for (std::uint32_t id = 1; id < store.cell_count(); ++id) {
    const CellRecord &cell = store.cell(id), &other = store.cell(best);
    if (cell.segments > other.segments || (cell.segments == other.segments && cell.name < other.name)) best = id;
  }
  return best;
}

void writeCsvHeader(std::ostream& out) {
  out << "tick,time_s,hx_um,hy_um,hz_um,px_um,py_um,pz_um,cell,segment,fx_N,fy_N,fz_N,visited,frontier,cell_name\n";
}

void writeCsvRow(std::ostream& out, const TickRow& row, std::string_view cell_name) {
  char line[512];
  char* at = line;
  char* const end = line + sizeof line;
  const auto put = [&](auto value) {
    at = std::to_chars(at, end - 1, value).ptr;
    *at++ = ',';
  };
  put(row.tick);
  put(row.time_s);
  for (int axis = 0; axis < 3; ++axis) put(row.h_W[axis]);
  for (int axis = 0; axis < 3; ++axis) put(row.p_W[axis]);
  put(row.segment.cell);
  put(row.segment.segment);
  for (int axis = 0; axis < 3; ++axis) put(row.force_N[axis]);
  put(row.visited);
  put(row.frontier ? 1 : 0);
  out.write(line, at - line);
  if (!cell_name.empty()) {
    out << '"';
    for (const char c : cell_name) {
      if (c == '"') out << '"';
      out << c;
    }
    out << '"';
  }
  out << '\n';
}

}  // namespace filiform
