#include "viewer/session.h"

#include "device/device_factory.h"
#include "device/replay.h"
#include "device/simulated_hand.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "index/whole_number.h"
#include "solver/graph_view.h"
#include "solver/haptic_loop.h"
#include "solver/navigation.h"
#include "solver/parameters.h"
#include "solver/run.h"
#include "solver/tick_clock.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <fstream>
#include <thread>

#include <nlohmann/json.hpp>

namespace filiform {

namespace {

// Bits of RunMarks, as run() has them: a tick was computed; it met more absent tiles than the marks hold; its time step
// was measured.
constexpr std::uint32_t kTicked = 1, kMoreAbsent = 8, kMeasured = 16;

struct Commanded {  // before tick number `tick`
  std::uint64_t tick = 0;
  NavigationCommand command;
};

bool isHand(const std::string& device) { return device == "mouse" || device == "sim" || device.rfind("sim:", 0) == 0; }

nlohmann::ordered_json toJson(const Commanded& commanded) {
  const NavigationCommand& c = commanded.command;
  nlohmann::ordered_json json{{"tick", commanded.tick}, {"kind", static_cast<int>(c.kind)}};
  using Kind = NavigationCommand::Kind;
  if (c.kind == Kind::jump || c.kind == Kind::constrain) {
    const ProxyPlace& p = c.place;
    json["cell"] = p.segment.cell;
    json["segment"] = p.segment.segment;
    json["t"] = p.t;
    json["at_node"] = p.at_node;
    json["node"] = {p.node.cell, p.node.sample};
    json["tile"] = p.tile;
    json["p_um"] = {p.p_W.x(), p.p_W.y(), p.p_W.z()};
  }
  if (c.kind == Kind::zoom) json["factor"] = c.factor;
  if (c.kind == Kind::rotate) json["turn_rad"] = {c.about_x_rad, c.about_y_rad};
  return json;
}

Commanded fromJson(const nlohmann::ordered_json& json) {
  Commanded commanded{wholeNumber<std::uint64_t>(json.at("tick")), {}};
  NavigationCommand& c = commanded.command;
  using Kind = NavigationCommand::Kind;
  const int kind = wholeNumber<int>(json.at("kind"));
  if (kind < 0 || kind > static_cast<int>(Kind::centre)) throw InputError("no such command");
  c.kind = static_cast<Kind>(kind);
  if (c.kind == Kind::jump || c.kind == Kind::constrain) {
    c.place.segment = {wholeNumber<std::uint32_t>(json.at("cell")), wholeNumber<std::uint32_t>(json.at("segment"))};
    c.place.t = json.at("t").get<double>();
    c.place.at_node = json.at("at_node").get<bool>();
    c.place.node = {wholeNumber<std::uint32_t>(json.at("node").at(0)),
                    wholeNumber<std::uint32_t>(json.at("node").at(1))};
    c.place.tile = wholeNumber<TileId>(json.at("tile"));
    for (int axis = 0; axis < 3; ++axis)
      c.place.p_W[axis] = json.at("p_um").at(static_cast<std::size_t>(axis)).get<double>();
  }
  if (c.kind == Kind::zoom) c.factor = json.at("factor").get<double>();
  if (c.kind == Kind::rotate) {
    c.about_x_rad = json.at("turn_rad").at(0).get<double>();
    c.about_y_rad = json.at("turn_rad").at(1).get<double>();
  }
  return commanded;
}

}  // namespace

struct Session::Impl {
  Impl(const TileStore& scene, const SessionOptions& wanted);

  Wrench tick(const DeviceState& state, double step_s);  // throws in a replay only, where it reads tiles
  Wrench replayTick(const DeviceState& state);
  const NavigationTick& tickWithItsTiles(const DeviceState& state, double step_s);
  void applyCommands(const Eigen::Vector3d& h_D) noexcept;
  void mark(const NavigationTick& tick) noexcept;
  void hold(TileId tile);
  void readCommands(const std::string& path);
  void writeCommands();
  void replayLoop();
  void collectLog();

  const TileStore& store;
  SessionOptions options;
  double dt_s;
  std::string recorded_device;     // of a replay: what made the recorded one
  std::unique_ptr<Output> record;  // outlives the device, which writes to it
  std::unique_ptr<HapticDevice> device;
  SimulatedHand* hand = nullptr;
  ReplayDevice* replay = nullptr;
  RecordingDevice* recorder = nullptr;
  WorkspaceOptions workspace;
  std::string device_name;

