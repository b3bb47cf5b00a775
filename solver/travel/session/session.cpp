#include "solver/travel/session/session.h"

#include "device/recording/replay.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "solver/loop/haptic_loop.h"
#include "solver/travel/hand/internal/hand_navigation.h"
#include "solver/travel/hand/internal/hand_tiles.h"
#include "solver/travel/hand/internal/navigation_choice.h"
#include "solver/travel/hand/internal/travel_device.h"
#include "solver/travel/run/recorded_options.h"
#include "solver/travel/session/internal/awaited_jump.h"
#include "solver/travel/session/internal/session_commands.h"
#include "solver/travel/session/internal/session_hand.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <stdexcept>
#include <thread>
#include <utility>

namespace filiform {

using internal::SessionCommand;

namespace {

constexpr const char* kMouse = "mouse";
constexpr const char* kMouseHand = "sim:medium";  // the hand that the pointer moves

std::string handNameOf(const std::string& device) { return device == kMouse ? kMouseHand : device; }

internal::TileKind sessionTileKind(const SessionOptions& options, const internal::TravelDevice& device) {
  if (options.shared.residency != nullptr) return internal::TileKind::shared;
  if (options.in_memory) return internal::TileKind::held;
  return device.replay() != nullptr ? internal::TileKind::replay : internal::TileKind::resident;
}

// A replay reads tiles without limit.
std::uint64_t sessionBudget(const SessionOptions& options, const internal::TravelDevice& device) {
  return device.replay() == nullptr ? options.budget_bytes.value_or(UINT64_MAX) : UINT64_MAX;
}

// Many sessions share a machine's memory, so that each keeps fewer nodes.
constexpr std::uint32_t kSharedPoolNodes = 1024;

SolverParameters parametersOf(const SessionOptions& options) {
  SolverParameters parameters;
  if (options.shared.residency != nullptr) parameters.pool_nodes = kSharedPoolNodes;
  return parameters;
}

SessionOptions checked(const SessionOptions& options) {
  if (!(options.rate_Hz > 0 && options.rate_Hz <= 1e6)) throw UsageError("the rate must be between 0 and 1e6 Hz");
  return options;
}

}  // namespace

struct Session::Impl {
  Impl(const TileStore& scene, const SessionOptions& wanted);

  internal::NavigationChoice choose(const TileStore& scene);
  void record();
  void startLoop();
  void replayLoop();  // on its own thread
  void collectLog();
  void finishRecording();
  void watchTiles();

  SessionOptions options;
  double period_s;
  internal::TravelDevice device;
  SimulatedHand* hand;  // moved by the pointer; nullptr: none
  std::string device_name;
  std::vector<SessionCommand> replayed;
  internal::NavigationChoice choice;
  internal::HandTiles tiles;
  internal::HandNavigation travel;
  internal::SessionChannels channels;
  TickClock clock;                   // with SessionOptions::shared
  internal::SessionHand travelling;  // the ticking thread's

  NavigationSnapshot newest;
  std::vector<SessionCommand> commanded;
  std::vector<std::string> notes;
  internal::AwaitedJump awaited;
  bool told_failed = false, finished = false;
  Wrench virtual_wrench;

