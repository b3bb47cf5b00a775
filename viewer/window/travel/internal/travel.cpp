#include "viewer/window/travel/internal/travel.h"

#include "index/errors.h"
#include "index/measure/cell_measures.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::internal {

namespace {

using Kind = NavigationCommand::Kind;

constexpr double kAimAhead_m = 0.004;  // from the proxy to the simulated hand, along its path
constexpr double kLittleLeap = 0.3;    // the least that completes all measured routes (solver/RESULTS.md)
constexpr std::size_t kForcesKept = 4000, kVisitedKept = 400;

}  // namespace

Travel::Travel(Opened opened, Messages& messages, Callbacks callbacks)
    : messages_(messages),
      callbacks_(std::move(callbacks)),
      opened_(std::move(opened)),
      sessions_(*opened_.scene.store, std::move(opened_.session), opened_.options, opened_.start,
                {callbacks_.plugged_in, callbacks_.awaited_device}, messages),
      census_(*opened_.scene.store),
      worker_(std::make_unique<Worker>()) {}

Travel::~Travel() { leaving_.store(true, std::memory_order_relaxed); }

void Travel::start() {
  for (const std::string& warning : opened_.warnings) messages_.say(warning);
  const std::vector<std::uint32_t>& only = opened_.scene.only;
  if (opened_.start.valid()) sessions_.current().jump(opened_.start);
  if (!only.empty() && !std::binary_search(only.begin(), only.end(), opened_.start.segment.cell))
    goToCell(only.front());
}