  std::vector<std::shared_ptr<const Tile>> held;  // by tile; of a scene in memory and a replay
  std::unique_ptr<TileTable> table;
  std::unique_ptr<Residency> residency;
  TileReader* reader = nullptr;
  std::optional<GraphView> graph;
  std::unique_ptr<Navigation> navigation;
  std::vector<TileId> hidden;  // of a replay, during a tick

  NavigationLink link;
  TripleBuffer<Pointing> pointings;
  SpscRing<float> forces{8192};
  SpscRing<Commanded> log{4096};
  std::atomic<TileId> waited_for{kNoTile};
  std::atomic<bool> replay_ended{false};
  std::atomic<std::uint64_t> log_lost{0};

  // The ticking thread's.
  Pointing pointing;
  Vector3d p_D = Vector3d::Zero();  // the proxy after the last tick
  std::vector<Commanded> replayed;
  std::size_t next_replayed = 0;
  NavigationSnapshot filled;
  std::optional<TickClock> replay_clock;
  std::exception_ptr replay_error;

  // The commanding thread's.
  NavigationSnapshot newest;
  std::vector<Commanded> commanded;
  std::vector<std::string> notes;
  std::optional<ProxyPlace> awaited;
  bool awaited_under_hand = true, told_failed = false;
  std::optional<HoldId> hold_id;
  std::uint64_t release_at = 0;  // tick at which the hold may go
  bool finished = false, open = false;
  Wrench virtual_wrench;