  std::exception_ptr replay_error;  // set before replay_ended
  std::atomic<bool> replay_ended{false}, stopping{false};
  std::thread replay_thread;
  std::unique_ptr<HapticLoop> loop;  // last member: destroyed first
};

Session::Impl::Impl(const TileStore& scene, const SessionOptions& wanted)
    : options(checked(wanted)),
      period_s(1.0 / wanted.rate_Hz),
      device({.name = handNameOf(wanted.device), .period_s = period_s, .make = wanted.make_device}),
      hand(internal::handOf(handNameOf(wanted.device)) ? device.hand() : nullptr),
      device_name(wanted.device == kMouse ? kMouse : device.capabilities().name),
      choice(choose(scene)),
      tiles(scene, sessionTileKind(options, device), {.budget_bytes = sessionBudget(options, device)}, options.shared),
      travel(scene, tiles, device, makeProxySolver(options.method, parametersOf(options)), choice.navigation),
      channels(options.record.empty() ? 2 : 4096),
      clock(period_s),
      travelling(device, tiles, travel, channels, hand, choice.navigation.workspace, std::move(replayed)),
      awaited(scene, options.method) {
  travel.setMeasured(options.shared.residency != nullptr);
}

internal::NavigationChoice Session::Impl::choose(const TileStore& scene) {
  if (device.replay() != nullptr) {
    const std::string file = options.device.substr(options.device.find(':') + 1);
    if (!isSessionRecording(file) && !readRecordingWords(file).options.empty())
      throw UsageError(escaped(file) +
                       ": was recorded by navigate; replay it with filiform navigate SET --device replay:" +
                       escaped(file) + ", or draw it with filiform render --path");
    internal::SessionCommands recorded = internal::readSessionCommands(file + ".json", scene);
    options.zoom_um = recorded.zoom_um;
    options.leap = recorded.leap;
    options.method = recorded.method;
    options.stiffness_N_m = recorded.stiffness_N_m;
    options.rate_Hz = recorded.rate_Hz;
    options.buttons = [map = recorded.buttons](const DeviceCapabilities&) { return map; };
    period_s = 1.0 / options.rate_Hz;
    replayed = std::move(recorded.commands);
    internal::CellReaches reaches(scene, options.method);
    for (SessionCommand& given : replayed)
      if (given.command.place.valid()) given.command.reach = reaches.of(given.command.place.segment.cell);
  }
  // Opened before the choice, because some devices measure their limits then.
  if (!options.record.empty()) record();
  device->open();
  const DeviceCapabilities& can = device.capabilities();
  const bool has_map = options.buttons && options.device != "mouse";
  const std::optional<ButtonMap> buttons = has_map ? options.buttons(can) : std::nullopt;
  if (buttons && device.replay() == nullptr) requireButtons(*buttons, can);
  return internal::chooseNavigation(can, {.held_device = handNameOf(device.heldDevice()),
                                          .period_s = period_s,
                                          .zoom_um = options.zoom_um,
                                          .stiffness_N_m = options.stiffness_N_m,
                                          .leap = options.leap,
                                          .buttons = buttons});
}

void Session::Impl::record() {
  internal::TravelRecordingOptions recording;
  recording.path = options.record;
  recording.device = options.device;
  recording.options = kSessionOptions;
  recording.writer_thread = options.shared.residency == nullptr;
  device.record(recording);
}

void Session::Impl::replayLoop() {
  const auto period = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(period_s));
  auto next = std::chrono::steady_clock::now();
  Wrench wrench;
  try {
    while (!stopping.load(std::memory_order_relaxed)) {
      const DeviceState state = device->exchange(wrench);
      if (device.replayEnded(state)) break;
      wrench = travelling.virtualTick(state, period_s);
      travel.prepare(0);
      next += period;
      std::this_thread::sleep_until(next);
    }
  } catch (...) {
    replay_error = std::current_exception();
  }
  replay_ended.store(true, std::memory_order_release);
}

// ---- the commanding thread

void Session::Impl::startLoop() {
  HapticLoopOptions looping;
  looping.rate_Hz = options.rate_Hz;
  looping.ramp_at_start = false;  // the force law has its own ramp
  looping.idle = [this](double free_s) { travel.prepare(free_s); };
  travel.setMeasured(true);
  loop = std::make_unique<HapticLoop>(
      *device, [this](const DeviceState& state, double dt_s) { return travelling.tick(state, dt_s); }, looping);
  if (tiles.residency() != nullptr) tiles.residency()->start();
  loop->start();
  // A simulated hand needs no punctual loop, so its user need not know which rights the system refused.
  if (hand == nullptr) notes = loop->refusals();
  if (std::string lowered = internal::loweredNote(choice, device.capabilities()); !lowered.empty())
    notes.push_back(std::move(lowered));
}

void Session::Impl::collectLog() {
  SessionCommand one;
  while (channels.log.pop(one)) commanded.push_back(one);
}

void Session::Impl::finishRecording() {
  std::string kept = options.record;
  std::exception_ptr failure;
  try {
    try {
      device.recorder()->finish();
    } catch (const std::exception&) {
      if (!device.recorder()->whole()) throw;  // if exchanges were lost, it can be replayed
      failure = std::current_exception();
    }
    device.recording()->finish();
  } catch (...) {
    failure = std::current_exception();
    kept = device.keepRecording();
  }
  collectLog();
  if (!kept.empty() && device.recording()->isFile())
    internal::writeSessionCommands(kept + ".json", {.zoom_um = options.zoom_um,
                                                    .stiffness_N_m = choice.stiffness_N_m(),
                                                    .rate_Hz = options.rate_Hz,
                                                    .leap = options.leap,
                                                    .method = options.method,
                                                    .buttons = choice.navigation.buttons,
                                                    .commands = commanded});
  if (failure) std::rethrow_exception(failure);
}

// While the proxy rests at a tile that cannot be read, the force is zero.
void Session::Impl::watchTiles() {
  if (tiles.residency() == nullptr) return;
  const bool failed = travel.waitsForFailedTile();
  if (loop) loop->withhold(failed);
  if (failed && !told_failed)
    notes.push_back("the proxy waits at a tile that cannot be read; go back (Backspace) or wait");
  told_failed = failed;
}

Session::Session(const TileStore& store, const SessionOptions& options)
    : impl_(std::make_unique<Impl>(store, options)) {}

Session::~Session() {
  try {
    finish();
  } catch (const std::exception&) {  // call finish() to get exceptions
  }
}