void Travel::finish() {
  leaving_.store(true, std::memory_order_relaxed);
  std::exception_ptr failure;
  try {
    sessions_.current().finish();
  } catch (...) {
    failure = std::current_exception();
  }
  const std::vector<std::string> others = sessions_.finish();
  if (worker_) {
    worker_.reset();  // it may be saving
    try {
      if (opened_.saved && !sessions_.current().replaying()) {
        rememberPlace();
        opened_.saved->save();
      }
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
  if (!others.empty()) throw DeviceError(others.front());
}

void Travel::savePlaces() {
  if (!opened_.saved || sessions_.current().replaying()) return;
  rememberPlace();
  worker_->ask([&saved = *opened_.saved, history = history()]() -> Worker::Done {
    saved.save(history);
    return {};
  });
}

void Travel::rememberPlace() {
  if (history().places().empty() && now().place.valid()) history().jump({}, now().place);
}

// ---- each frame

void Travel::serve() {
  worker_->serve([this](const std::string& what) {
    junction_asked_ = false;
    walk_asked_ = UINT32_MAX;
    listing_ = false;
    messages_.sayOnce(what);
  });
  watch();
}

void Travel::watch() {
  const NavigationSnapshot& s = sessions_.current().update();
  if (s.asked_constrain != std::exchange(asked_constrain_, s.asked_constrain)) constrain();
  if (s.asked_back != std::exchange(asked_back_, s.asked_back)) goBack();
  if (s.asked_forward != std::exchange(asked_forward_, s.asked_forward)) goForward();
  for (const std::string& note : sessions_.current().takeNotes()) messages_.say(note);
  sessions_.current().takeForces(new_forces_);
  forces_.insert(forces_.end(), new_forces_.begin(), new_forces_.end());
  if (forces_.size() > kForcesKept) forces_.erase(forces_.begin(), forces_.end() - kForcesKept);
  if (sessions_.current().replaying() && sessions_.current().replayEnded() && !std::exchange(replay_told_, true))
    messages_.say("the recording has ended");
  const bool is_somewhere = s.place.valid() || s.mode == NavigationMode::free;
  if (is_somewhere && (visited_W_.empty() || (visited_W_.back() - s.p_W).norm() > 0.2 * s.zoom_um)) {
    visited_W_.push_back(s.p_W);
    if (visited_W_.size() > kVisitedKept) visited_W_.erase(visited_W_.begin());
  }
  const SessionKeeper::Change change = sessions_.watch(*worker_);
  if (change == SessionKeeper::Change::none) return;
  asked_constrain_ = asked_back_ = asked_forward_ = 0;
  if (change == SessionKeeper::Change::to_device) path_.end();
}

void Travel::lead(const std::optional<Pointing>& pointing, const Workspace& workspace) {
  if (!sessions_.current().hasHand()) return;
  if (pointing) {
    path_.end();
    return sessions_.current().point(*pointing);
  }
  if (!path_.isUnderWay()) return sessions_.current().point({});
  const Vector3d aim_W = path_.aim_W(now().p_W, kAimAhead_m * workspace.scale_um_m());
  if (path_.isUnderWay()) return sessions_.current().point(Pointing::at(workspace.toDevice(aim_W)));
  sessions_.current().point({});
  messages_.say("the simulated hand has reached the tip");
}

void Travel::observe() {
  lookForFork();
  nameCell();
  if (!measure_.isBehind(now().place)) return;
  if (const CellWalk* read = walk()) measure_.measure(now().place, *read);
}

void Travel::nameCell() {
  const ProxyPlace& place = now().place;
  if (!place.valid()) {
    cell_name_.clear();
    neurite_.clear();
    named_at_.reset();
    sample_.reset();
    return;
  }
  const CellWalk* read = walk();
  if (read == nullptr || (named_at_ && named_at_->segment == place.segment && named_at_->t == place.t)) return;
  cell_name_ = read->graph().name;
  const auto spot = read->spotOf(place);
  if (!spot) return;
  named_at_ = place;
  neurite_ = kindText(*read, *spot);
  sample_ = read->graph().sample_ids[spot->t > 0.5 ? spot->parent : spot->child];
}

void Travel::lookForFork() {
  const NavigationSnapshot& s = now();
  if (!s.place.valid() || s.mode == NavigationMode::free) {
    junction_.reset();
    return;
  }
  if (junction_asked_ || !worker_->idle()) return;
  if (junction_at_ && junction_at_->segment == s.place.segment &&
      (junction_at_->p_W - s.place.p_W).norm() < 0.01 * s.zoom_um && junction_zoom_um_ == s.zoom_um)
    return;
  const Vector3d heading = junction_at_ ? Vector3d(s.place.p_W - junction_at_->p_W) : Vector3d(Vector3d::Zero());
  junction_at_ = s.place;
  junction_zoom_um_ = s.zoom_um;
  junction_asked_ = true;
  heading_W_ = heading;
  worker_->ask([this, place = s.place, zoom_um = s.zoom_um, heading]() -> Worker::Done {
    std::optional<Junction> found;
    try {
      found = finder().junction(place, heading, zoom_um / 2, zoom_um / 10);
    } catch (const Error&) {  // the session reports it when the hand gets there
    }
    return [this, found = std::move(found)] {
      junction_ = found;
      junction_asked_ = false;
    };
  });
}

// The cell at the proxy; nullptr until it has been read.
const CellWalk* Travel::walk() {
  const ProxyPlace& place = now().place;
  if (!place.valid()) return nullptr;
  const std::uint32_t cell = place.segment.cell;
  if (walk_ && walk_cell_ == cell) return walk_.get();
  if (walk_asked_ == cell) return nullptr;
  walk_asked_ = cell;
  worker_->ask([this, cell]() -> Worker::Done {
    auto read = finder().walk(cell, &leaving_);
    return [this, cell, read] {
      walk_ = read;
      walk_cell_ = cell;
      walk_asked_ = UINT32_MAX;
    };
  });
  return nullptr;
}

// ---- commands

bool Travel::act(Action action) {
  NavigationCommand command;
  switch (action) {
    case Action::toggle_free:
      if (now().mode == NavigationMode::free) {
        constrain();
        return true;
      }
      command.kind = Kind::free;
      sessions_.current().send(command);
      return true;
    case Action::centre:
      command.kind = Kind::centre;
      sessions_.current().send(command);
      return true;
    case Action::next_leap:
      nextLeap();
      return true;
    case Action::back:
      goBack();
      return true;
    case Action::forward:
      goForward();
      return true;
    case Action::measure:
      toggleMeasure();
      return true;
    case Action::simulated_hand:
    case Action::neurite_tip:
      toggleSimulatedHand(action == Action::neurite_tip);
      return true;
    case Action::next_branch:
    case Action::previous_branch:
    case Action::next_sample:
    case Action::parent_sample:
    case Action::other_branch:
    case Action::nearest_tip:
    case Action::soma:
      step(action);
      return true;
    default:
      return false;
  }
}

void Travel::nextLeap() {
  if (sessions_.current().replaying()) return;
  if (opened_.options.method != SolverMethod::climb) return messages_.say("only the method climb leaps");
  const double leap = now().leap;
  NavigationCommand command;
  command.kind = Kind::leap;
  command.factor = leap > kLittleLeap ? kLittleLeap : leap > 0 ? 0 : 1;
  if (!sessions_.current().send(command)) return;
  messages_.say(command.factor == 1  ? "the proxy leaps along its cell, for the smallest force"
                : command.factor > 0 ? "the proxy leaps a little, for more force"
                                     : "the proxy does not leap: it stops where the way leads away from the hand");
}

void Travel::turn(const Turn& turn) {
  NavigationCommand command;
  command.kind = Kind::rotate;
  command.about_x_rad = turn.about_x_rad;
  command.about_y_rad = turn.about_y_rad;
  sessions_.current().send(command);
}

void Travel::turnTo(const Eigen::Quaterniond& rotation_WD) {
  // Workspace::rotate() turns by the inverse of what it is given.
  const Vector3d angles_rad =
      Eigen::Matrix3d(now().rotation_WD.conjugate() * rotation_WD).eulerAngles(1, 0, 1);  // about y, x, y
  turn({0, -angles_rad[0]});
  turn({-angles_rad[1], 0});
  turn({0, -angles_rad[2]});
}

void Travel::zoom(double factor) {
  NavigationCommand command;
  command.kind = Kind::zoom;
  command.factor = factor;
  sessions_.current().send(command);
}

// ---- places

void Travel::go(const ProxyPlace& place, bool remember) {
  if (!place.valid()) return;
  if (sessions_.current().replaying()) return messages_.say("replaying a recording: travel commands are ignored");
  if (remember) history().jump(now().place, place);
  path_.end();
  callbacks_.jumps();
  sessions_.current().jump(place);
  ++jumps_;
}

void Travel::goWhenFound(std::function<ProxyPlace()> find) {
  worker_->ask([this, find = std::move(find)]() -> Worker::Done {
    try {
      const ProxyPlace place = find();
      return [this, place] { go(place, true); };
    } catch (const Error& error) {
      return [this, what = std::string(error.what())] {
        callbacks_.finds_nothing(what);
        messages_.say(what);
      };
    }
  });
}

void Travel::goAlong(const RayQuery& ray) {
  goWhenFound([this, ray, states = states_] {
    const auto picked = pick(ray, states.get());
    if (!picked) throw UsageError("no neurite under the pointer");
    return *picked;
  });
}

void Travel::goTo(const CellQuery& query) {
  goWhenFound([this, query] { return finder().find(query); });
}

void Travel::goToCell(std::uint32_t cell) {
  goWhenFound([this, cell] { return finder().soma(cell); });
}

void Travel::goToPlace(std::uint32_t cell, const CellPlace& place) {
  goWhenFound([this, cell, place] { return finder().at(*finder().walk(cell, &leaving_), cell, place); });
}

void Travel::goNear(const Vector3d& p_W) {
  goWhenFound([this, p_W] {
    const auto found = finder().nearest(p_W);
    if (!found) throw UsageError("the scene has no segment");
    return found->place;
  });
}

void Travel::constrain() {
  worker_->ask([this, p_W = now().p_W]() -> Worker::Done {
    const auto found = finder().nearest(p_W);
    if (!found) return {};
    return [this, found] { sessions_.current().jump(found->place, false); };
  });
}

void Travel::goBack() {
  if (const auto place = history().back(now().place)) return go(*place, false);
  messages_.say("there is no earlier place");
}

void Travel::goForward() {
  if (const auto place = history().forward(now().place)) return go(*place, false);
  messages_.say("there is no later place");
}

void Travel::findNames(const std::string& text, std::function<void(std::vector<std::string>)> found) {
  worker_->ask([&scene = store(), text, found = std::move(found)]() -> Worker::Done {
    std::vector<std::string> names;
    for (const std::uint32_t cell : findCells(scene, parseCellQuery(text).name, 12))
      names.push_back(scene.cell(cell).name);
    return [found, names = std::move(names)] { found(names); };
  });
}

std::optional<ProxyPlace> Travel::pick(const RayQuery& ray, const CellStates* states) const {
  std::function<bool(std::uint32_t)> sees;
  if (states != nullptr)
    sees = [states](std::uint32_t cell) { return cell >= states->size() || (*states)[cell] != CellState::hidden; };
  const auto picked = finder().along(ray, sees);
  return picked ? std::optional(picked->place) : std::nullopt;
}

void Travel::lookAlong(const RayQuery& ray, bool whole, Seen seen) {
  const bool reads = whole || !store().isRemote();
  worker_->ask([this, ray, reads, states = states_, own = walk_, own_cell = walk_cell_,
                seen = std::move(seen)]() -> Worker::Done {
    std::optional<SeenNeurite> found;
    try {
      if (const auto place = pick(ray, states.get())) {
        const SegmentId segment = place->segment;
        found = SeenNeurite{.place = *place, .cell = store().cell(segment.cell).name, .sample = {}, .kind = {}};
        const IdRuns ids = store().loadCellDetail(segment.cell).sample_ids;
        if (segment.segment < ids.size()) found->sample = ids[segment.segment];
        std::shared_ptr<const CellWalk> walk = own_cell == segment.cell ? own : nullptr;
        if (walk == nullptr && reads && std::exchange(seen_cell_, segment.cell) != segment.cell)
          seen_walk_ = finder().walk(segment.cell, &leaving_);
        if (walk == nullptr && seen_cell_ == segment.cell) walk = seen_walk_;
        const auto spot = walk != nullptr ? walk->spotOf(*place) : std::nullopt;
        if (spot) found->kind = kindText(*walk, *spot), found->radius_um = radiusAt_um(*walk, *spot);
      }
    } catch (const std::exception& error) {
      seen_cell_ = UINT32_MAX;
      return [this, what = std::string(error.what()), seen] {
        messages_.sayOnce(what);
        seen(std::nullopt);
      };
    }
    return [seen, found] { seen(found); };
  });
}

void Travel::listTiles(std::function<void(std::vector<NearTile>)> listed) {
  if (std::exchange(listing_, true)) return;
  worker_->ask([this, p_W = now().p_W, listed = std::move(listed)]() -> Worker::Done {
    return [this, listed, tiles = census_.nearest(p_W)] {
      listing_ = false;
      listed(tiles);
    };
  });
}

namespace {

const char* whyNotFrom(Action action) {
  if (action == Action::next_branch || action == Action::next_sample) return "this is a tip: nothing follows";
  if (action == Action::previous_branch || action == Action::parent_sample)
    return "this is a root: nothing comes before";
  if (action == Action::other_branch) return "there is no other branch here";
  return action == Action::soma ? "this tree has no soma" : "no tip can be reached from here";
}

}  // namespace

void Travel::step(Action action) {
  const CellWalk* read = walk();
  if (read == nullptr)
    return messages_.say(now().place.valid() ? "the cell is still being read; try again" : "the hand is free (f)");
  const auto spot = read->spotOf(now().place);
  if (!spot) return;
  std::optional<std::uint32_t> to;
  if (action == Action::next_branch) to = read->nextBranch(*spot);
  if (action == Action::previous_branch) to = read->previousBranch(*spot);
  if (action == Action::next_sample) to = read->child(*spot);
  if (action == Action::parent_sample) to = read->parent(*spot);
  if (action == Action::other_branch) to = read->otherBranch(*spot);
  if (action == Action::soma) to = read->root(*spot);
  if (action == Action::nearest_tip) {
    const bool again = tips_at_ + 1 < tips_.size() && last_tip_ == now().place.p_W;
    if (!again) {
      tips_ = read->paths().tips(*spot, 64);
      tips_at_ = 0;
    } else {
      ++tips_at_;
    }
    if (!tips_.empty()) to = tips_[tips_at_];
    if (to) last_tip_ = read->graph().position_W(*to);
  }
  if (!to) return messages_.say(whyNotFrom(action));
  goWhenFound([this, read = walk_, cell = now().place.segment.cell, node = *to] {
    return finder().atSample(*read, cell, node);
  });
}

void Travel::toggleMeasure() {
  if (measure_.isOn()) return measure_.end();
  if (!now().place.valid()) return messages_.say("cannot measure: the hand is free (f)");
  measure_.begin(now().place);
}

void Travel::toggleSimulatedHand(bool same_type) {
  if (path_.isUnderWay()) {
    path_.end();
    return messages_.say("the simulated hand has stopped");
  }
  if (!sessions_.current().hasHand()) return messages_.say("the simulated hand needs --device mouse");
  const CellWalk* read = walk();
  const auto spot = read != nullptr ? read->spotOf(now().place) : std::nullopt;
  if (!spot) return messages_.say("the cell is still being read; try again");
  const auto tip = same_type ? farthestTipOfKind(*read, *spot) : read->paths().farthestTip(*spot);
  if (!tip) return messages_.say(same_type ? "no other tip of this kind can be reached" : "the cell has no other tip");
  std::vector<Vector3d> path_W;
  if (const auto path = read->paths().path(*spot, read->at(*tip)))
    for (const CellPath::Point& point : path->points) path_W.push_back(point.p_W);
  path_.begin(std::move(path_W));
  const std::vector<std::uint16_t>& types = read->graph().types;
  const std::string of = same_type && !types.empty() ? " of type " + neuriteTypeName(types[spot->child]) : "";
  messages_.say("a simulated hand travels to the farthest tip" + of + " (t or Esc stops it)");
}

// ---- the state

void Travel::describe(nlohmann::ordered_json& json) const {
  const NavigationSnapshot& s = now();
  const auto three = [](const Vector3d& v) { return nlohmann::ordered_json{v.x(), v.y(), v.z()}; };
  json["scene"] = opened_.scene.name;
  json["device"] = sessions_.current().deviceName();
  json["replaying"] = sessions_.current().replaying();
  json["replay_ended"] = sessions_.current().replayEnded();
  json["tick"] = s.tick;
  json["mode"] = toString(s.mode);
  json["cell"] = cell_name_;
  json["cell_id"] = s.place.segment.cell;
  json["segment"] = s.place.segment.segment;
  json["t"] = s.place.t;
  json["p_um"] = three(s.p_W);
  json["h_um"] = three(s.h_W);
  json["force_N"] = s.force_N.norm();
  json["zoom_um"] = s.zoom_um;
  json["centre_um"] = three(s.centre_W);
  json["rotation"] = {s.rotation_WD.w(), s.rotation_WD.x(), s.rotation_WD.y(), s.rotation_WD.z()};
  if (sample_) json["sample"] = *sample_;
  json["neurite"] = neurite_;
  json["jumps"] = jumps_;
  json["jumping"] = sessions_.current().awaited().has_value();
  json["waiting"] = s.frontier;
  json["frontiers"] = s.frontiers;
  json["interruptions"] = sessions_.current().interruptions();
  json["history"] = history().places().size();
  json["bookmarks"] = history().bookmarks();
  json["measuring"] = measure_.isOn();
  if (measure_.path_um()) json["measured_um"] = *measure_.path_um();
  json["touring"] = path_.isUnderWay();
  json["fork"] = junction_.has_value();
  if (const LoopMetrics* metrics = sessions_.current().metrics()) {
    json["missed_deadlines"] = metrics->missed_deadlines();
    json["compute_p99_us"] = 1e-3 * static_cast<double>(metrics->compute().percentile_ns(0.99));
  }
}

}  // namespace filiform::internal