  std::atomic<bool> stopping{false};
  std::thread replay_thread;
  std::unique_ptr<HapticLoop> loop;  // goes first
};

Session::Impl::Impl(const TileStore& scene, const SessionOptions& wanted)
    : store(scene), options(wanted), dt_s(1.0 / wanted.rate_Hz) {
  if (!(wanted.rate_Hz > 0 && wanted.rate_Hz <= 1e6)) throw UsageError("the rate must be between 0 and 1e6 Hz");
  std::string spec = options.device == "mouse" ? "sim:medium" : options.device;
  device = options.make_device ? options.make_device(spec, dt_s) : makeDevice(spec, {.period_s = dt_s});
  hand = isHand(options.device) ? dynamic_cast<SimulatedHand*>(device.get()) : nullptr;
  replay = dynamic_cast<ReplayDevice*>(device.get());
  const DeviceCapabilities can = device->capabilities();
  device_name = options.device == "mouse" ? "mouse" : can.name;
  if (replay != nullptr) {
    recorded_device = replay->device();
    readCommands(options.device.substr(options.device.find(':') + 1) + ".json");
  }
  const std::string led_by = replay != nullptr ? recorded_device : options.device;
  if (!options.stiffness_N_m) {
    if (isHand(led_by))
      options.stiffness_N_m = led_by == "sim:loose" ? 50.0 : 200.0;
    else
      options.stiffness_N_m = defaultStiffness(can, dt_s);
  }
  NavigationOptions navigating;
  navigating.force.stiffness_N_m = *options.stiffness_N_m;
  double damping_Ns_m = can.damping_Ns_m;
  if (isHand(led_by))
    damping_Ns_m += handParameters(led_by == "mouse" || led_by == "sim" ? "medium" : led_by.substr(4)).damping_Ns_m;
  navigating.force.passivity.on = *options.stiffness_N_m >= stiffnessBound(damping_Ns_m, dt_s, can.delay_samples);
  navigating.force.passivity.delay_samples = std::clamp(can.delay_samples, 0, PassivityOptions::kMaxDelay);
  navigating.workspace.lo_D = can.workspace_lo_D;
  navigating.workspace.hi_D = can.workspace_hi_D;
  navigating.workspace.zoom_um = options.zoom_um;
  navigating.rate_control = can.rate_control;
  workspace = navigating.workspace;
  p_D = 0.5 * (workspace.lo_D + workspace.hi_D);

  if (options.in_memory || replay != nullptr) {
    held.resize(store.tile_count());
    table = std::make_unique<TileTable>(store.tile_count());
    if (options.in_memory)
      for (TileId tile = 0; tile < store.tile_count(); ++tile) hold(tile);
    else if (store.long_tile() != kNoTile)
      hold(store.long_tile());
  } else {
    ResidencyOptions tiles;
    if (options.budget_bytes) tiles.budget_bytes = *options.budget_bytes;
    residency = std::make_unique<Residency>(store, tiles);
    reader = &residency->addReader("hand");
  }
  graph.emplace(table ? *table : reader->tiles(), store.leaves(), store.grid());
  SolverParameters parameters;
  const bool reaches = options.method == SolverMethod::force || options.method == SolverMethod::force_listing;
  if (reaches && store.cell_count() > 0) parameters = automaticParameters(store, defaultCell(store));
  navigation = std::make_unique<Navigation>(*graph, makeProxySolver(options.method, parameters), navigating);

  if (!options.record.empty()) {
    RecordingOptions recording;
    recording.device = options.device;
    recording.marked = true;
    record = std::make_unique<Output>(options.record);
    auto wrapped = std::make_unique<RecordingDevice>(std::move(device), record->stream(), recording);
    recorder = wrapped.get();
    device = std::move(wrapped);
  }
  device->open();
  open = true;
}

void Session::Impl::hold(TileId tile) {
  if (held[tile]) return;
  held[tile] = store.load(tile);
  if (std::find(hidden.begin(), hidden.end(), tile) == hidden.end()) table->add(*held[tile]);
}

void Session::Impl::applyCommands(const Eigen::Vector3d& h_D) noexcept {
  if (replay != nullptr) {
    while (next_replayed < replayed.size() && replayed[next_replayed].tick <= navigation->ticks())
      navigation->apply(replayed[next_replayed++].command, h_D);
    return;
  }
  NavigationCommand command;
  while (link.commands.pop(command)) {
    if (recorder != nullptr && !log.push({navigation->ticks(), command}))
      log_lost.fetch_add(1, std::memory_order_relaxed);
    navigation->apply(command, h_D);
  }
}

void Session::Impl::mark(const NavigationTick& ticked) noexcept {
  if (recorder == nullptr) return;
  RunMarks marks;
  marks.bits = kTicked | (loop ? kMeasured : 0u);
  if (ticked.frontier) {
    const TileList& absent = ticked.step.absent;
    marks.count = static_cast<std::uint32_t>(std::min<std::size_t>(absent.count, marks.values.size()));
    std::copy_n(absent.ids.begin(), marks.count, marks.values.begin());
    if (absent.overflow || absent.count > marks.count) marks.bits |= kMoreAbsent;
  }
  recorder->mark(marks);
}

// With the tiles absent that were when it was recorded, and all others there.
const NavigationTick& Session::Impl::tickWithItsTiles(const DeviceState& state, double step_s) {
  hidden.clear();
  if (replay->marked()) {
    const RunMarks& marks = replay->marks();
    for (std::uint32_t i = 0; i < marks.count; ++i)
      if (marks.values[i] < held.size()) hidden.push_back(marks.values[i]);
  }
  for (const TileId tile : hidden) table->retire(tile);
  const NavigationTick* ticked = &navigation->tick(state, step_s);
  for (bool loaded = true; ticked->frontier && loaded;) {
    loaded = false;
    for (std::uint32_t i = 0; i < ticked->step.absent.count; ++i) {
      const TileId tile = ticked->step.absent.ids[i];
      if (held[tile]) continue;
      hold(tile);
      loaded = true;
    }
    if (!loaded) break;
    navigation->undoSolve();
    ticked = &navigation->tick(state, step_s);
  }
  for (const TileId tile : hidden)
    if (held[tile]) table->add(*held[tile]);
  return *ticked;
}

Wrench Session::Impl::tick(const DeviceState& state, double step_s) {
  if (hand != nullptr) {
    Pointing newer;
    if (pointings.take(newer)) pointing = newer;
    Vector3d target_D = p_D;
    if (pointing.kind == Pointing::Kind::at) target_D = pointing.target_D;
    if (pointing.kind == Pointing::Kind::push) target_D += pointing.target_D;
    // No hand reaches beyond its device: at the rim it rests, and the world is moved under it.
    hand->setTarget(target_D.cwiseMax(workspace.lo_D).cwiseMin(workspace.hi_D));
  }
  if (reader != nullptr) reader->apply();
  applyCommands(state.p_D);
  const NavigationTick& ticked = replay != nullptr ? tickWithItsTiles(state, step_s) : navigation->tick(state, step_s);
  mark(ticked);
  p_D = ticked.mode == NavigationMode::free ? ticked.h_D : ticked.p_D;
  if (reader != nullptr) {
    for (std::uint32_t i = 0; i < ticked.step.absent.count; ++i) reader->request(ticked.step.absent.ids[i]);
    reader->publishFocus(navigation->focus());
    waited_for.store(ticked.frontier ? ticked.step.absent.ids[0] : kNoTile, std::memory_order_relaxed);
  }
  navigation->fill(filled);
  link.snapshots.publish(filled);
  forces.push(static_cast<float>(ticked.wrench.force_N.norm()));
  return ticked.wrench;
}

// As the recording did; zero where it computed nothing.
Wrench Session::Impl::replayTick(const DeviceState& state) {
  if (!replay_clock) replay_clock.emplace(dt_s);
  const double measured_s = replay_clock->step_s(state.time_s);
  const std::uint32_t bits = replay->marked() ? replay->marks().bits : kTicked;
  if ((bits & kTicked) == 0) return {};
  return tick(state, (bits & kMeasured) != 0 ? measured_s : dt_s);
}

void Session::Impl::replayLoop() {
  const auto period = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(dt_s));
  auto next = std::chrono::steady_clock::now();
  Wrench wrench;
  try {
    while (!stopping.load(std::memory_order_relaxed)) {
      const DeviceState state = device->exchange(wrench);
      if (state.status == DeviceStatus::closed) break;
      wrench = replayTick(state);
      next += period;
      std::this_thread::sleep_until(next);
    }
  } catch (...) {
    replay_error = std::current_exception();
  }
  replay_ended.store(true, std::memory_order_release);
}