void Session::start() {
  Impl& s = *impl_;
  if (s.loop || s.replay_thread.joinable()) return;
  if (s.device.replay() != nullptr)
    s.replay_thread = std::thread([&s] { s.replayLoop(); });
  else
    s.startLoop();
}

void Session::advance(std::uint64_t ticks) {
  Impl& s = *impl_;
  if (!s.options.in_memory && !replaying()) throw std::logic_error("virtual time needs a scene in memory");
  for (std::uint64_t i = 0; i < ticks; ++i) {
    const DeviceState state = s.device->exchange(s.virtual_wrench);
    if (s.device.replayEnded(state)) {
      s.replay_ended = true;
      return;
    }
    s.virtual_wrench = s.travelling.virtualTick(state, s.period_s);
    s.travel.prepare(s.period_s);
    s.collectLog();
  }
}

const NavigationSnapshot& Session::tick() noexcept {
  Impl& s = *impl_;
  const DeviceState state = s.device->exchange(s.virtual_wrench);
  s.virtual_wrench = s.travelling.tick(state, s.clock.step_s(state.time_s));
  return s.travelling.snapshot();
}

void Session::prepare(double free_s) noexcept { impl_->travel.prepare(free_s); }
const GraphView& Session::graph() const noexcept { return impl_->travel.graph(); }

void Session::finish() {
  Impl& s = *impl_;
  if (s.finished) return;
  s.finished = true;
  s.awaited.cancel(s.tiles.residency());
  if (s.loop) s.loop->stop();
  s.stopping = true;
  if (s.replay_thread.joinable()) s.replay_thread.join();
  update();
  s.device->close();
  std::exception_ptr failure;
  try {
    if (s.device.recorder() != nullptr) s.finishRecording();
  } catch (...) {
    failure = std::current_exception();
  }
  if (s.options.ending) s.options.ending();
  // Last, because it waits for the tile that is being read.
  if (s.tiles.reader() != nullptr) s.tiles.residency()->stop();
  if (failure) std::rethrow_exception(failure);
  if (s.channels.log_lost > 0)
    throw DeviceError("commands came faster than they could be recorded; the recording is incomplete");
}

const NavigationSnapshot& Session::update() {
  Impl& s = *impl_;
  s.channels.link.snapshots.take(s.newest);
  s.collectLog();
  s.watchTiles();
  if (std::optional<std::string> note = s.awaited.serve(s.newest.tick, s.channels.link.commands, s.tiles.residency()))
    s.notes.push_back(std::move(*note));
  return s.newest;
}

void Session::drainRecording() {
  if (impl_->device.recorder() != nullptr) impl_->device.recorder()->drain();
}

void Session::jump(const ProxyPlace& place, bool under_hand) {
  if (replaying() || !place.valid()) return;
  impl_->awaited.ask(place, under_hand, impl_->tiles.residency());
  update();
}

bool Session::send(const NavigationCommand& command) {
  return replaying() || impl_->channels.link.commands.push(command);
}

std::string Session::fault() const {
  const Impl& s = *impl_;
  if (s.loop) return s.loop->fault();
  if (!replayEnded() || !s.replay_error) return {};
  try {
    std::rethrow_exception(s.replay_error);
  } catch (const std::exception& error) {
    return error.what();
  }
}

void Session::takeForces(std::vector<float>& forces_N) {
  forces_N.clear();
  for (float force_N = 0; impl_->channels.forces.pop(force_N);) forces_N.push_back(force_N);
}

const LoopMetrics* Session::metrics() const {
  return impl_->finished && impl_->loop ? &impl_->loop->metrics() : nullptr;
}

const NavigationSnapshot& Session::now() const { return impl_->newest; }
void Session::point(const Pointing& pointing) { impl_->channels.pointings.publish(pointing); }
std::optional<ProxyPlace> Session::awaited() const { return impl_->awaited.place(); }
bool Session::replaying() const { return impl_->device.replay() != nullptr; }
bool Session::replayEnded() const { return impl_->replay_ended.load(std::memory_order_acquire); }
bool Session::waitsForFailedTile() const { return impl_->told_failed; }
bool Session::hasHand() const { return impl_->hand != nullptr; }
const std::string& Session::deviceName() const { return impl_->device_name; }
double Session::stiffness_N_m() const { return impl_->choice.stiffness_N_m(); }
const WorkspaceOptions& Session::workspaceOptions() const { return impl_->choice.navigation.workspace; }
std::vector<std::string> Session::takeNotes() { return std::exchange(impl_->notes, {}); }
std::uint64_t Session::ticks() const { return impl_->newest.tick; }
std::uint64_t Session::interruptions() const { return impl_->loop ? impl_->loop->interruptions() : 0; }
const Residency* Session::residency() const { return impl_->tiles.residency(); }

}  // namespace filiform
