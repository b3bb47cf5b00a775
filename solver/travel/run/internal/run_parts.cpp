#include "solver/travel/run/internal/run_parts.h"

#include "device/factory/device_factory.h"
#include "index/count_text.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "solver/travel/run/recorded_options.h"

#include <cmath>
#include <exception>
#include <utility>

namespace filiform::internal {

namespace {

constexpr double kTourTime_s = 60;
constexpr double kEndless_s = 1e12;  // a replay ends with its recording

[[noreturn]] void refuseVirtualTime(const std::string& device) {
  throw UsageError("device " + inShort(device) + " keeps its own time: add --realtime");
}

// Refuses before a process starts that opens the device.
const RunOptions& withTimeOfDevice(const RunOptions& wanted) {
  if (!wanted.realtime && !wanted.make_device && isForceDevice(wanted.device)) refuseVirtualTime(wanted.device);
  return wanted;
}

TileKind tileKindOf(const RunOptions& options, const TravelDevice& device) {
  if (options.in_memory) return TileKind::held;
  return device.replaysMarks() && !options.realtime ? TileKind::replay : TileKind::resident;
}

}  // namespace

RunParts::RunParts(const TileStore& scene, const RunOptions& wanted)
    : store(scene),
      options(withTimeOfDevice(wanted)),
      time(options.rate_Hz),
      itinerary(store, options),
      first(itinerary.next()),
      first_cell(first->route.cell()),
      device({options.device, time.period_s(), options.delay_samples, options.make_device}),
      tiles(store, tileKindOf(options, device),
            {.budget_bytes = options.budget_bytes.value_or(UINT64_MAX),
             .prefetch = options.prefetch,
             .io_threads = options.io_threads}),
      statistics(store.tile_count()) {
  if (!options.record.empty()) record();
  check();
  device->open();
  choice = chooseNavigation(device.capabilities(), {device.heldDevice(), time.period_s(), options.zoom_um,
                                                    options.stiffness_N_m, options.passivity, options.leap});
  choice.navigation.buttons.fill(ButtonAction::none);
  hand.emplace(store, tiles, device, makeProxySolver(options.method, options.solver.value_or(SolverParameters{})),
               choice.navigation);
  hand->setMeasured(options.realtime);
  noteStability();
  const double limit_s = device.replaysMarks() ? kEndless_s : itinerary.isTour() ? kTourTime_s : first->nominal_limit_s;
  most_periods = time.periodsOf(options.seconds.value_or(limit_s));
  legs.emplace(options, itinerary, std::move(first), tiles, device, *hand);
}

void RunParts::record() {
  TravelRecordingOptions recording;
  recording.path = options.record;
  recording.device = device.heldDevice();
  recording.options = recordedOptions(store, options, itinerary.isTour() ? options.cell : first_cell);
  recording.writer_thread = options.realtime;
  recording.cancel = options.stop;
  device.record(recording);
}

void RunParts::check() const {
  const bool is_hand_replayed = device.replaysMarks() && handOf(device.heldDevice());
  if (itinerary.isTour() && !device.isLed() && !is_hand_replayed)
    throw UsageError(
        "a tour needs a simulated hand, which the simulated person leads, for example --device sim:medium");
  if (itinerary.isTour() && device.replay() != nullptr && options.realtime)
    throw UsageError(
        "a tour can be replayed in virtual time only, because its jumps must be made at the recorded ticks: leave out "
        "--realtime");
  if ((device.capabilities().paces_loop || device.capabilities().keeps_time) && !options.realtime)
    refuseVirtualTime(options.device);
  if (device.capabilities().rate_control && !options.realtime && device.replay() == nullptr)
    throw UsageError("device " + device.capabilities().name + " works in real time only: add --realtime");
}

void RunParts::noteStability() {
  if (std::string lowered = loweredNote(choice, device.capabilities()); !lowered.empty())
    notes.push_back(std::move(lowered));
  if (!handOf(device.heldDevice()) || choice.stiffness_N_m() < choice.bound_N_m) return;
  notes.push_back("stiffness " + std::to_string(std::lround(choice.stiffness_N_m())) +
                  " N/m is outside the stability bound of " + std::to_string(std::lround(choice.bound_N_m)) +
                  " N/m for this hand, rate and delay: " +
                  (choice.passivity() ? "the passivity controller weakens the force" : "the proxy may vibrate"));
}

void RunParts::placeAtStart() {
  const TileId home = legs->leg().home;
  if (tiles.table().find(home) == nullptr) tiles.loadTogether({&home, 1});
  if (!legs->begin(hand->navigation().workspace().centre_D(), time))
    throw UsageError("the route's first segment is not in its tile: verify the set");
  hand->publish(legs->focus());
}

bool RunParts::account(const NavigationTick& tick, TickRow& row) noexcept {
  row = statistics.add(tick, hand->navigation().place(), time);
  time.pass();
  legs->update(time);
  return time.periods() >= most_periods || (legs->isOver() && !itinerary.isTour());
}

void RunParts::end() {
  RecordingDevice* const recorder = device.recorder();
  if (was_interrupted) {
    keepRecording();
  } else if (recorder != nullptr) {
    recorder->finish();
    device.recording()->finish();
  }
  ended = true;
  if (options.ending) options.ending(summary());
}

void RunParts::fail(const std::exception_ptr& error) noexcept {
  if (std::exchange(ended, true)) return;
  keepRecording();
  try {
    if (!options.ending) return;
    RunSummary failed = summary();
    failed.outcome = RunOutcome::failed;
    try {
      std::rethrow_exception(error);
    } catch (const std::exception& why) {
      failed.error = why.what();
    } catch (...) {
      failed.error = "an unknown error";
    }
    options.ending(failed);
  } catch (...) {
    // run() reports the first failure.
  }
}

void RunParts::keepRecording() noexcept {
  if (statistics.ticks() == 0) return;
  const std::string kept = device.keepRecording();
  if (kept.empty() || kept == options.record || !options.recording_kept) return;
  try {
    options.recording_kept(kept);
  } catch (const std::exception&) {
    // run() reports the first failure.
  }
}

RunOutcome RunParts::outcome() const {
  if (was_interrupted) return RunOutcome::interrupted;
  if (legs->hasArrived() || itinerary.isTour()) return RunOutcome::completed;
  return time.periods() >= most_periods ? RunOutcome::time_over : RunOutcome::stuck;
}

RunSummary RunParts::summary() const {
  RunSummary s;
  s.outcome = outcome();
  statistics.fill(s, time);
  const LegTravel::Totals totals = legs->totals();
  s.route_um = totals.route_um;
  s.reached_um = totals.reached_um;
  s.back_offs = totals.back_offs;
  const LegTravel::Counts& counts = legs->counts();
  s.legs = counts.begun;
  s.legs_completed = counts.completed;
  s.jumps = counts.jumps;
  s.jump_wait_ticks = counts.jump_wait_ticks;
  s.jump_waits = legs->jumpWaits();
  s.segments = store.segmentCount();
  s.decoded_bytes = store.decodedBytes();
  s.cell = store.cell(first_cell).name;
  s.route = toString(options.route);
  s.method = options.method;
  s.stalls = hand->stalls();
  s.budget_bytes = options.budget_bytes;
  s.stiffness_N_m = choice.stiffness_N_m();
  s.passivity = choice.passivity();
  s.energy = hand->navigation().force_law().energy();
  s.missed_deadlines = missed_deadlines;
  s.loop = loop;
  HandTiles::Use use = tiles.use();
  s.tiles_read = use.reads;
  s.evictions = use.evictions;
  s.peak_bytes = use.peak_bytes;
  s.streaming = use.streaming;
  s.failures = std::move(use.failures);
  addNotes(s);
  return s;
}

void RunParts::addNotes(RunSummary& summary) const {
  summary.notes = notes;
  if (legs->counts().dropped > 0)
    summary.notes.push_back(counted(legs->counts().dropped, "leg of the tour was", "legs of the tour were") +
                            " dropped, because their first tile was not loaded in time");
  if (device.replay() != nullptr && device.replay()->differingWrenches() > 0)
    summary.notes.push_back(counted(device.replay()->differingWrenches(), "force differs", "forces differ") +
                            " from those of the recording: the set, an option or the program is not the same, or the "
                            "recorded loop was interrupted");
  if (hand->uncertain_ticks() > 0)
    summary.notes.push_back(counted(hand->uncertain_ticks(), "tick") +
                            " of the recording met more absent tiles than it can store: from the first of them "
                            "on, the replay may differ");
}

}  // namespace filiform::internal