void Session::Impl::readCommands(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError(escaped(path), "missing: it holds the session's commands, beside the recording", errno);
  try {
    const auto json = nlohmann::ordered_json::parse(in);
    options.zoom_um = json.at("zoom_um").get<double>();
    options.method = solverMethod(json.at("method").get<std::string>());
    options.stiffness_N_m = json.at("stiffness_N_m").get<double>();
    options.rate_Hz = json.at("rate_Hz").get<double>();
    dt_s = 1.0 / options.rate_Hz;
    for (const auto& one : json.at("commands")) replayed.push_back(fromJson(one));
  } catch (const nlohmann::json::exception& error) {
    throw InputError(escaped(path) + ": not the commands of a session: " + error.what());
  } catch (const std::out_of_range& error) {
    throw InputError(escaped(path) + ": not the commands of a session: " + error.what());
  }
  for (const Commanded& one : replayed)
    if (one.command.place.valid() && one.command.place.tile >= store.tile_count())
      throw InputError(escaped(path) + ": recorded in another scene, which has more tiles");
}

void Session::Impl::collectLog() {
  Commanded one;
  while (log.pop(one)) commanded.push_back(one);
}

void Session::Impl::writeCommands() {
  collectLog();
  nlohmann::ordered_json json{{"filiform_session", 1},
                              {"zoom_um", options.zoom_um},
                              {"method", toString(options.method)},
                              {"stiffness_N_m", *options.stiffness_N_m},
                              {"rate_Hz", options.rate_Hz}};
  json["commands"] = nlohmann::ordered_json::array();
  for (const Commanded& one : commanded) json["commands"].push_back(toJson(one));
  Output out(options.record + ".json");
  out.stream() << json.dump(1) << '\n';
  out.finish();
}

Session::Session(const TileStore& store, const SessionOptions& options)
    : impl_(std::make_unique<Impl>(store, options)) {}

Session::~Session() {
  try {
    finish();
  } catch (const std::exception&) {  // whoever wanted to know called finish()
  }
}

void Session::start() {
  Impl& s = *impl_;
  if (s.loop || s.replay_thread.joinable()) return;
  if (s.replay != nullptr) {
    s.replay_thread = std::thread([&s] { s.replayLoop(); });
    return;
  }
  HapticLoopOptions looping;
  looping.rate_Hz = s.options.rate_Hz;
  looping.ramp_at_start = false;  // the force law's
  s.loop = std::make_unique<HapticLoop>(
      *s.device, [&s](const DeviceState& state, double dt_s) { return s.tick(state, dt_s); }, looping);
  if (s.residency) s.residency->start();
  s.loop->start();
  s.notes = s.loop->refusals();
}

void Session::advance(std::uint64_t ticks) {
  Impl& s = *impl_;
  if (!s.options.in_memory && s.replay == nullptr) throw std::logic_error("virtual time needs a scene in memory");
  for (std::uint64_t i = 0; i < ticks; ++i) {
    const DeviceState state = s.device->exchange(s.virtual_wrench);
    if (s.replay != nullptr && state.status == DeviceStatus::closed) {
      s.replay_ended = true;
      return;
    }
    s.virtual_wrench = s.replay != nullptr ? s.replayTick(state) : s.tick(state, s.dt_s);
    s.collectLog();
  }
}

void Session::finish() {
  Impl& s = *impl_;
  if (s.finished) return;
  s.finished = true;
  if (s.loop) s.loop->stop();
  s.stopping = true;
  if (s.replay_thread.joinable()) s.replay_thread.join();
  update();
  s.device->close();
  std::exception_ptr failure;
  if (s.recorder != nullptr) {
    try {
      s.recorder->finish();
    } catch (...) {
      failure = std::current_exception();
    }
    if (s.recorder->whole()) {  // what it holds can be replayed, even where exchanges were lost
      s.record->finish();
      if (s.record->isFile()) s.writeCommands();
    }
  }
  // Last, because it waits for the tile that is being read.
  if (s.residency) s.residency->stop();
  if (failure) std::rethrow_exception(failure);
  if (s.log_lost > 0) throw DeviceError("commands came faster than they were recorded: the recording is not whole");
}

const NavigationSnapshot& Session::update() {
  Impl& s = *impl_;
  s.link.snapshots.take(s.newest);
  s.collectLog();
  if (!s.residency) {
    if (s.awaited) {
      NavigationCommand command;
      command.kind = s.awaited_under_hand ? NavigationCommand::Kind::jump : NavigationCommand::Kind::constrain;
      command.place = *s.awaited;
      if (send(command)) s.awaited.reset();
    }
    return s.newest;
  }
  const TileId resting_at = s.waited_for.load(std::memory_order_relaxed);
  const bool failed = resting_at != kNoTile && s.residency->state(resting_at) == TileState::failed;
  // A proxy that rests because the source fails is no place for the hand to be held at.
  if (s.loop) s.loop->withhold(failed);
  if (failed && !s.told_failed)
    s.notes.push_back("the proxy waits at a tile that cannot be read; go back (Backspace) or wait");
  s.told_failed = failed;
  if (s.awaited && !s.hold_id) s.hold_id = s.residency->hold({&s.awaited->tile, 1}, HoldKind::target);
  if (s.awaited && s.residency->state(s.awaited->tile) == TileState::failed) {
    s.notes.push_back("no jump: tile " + std::to_string(s.awaited->tile) + " cannot be read");
    s.awaited.reset();
    s.release_at = 0;
  } else if (s.awaited && s.residency->isHeld(*s.hold_id)) {
    NavigationCommand command;
    command.kind = s.awaited_under_hand ? NavigationCommand::Kind::jump : NavigationCommand::Kind::constrain;
    command.place = *s.awaited;
    if (s.link.commands.push(command)) {
      s.awaited.reset();
      s.release_at = s.newest.tick + 100;
    }
  }
  if (s.hold_id && !s.awaited && s.newest.tick >= s.release_at) {
    s.residency->release(*s.hold_id);
    s.hold_id.reset();
  }
  return s.newest;
}

const NavigationSnapshot& Session::now() const { return impl_->newest; }
void Session::point(const Pointing& pointing) { impl_->pointings.publish(pointing); }

bool Session::send(const NavigationCommand& command) {
  if (impl_->replay != nullptr) return true;
  return impl_->link.commands.push(command);
}

void Session::jump(const ProxyPlace& place, bool under_hand) {
  Impl& s = *impl_;
  if (s.replay != nullptr || !place.valid()) return;
  if (s.hold_id && s.residency) s.residency->release(*s.hold_id);
  s.hold_id.reset();
  s.awaited = place;
  s.awaited_under_hand = under_hand;
  update();
}

std::optional<ProxyPlace> Session::awaited() const { return impl_->awaited; }
bool Session::replaying() const { return impl_->replay != nullptr; }
bool Session::replayEnded() const { return impl_->replay_ended.load(std::memory_order_acquire); }
bool Session::hasHand() const { return impl_->hand != nullptr; }
const std::string& Session::deviceName() const { return impl_->device_name; }
double Session::stiffness_N_m() const { return *impl_->options.stiffness_N_m; }
const WorkspaceOptions& Session::workspaceOptions() const { return impl_->workspace; }

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

std::vector<std::string> Session::takeNotes() { return std::exchange(impl_->notes, {}); }

void Session::takeForces(std::vector<float>& forces_N) {
  forces_N.clear();
  for (float force_N = 0; impl_->forces.pop(force_N);) forces_N.push_back(force_N);
}

std::uint64_t Session::ticks() const { return impl_->newest.tick; }
std::uint64_t Session::interruptions() const { return impl_->loop ? impl_->loop->interruptions() : 0; }
const LoopMetrics* Session::metrics() const {
  return impl_->finished && impl_->loop ? &impl_->loop->metrics() : nullptr;
}
const Residency* Session::residency() const { return impl_->residency.get(); }

}  // namespace filiform
