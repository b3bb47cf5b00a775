#include "viewer/application.h"

#include "device/haptic_device.h"
#include "index/errors.h"
#include "index/text.h"
#include "solver/saved_history.h"
#include "viewer/panels.h"
#include "viewer/place_finder.h"
#include "viewer/pointer.h"
#include "viewer/scene_view.h"
#include "viewer/window.h"
#include "viewer/worker.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <ctime>
#include <deque>
#include <fstream>
#include <future>
#include <set>

#include <nlohmann/json.hpp>

namespace filiform {

namespace {

constexpr double kDoubleClick_s = 0.4, kStillBeforeTooltip_s = 0.25, kFlight_s = 0.5, kMessage_s = 6;
constexpr double kPush_m = 0.006;       // of a held key, from the proxy
constexpr double kTourAhead_m = 0.004;  // of the simulated hand's aim, from the proxy
constexpr std::size_t kForcesKept = 4000, kVisitedKept = 400, kTilesShown = 3000;

// A scene that is open, and all that works on it. In the order in which they depend on one another.
struct Opened {
  OpenedScene scene;
  std::unique_ptr<PlaceFinder> finder;
  std::unique_ptr<SavedHistory> saved;
  ProxyPlace start;
  std::vector<std::string> warnings;
};

struct Running {
  Opened opened;
  std::unique_ptr<SceneView> picture;
  std::unique_ptr<Session> session;
  Worker worker;  // goes first
};

std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));
std::string format(const char* pattern, ...) {
  char text[256];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

class Application {
 public:
  explicit Application(const ApplicationOptions& options)
      : options_(options),
        settings_(loadSettings()),
        window_("filiform", options.size.value_or(PictureSize{settings_.width, settings_.height}),
                settings_.interface_scale),
        renderer_(window_.context()),
        budget_(SceneBudget::of(window_.context().description())) {
    if (options_.segments > 0) budget_.segments = budget_.moving_segments = options_.segments;
    if (!options_.paths.empty()) open(options_.paths);
  }

  void run() {
    while (window_.isOpen() && !quitting_) {
      options_.poll();
      const double begin_s = window_.now_s();
      if (options_.seconds && begin_s > *options_.seconds) break;
      for (const InputEvent& event : window_.poll(busy_ ? 0.001 : 0.015)) handle(event);
      finishOpening();
      if (running_) {
        frame();
      } else {
        blank();
      }
      window_.show();
      if (window_.now_s() - last_dump_s_ > 0.1) dumpState();
      frame_ms_ += 0.1 * (1000 * (window_.now_s() - begin_s) - frame_ms_);
      ++frames_;
    }
    end();
  }

 private:
  using Kind = NavigationCommand::Kind;

  Settings loadSettings() {
    std::string warning;
    Settings settings;
    try {
      settings_path_ = Settings::path();
      if (!options_.reset) settings = Settings::load(settings_path_, warning);
    } catch (const Error& error) {
      warning = error.what();
    }
    if (!warning.empty()) say(warning);
    return settings;
  }

  void say(const std::string& text) {
    messages_.emplace_back(now_s_, text);
    if (messages_.size() > 5) messages_.pop_front();
    last_message_ = text;
    ++said_;
  }

  // ---- scenes

  void open(const std::vector<std::string>& paths) {
    if (opening_.valid()) return say("one scene is being opened already");
    opening_name_.clear();
    for (const std::string& path : paths) {
      if (!opening_name_.empty()) opening_name_ += ", ";
      opening_name_ += escaped(path, 80);
    }
    opening_since_s_ = window_.now_s();
    opening_ = std::async(std::launch::async, [paths, open = options_.open] {
      Opened opened;
      opened.scene = open(paths);
      const TileStore& store = *opened.scene.store;
      opened.finder = std::make_unique<PlaceFinder>(store);
      try {
        opened.saved = std::make_unique<SavedHistory>(store, SavedHistory::pathFor(paths.front()));
        if (!opened.saved->warning().empty()) opened.warnings.push_back(opened.saved->warning());
      } catch (const Error& error) {
        opened.warnings.emplace_back(error.what());
      }
      if (opened.saved && !opened.saved->history().places().empty())
        opened.start = opened.saved->history().places()[opened.saved->history().now()];
      if (!opened.start.valid()) {
        std::uint32_t largest = 0;
        for (std::uint32_t cell = 1; cell < store.cell_count(); ++cell)
          if (store.cell(cell).segments > store.cell(largest).segments) largest = cell;
        if (store.cell_count() > 0) opened.start = opened.finder->soma(largest);
      }
      return opened;
    });
  }

  void finishOpening() {
    if (!opening_.valid() || opening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    try {
      Opened opened = opening_.get();
      auto next = std::make_unique<Running>();
      next->opened = std::move(opened);
      closeScene();
      next->picture =
          std::make_unique<SceneView>(*next->opened.scene.store, next->opened.scene.levels.get(), renderer_);
      SessionOptions session = options_.session;
      session.in_memory = next->opened.scene.in_memory;
      if (session.in_memory) session.budget_bytes.reset();
      if (opened_once_) session.record.clear();  // a recording is of one scene
      next->session = std::make_unique<Session>(*next->opened.scene.store, session);
      running_ = std::move(next);
      device_ = session.device;
      begin();
    } catch (const std::exception& error) {
      if (!opened_once_) throw;  // the person is at the terminal still
      say(error.what());
    }
  }

  void begin() {
    Opened& opened = running_->opened;
    opened_once_ = true;
    for (const std::string& warning : opened.warnings) say(warning);
    window_.setTitle("filiform: " + opened.scene.name);
    visited_W_.clear();
    forces_.clear();
    walk_.reset();
    walk_cell_ = UINT32_MAX;
    measure_from_.reset();
    junction_.reset();
    junction_at_.reset();
    junction_asked_ = tooltip_asked_ = replay_told_ = fault_told_ = false;
    walk_asked_ = UINT32_MAX;
    workspace_.reset();
    tour_.clear();
    running_->session->start();
    if (opened.start.valid()) running_->session->jump(opened.start);
  }

  void closeScene() {
    if (!running_) return;
    savePlaces();
    try {
      running_->session->finish();
    } catch (const std::exception& error) {
      say(error.what());
    }
    running_.reset();
  }

  void savePlaces() {
    SavedHistory* saved = running_->opened.saved.get();
    const ProxyPlace& here = running_->session->now().place;
    if (saved == nullptr || running_->session->replaying()) return;
    try {
      if (saved->history().places().empty() && here.valid()) saved->history().jump({}, here);
      saved->save();
    } catch (const std::exception& error) {
      say(error.what());
    }
  }

  void end() {
    std::string failure;
    if (running_) {
      savePlaces();
      try {
        running_->session->finish();
      } catch (const std::exception& error) {
        failure = error.what();
      }
    }
    const PictureSize size = window_.size();
    settings_.width = static_cast<int>(size.width / window_.scale() * settings_.interface_scale);
    settings_.height = static_cast<int>(size.height / window_.scale() * settings_.interface_scale);
    try {
      if (!settings_path_.empty()) settings_.save(settings_path_);
    } catch (const std::exception& error) {
      failure = error.what();
    }
    ended_ = true;
    dumpState();
    running_.reset();
    if (!failure.empty()) throw DeviceError(failure);
  }

  // ---- input

  const NavigationSnapshot& now() const { return running_->session->now(); }
  const TileStore& store() const { return *running_->opened.scene.store; }
  NavigationHistory* history() {
    return running_->opened.saved ? &running_->opened.saved->history() : &unsaved_history_;
  }

  void handle(const InputEvent& event) {
    pointer_x_ = event.kind == InputEvent::Kind::scroll ? pointer_x_ : event.x;
    pointer_y_ = event.kind == InputEvent::Kind::scroll ? pointer_y_ : event.y;
    if (event.kind == InputEvent::Kind::drop) return open(event.paths);
    if (event.kind == InputEvent::Kind::key) return press(event.key);
    if (event.kind == InputEvent::Kind::key_up) {
      // A modifier may have been let go before.
      for (const Binding& binding : bindings())
        if (binding.first.code == event.key.code) held_.erase(binding.action);
      return;
    }
    if (!running_) return;
    switch (event.kind) {
      case InputEvent::Kind::button:
        return pressButton(event);
      case InputEvent::Kind::button_up:
        drag_ = Action::none;
        break;
      case InputEvent::Kind::move:
        moved(event);
        break;
      case InputEvent::Kind::scroll:
        if ((event.modifiers & Key::kControl) != 0)
          separate(0.1 * event.y);
        else
          zoom(std::pow(1 / kZoomNotch, event.y));
        break;
      default:
        break;
    }
    last_x_ = pointer_x_;
    last_y_ = pointer_y_;
  }

  void pressButton(const InputEvent& event) {
    const bool twice = event.button == 0 && event.time_s - pressed_s_ < kDoubleClick_s &&
                       std::hypot(event.x - pressed_x_, event.y - pressed_y_) < 6 * window_.scale();
    pressed_s_ = twice ? -1 : event.time_s;
    last_x_ = pressed_x_ = event.x;
    last_y_ = pressed_y_ = event.y;
    closer_m_ = 0;
    if (twice) return jumpToPixel(event.x, event.y);
    const ScreenPoint proxy = project(view_, now().p_W, size_);
    const bool on_proxy = proxy.depth_um > 0 && std::hypot(proxy.x - event.x, proxy.y - event.y) < 16 * window_.scale();
    drag_ = event.button == 0   ? on_proxy && !overview_ ? Action::pull : Action::rotate
            : event.button == 1 ? (event.modifiers & Key::kShift) != 0 ? Action::pull_depth : Action::pull
                                : Action::rotate;
    tour_.clear();
  }

  void moved(const InputEvent& event) {
    still_since_s_ = window_.now_s();
    tooltip_.clear();
    const double dx = event.x - last_x_, dy = event.y - last_y_;
    if (drag_ == Action::rotate) turn(turnOf(dx, dy, size_));
    if (drag_ == Action::pull_depth) closer_m_ += dy / size_.height * 0.12;
  }

  void press(const Key& key) {
    if (awaiting_letter_ != Action::none) {
      const Action what = std::exchange(awaiting_letter_, Action::none);
      if (running_ && key.code > ' ' && key.code < 0x7F && key.modifiers == 0)
        return bookmark(what, std::string(1, static_cast<char>(key.code)));
      return;
    }
    const Action action = actionOf(key);
    if (action != Action::none) act(action);
  }

  void act(Action action) {
    ++actions_;
    last_action_ = bindingOf(action).name;
    switch (action) {
      case Action::quit:
        quitting_ = true;
        return;
      case Action::help:
        panels_.help = !panels_.help;
        return;
      case Action::panel_settings:
        panels_.settings = !panels_.settings;
        return;
      case Action::panel_tiles:
        settings_.show_tiles = !settings_.show_tiles;
        return;
      case Action::panel_force:
        settings_.show_force = !settings_.show_force;
        return;
      case Action::panel_minimap:
        settings_.show_minimap = !settings_.show_minimap;
        return;
      case Action::fullscreen:
        window_.toggleFullscreen();
        return;
      case Action::close:
        closeTop();
        return;
      case Action::next_colouring:
        settings_.colouring = next(settings_.colouring, kColourings);
        return say(std::string("coloured by ") + toString(settings_.colouring));
      case Action::next_stereo:
        settings_.stereo = next(settings_.stereo, kStereoModes);
        return say(std::string("stereo: ") + toString(settings_.stereo));
      case Action::next_palette:
        settings_.orange_blue = !settings_.orange_blue;
        return say(settings_.orange_blue ? "fork: own branch orange, others blue"
                                         : "fork: own branch red, others green");
      case Action::more_separation:
        return separate(0.1);
      case Action::less_separation:
        return separate(-0.1);
      case Action::window_picture:
        window_picture_wanted_ = true;
        return;
      default:
        break;
    }
    if (running_) travel(action);
  }

  void travel(Action action) {
    NavigationCommand command;
    switch (action) {
      case Action::push_left:
      case Action::push_right:
      case Action::push_up:
      case Action::push_down:
      case Action::push_away:
      case Action::push_closer:
        held_.insert(action);
        tour_.clear();
        return;
      case Action::toggle_free:
        if (now().mode == NavigationMode::free) return constrain();
        command.kind = Kind::free;
        running_->session->send(command);
        return;
      case Action::centre:
        command.kind = Kind::centre;
        running_->session->send(command);
        return;
      case Action::zoom_in:
        return zoom(1 / kZoomNotch);
      case Action::zoom_out:
        return zoom(kZoomNotch);
      case Action::turn_left:
        return turn({0, -0.1});
      case Action::turn_right:
        return turn({0, 0.1});
      case Action::turn_up:
        return turn({-0.1, 0});
      case Action::turn_down:
        return turn({0.1, 0});
      case Action::overview:
        overview_ = !overview_;
        yaw_ = pitch_ = 0;
        overview_factor_ = 1;
        return;
      case Action::freeze:
        frozen_ = !frozen_;
        return;
      case Action::search:
        panels_.search = search_.focus = true;
        search_.text.clear();
        search_.error.clear();
        return findNames();
      case Action::set_bookmark:
      case Action::go_to_bookmark:
        awaiting_letter_ = action;
        return;
      case Action::back:
        if (const auto place = history()->back(now().place)) return go(*place, false);
        return say("nothing to go back to");
      case Action::forward:
        if (const auto place = history()->forward(now().place)) return go(*place, false);
        return say("nothing to go forward to");
      case Action::measure:
        return toggleMeasure();
      case Action::screenshot:
        return takePicture(1);
      case Action::screenshot_large:
        return takePicture(3);
      case Action::tour:
        return startTour();
      default:
        return step(action);
    }
  }

  template <class T, std::size_t N>
  static T next(T value, const T (&choices)[N]) {
    return choices[(static_cast<std::size_t>(value) + 1) % N];
  }

  void closeTop() {
    if (panels_.help)
      panels_.help = false;
    else if (panels_.search)
      panels_.search = false;
    else if (panels_.settings)
      panels_.settings = false;
    else
      tour_.clear();
  }

  void separate(double by) {
    settings_.separation = std::clamp(settings_.separation + by, 0.0, 2.0);
    say(format("separation of the eyes: %.1f", settings_.separation));
  }

  void zoom(double factor) {
    if (overview_) {
      overview_factor_ = std::clamp(overview_factor_ * factor, 1e-4, 4.0);
      return;
    }
    NavigationCommand command;
    command.kind = Kind::zoom;
    command.factor = factor;
    running_->session->send(command);
  }

  void turn(const Turn& turn) {
    if (overview_) {
      yaw_ -= turn.about_y_rad;
      pitch_ += turn.about_x_rad;
      return;
    }
    NavigationCommand command;
    command.kind = Kind::rotate;
    command.about_x_rad = turn.about_x_rad;
    command.about_y_rad = turn.about_y_rad;
    running_->session->send(command);
  }

  // ---- travelling

  void go(const ProxyPlace& place, bool remember) {
    if (!place.valid()) return;
    if (running_->session->replaying()) return say("a recording is being replayed: nobody else leads");
    if (remember) history()->jump(now().place, place);
    flight_begin_s_ = settings_.reduced_motion ? -1 : now_s_;
    flight_from_ = shown_;
    tour_.clear();
    overview_ = false;
    running_->session->jump(place);
    ++jumps_;
  }

  // Asks for a place, and goes there when it is found.
  void goWhenFound(std::function<ProxyPlace()> find) {
    running_->worker.ask([this, find = std::move(find)]() -> Worker::Done {
      try {
        const ProxyPlace place = find();
        return [this, place] {
          panels_.search = false;
          go(place, true);
        };
      } catch (const Error& error) {
        const std::string what = error.what();
        return [this, what] {
          search_.error = what;
          say(what);
        };
      }
    });
  }

  void jumpToPixel(double x, double y) {
    const RayQuery ray = pickRay(view_, x, y, size_, 6 * window_.scale());
    const PlaceFinder& finder = *running_->opened.finder;
    goWhenFound([ray, &finder] {
      const auto picked = finder.along(ray);
      if (!picked) throw UsageError("no thread under the pointer");
      return picked->place;
    });
  }

  void constrain() {
    const Vector3d p_W = now().p_W;
    const PlaceFinder& finder = *running_->opened.finder;
    running_->worker.ask([this, p_W, &finder]() -> Worker::Done {
      const auto found = finder.nearest(p_W);
      if (!found) return {};
      return [this, found] { running_->session->jump(found->place, false); };
    });
  }

  void bookmark(Action what, const std::string& name) {
    if (what == Action::set_bookmark) {
      if (!now().place.valid()) return say("no bookmark: the hand is free");
      history()->setBookmark(name, now().place);
      savePlaces();
      return say("bookmark " + name + " is here");
    }
    const auto place = history()->bookmark(name);
    if (!place) return say("there is no bookmark " + name);
    go(*place, true);
  }

  void findNames() {
    const std::string text = search_.text;
    running_->worker.ask([this, text, &scene = store()]() -> Worker::Done {
      std::vector<std::string> names;
      for (const std::uint32_t cell : findCells(scene, parseCellQuery(text).name, 12))
        names.push_back(scene.cell(cell).name);
      return [this, names, text] {
        if (text == search_.text) search_.names = names;
      };
    });
  }

  // A cell's threads, once they have been read.
  const CellWalk* walk() {
    const ProxyPlace& place = now().place;
    if (!place.valid()) return nullptr;
    if (walk_ && walk_cell_ == place.segment.cell) return walk_.get();
    if (walk_asked_ != place.segment.cell) {
      walk_asked_ = place.segment.cell;
      const std::uint32_t cell = place.segment.cell;
      const PlaceFinder& finder = *running_->opened.finder;
      running_->worker.ask([this, cell, &finder]() -> Worker::Done {
        auto read = finder.walk(cell);
        return [this, cell, read] {
          walk_ = read;
          walk_cell_ = cell;
          walk_asked_ = UINT32_MAX;
        };
      });
    }
    return nullptr;
  }

  void step(Action action) {
    const CellWalk* walk = this->walk();
    if (walk == nullptr)
      return say(now().place.valid() ? "the cell is still being read; try again" : "the hand is free (f)");
    const auto spot = walk->spotOf(now().place);
    if (!spot) return;
    std::optional<std::uint32_t> to;
    if (action == Action::next_branch) to = walk->nextBranch(*spot);
    if (action == Action::previous_branch) to = walk->previousBranch(*spot);
    if (action == Action::next_sample) to = walk->child(*spot);
    if (action == Action::parent_sample) to = walk->parent(*spot);
    if (action == Action::other_branch) to = walk->otherBranch(*spot);
    if (action == Action::soma) to = walk->root(*spot);
    if (action == Action::nearest_tip) {
      const bool again = tips_at_ + 1 < tips_.size() && last_tip_ == now().place.p_W;
      if (!again) {
        tips_ = walk->tips(*spot, 64);
        tips_at_ = 0;
      } else {
        ++tips_at_;
      }
      if (!tips_.empty()) to = tips_[tips_at_];
      if (to) last_tip_ = walk->graph().position_W(*to);
    }
    if (!to) return say("there is none from here");
    const std::uint32_t cell = now().place.segment.cell, node = *to;
    const PlaceFinder& finder = *running_->opened.finder;
    goWhenFound([read = walk_, cell, node, &finder] { return finder.atSample(*read, cell, node); });
  }

  void toggleMeasure() {
    measure_.clear();
    if (measure_from_) {
      measure_from_.reset();
      return;
    }
    if (!now().place.valid()) return say("nothing to measure from: the hand is free (f)");
    measure_from_ = now().place;
    measured_to_ = {};
  }

  void measure() {
    if (!measure_from_ || !now().place.valid()) return;
    const Vector3d straight = now().place.p_W - measure_from_->p_W;
    if (measured_to_ && measured_to_->p_W == now().place.p_W) return;
    const CellWalk* walk = this->walk();
    if (walk == nullptr) return;
    measured_to_ = now().place;
    measure_ = format("%.2f um straight", straight.norm());
    if (measure_from_->segment.cell != now().place.segment.cell) {
      measure_ += ", another cell";
      return;
    }
    const auto a = walk->spotOf(*measure_from_), b = walk->spotOf(now().place);
    const auto length_um = a && b ? walk->pathLength_um(*a, *b) : std::nullopt;
    measured_path_um_ = length_um;
    measure_ = length_um ? format("%.2f um along the path, ", *length_um) + measure_ : measure_ + ", no path";
  }

  void startTour() {
    if (!tour_.empty()) {
      tour_.clear();
      return say("the simulated hand lets go");
    }
    if (!running_->session->hasHand()) return say("this device has a hand of its own");
    const CellWalk* walk = this->walk();
    const auto spot = walk != nullptr ? walk->spotOf(now().place) : std::nullopt;
    if (!spot) return say("the cell is still being read; try again");
    const auto tip = walk->farthestTip(*spot);
    if (!tip) return say("there is no other tip");
    tour_.push_back(now().place.p_W);
    for (const std::uint32_t node : walk->path(*spot, walk->at(*tip))) tour_.push_back(walk->graph().position_W(node));
    tour_.push_back(walk->graph().position_W(*tip));
    tour_at_ = 0;
    say("a simulated hand travels to the farthest tip (t or Esc ends it)");
  }

  // Where the simulated hand aims: that far along the way from the point of it that is nearest to the proxy.
  Vector3d tourAim_W(double ahead_um) {
    const Vector3d p_W = now().p_W;
    double best = INFINITY, along = 0;
    std::size_t at = tour_at_;
    double passed_um = 0;
    for (std::size_t i = tour_at_; i + 1 < tour_.size() && passed_um < 4 * ahead_um; ++i) {
      const Vector3d d = tour_[i + 1] - tour_[i];
      const double t = d.squaredNorm() > 0 ? std::clamp((p_W - tour_[i]).dot(d) / d.squaredNorm(), 0.0, 1.0) : 0.0;
      const double distance = (tour_[i] + t * d - p_W).norm();
      if (distance < best) {
        best = distance;
        at = i;
        along = t;
      }
      passed_um += d.norm();
    }
    tour_at_ = at;
    Vector3d aim = tour_[at] + along * (tour_[at + 1] - tour_[at]);
    double left_um = ahead_um;
    for (std::size_t i = at; i + 1 < tour_.size() && left_um > 0; ++i) {
      const Vector3d step = tour_[i + 1] - aim;
      const double length_um = step.norm();
      if (length_um >= left_um) return aim + step * (left_um / length_um);
      left_um -= length_um;
      aim = tour_[i + 1];
    }
    if ((p_W - tour_.back()).norm() < 0.1 * ahead_um) {
      tour_.clear();
      say("the tip is reached");
    }
    return aim;
  }

  void lead() {
    Session& session = *running_->session;
    if (!session.hasHand()) return;
    if (drag_ == Action::pull || drag_ == Action::pull_depth) {
      const double y = drag_ == Action::pull_depth ? pressed_y_ : pointer_y_;
      const double x = drag_ == Action::pull_depth ? pressed_x_ : pointer_x_;
      session.point(Pointing::at(pointedAt_D(view_, x, y, size_, *workspace_, now().p_W, closer_m_)));
      return;
    }
    Vector3d push = Vector3d::Zero();
    const auto held = [&](Action a) { return held_.count(a) > 0 ? 1.0 : 0.0; };
    push.x() = held(Action::push_right) - held(Action::push_left);
    push.y() = held(Action::push_up) - held(Action::push_down);
    push.z() = held(Action::push_closer) - held(Action::push_away);
    if (!push.isZero()) return session.point(Pointing::push(kPush_m * push.normalized()));
    if (!tour_.empty()) {
      const Vector3d aim_W = tourAim_W(kTourAhead_m * workspace_->scale_um_m());
      if (!tour_.empty()) return session.point(Pointing::at(workspace_->toDevice(aim_W)));
    }
    session.point({});
  }

  // ---- frames

  void watchSession() {
    Session& session = *running_->session;
    const NavigationSnapshot& s = session.update();
    if (s.asked_constrain != asked_constrain_) constrain();
    if (s.asked_back != asked_back_) act(Action::back);
    if (s.asked_forward != asked_forward_) act(Action::forward);
    asked_constrain_ = s.asked_constrain;
    asked_back_ = s.asked_back;
    asked_forward_ = s.asked_forward;
    for (const std::string& note : session.takeNotes()) say(note);
    session.takeForces(new_forces_);
    forces_.insert(forces_.end(), new_forces_.begin(), new_forces_.end());
    if (forces_.size() > kForcesKept) forces_.erase(forces_.begin(), forces_.end() - kForcesKept);
    if (session.replaying() && session.replayEnded() && !replay_told_) {
      replay_told_ = true;
      say("the recording is over");
    }
    const std::string fault = session.fault();
    if (!fault.empty()) replaceDevice(fault);
    if (s.tick > 0 && (visited_W_.empty() || (visited_W_.back() - s.p_W).norm() > 0.2 * s.zoom_um)) {
      visited_W_.push_back(s.p_W);
      if (visited_W_.size() > kVisitedKept) visited_W_.erase(visited_W_.begin());
    }
  }

  // A device that is lost: the mouse takes over where it was.
  void replaceDevice(const std::string& fault) {
    const NavigationSnapshot last = now();
    say(fault);
    if (device_ == "mouse" || running_->session->replaying()) {
      if (fault_told_) return;
      fault_told_ = true;
      return;
    }
    SessionOptions session = options_.session;
    session.device = "mouse";
    session.record.clear();
    session.zoom_um = last.zoom_um;
    session.in_memory = running_->opened.scene.in_memory;
    try {
      running_->session->finish();
    } catch (const std::exception& error) {
      say(error.what());
    }
    running_->session.reset();
    running_->session = std::make_unique<Session>(store(), session);
    device_ = "mouse";
    running_->session->start();
    running_->session->jump(last.place.valid() ? last.place : running_->opened.start);
    asked_constrain_ = asked_back_ = asked_forward_ = 0;
    say("the device is lost: the mouse takes over");
  }

  void lookForFork() {
    const NavigationSnapshot& s = now();
    if (!s.place.valid() || s.mode == NavigationMode::free) {
      junction_.reset();
      return;
    }
    if (junction_asked_ || !running_->worker.idle()) return;
    if (junction_at_ && junction_at_->segment == s.place.segment &&
        (junction_at_->p_W - s.place.p_W).norm() < 0.01 * s.zoom_um && junction_zoom_um_ == s.zoom_um)
      return;
    const Vector3d heading = junction_at_ ? Vector3d(s.place.p_W - junction_at_->p_W) : Vector3d(Vector3d::Zero());
    junction_at_ = s.place;
    junction_zoom_um_ = s.zoom_um;
    junction_asked_ = true;
    const PlaceFinder& finder = *running_->opened.finder;
    running_->worker.ask([this, place = s.place, zoom_um = s.zoom_um, heading, &finder]() -> Worker::Done {
      std::optional<Junction> found;
      try {
        found = finder.junction(place, heading, zoom_um / 2, zoom_um / 10);
      } catch (const Error&) {  // the session says so where the hand gets there
      }
      return [this, found = std::move(found)] {
        junction_ = found;
        junction_asked_ = false;
      };
    });
  }

  void lookUnderPointer() {
    if (drag_ != Action::none || window_.pointerOnPanel() || tooltip_asked_ || !tooltip_.empty() ||
        now_s_ - still_since_s_ < kStillBeforeTooltip_s || still_since_s_ == tooltip_for_s_ || !running_->worker.idle())
      return;
    tooltip_for_s_ = still_since_s_;
    tooltip_asked_ = true;
    const RayQuery ray = pickRay(view_, pointer_x_, pointer_y_, size_, 5 * window_.scale());
    const PlaceFinder& finder = *running_->opened.finder;
    running_->worker.ask([this, ray, &finder, &scene = store(), asked = tooltip_for_s_]() -> Worker::Done {
      std::string text;
      try {
        if (const auto picked = finder.along(ray)) {
          const SegmentId segment = picked->place.segment;
          text = escaped(scene.cell(segment.cell).name, 60);
          const CellDetail detail = scene.loadCellDetail(segment.cell);
          if (segment.segment < detail.sample_ids.size())
            text += ":" + std::to_string(detail.sample_ids[segment.segment]);
          const Vector3d& p = picked->place.p_W;
          text += format("\n%.2f %.2f %.2f um", p.x(), p.y(), p.z());
        }
      } catch (const Error& error) {
        text = error.what();
      }
      return [this, text, asked] {
        tooltip_asked_ = false;
        if (still_since_s_ == asked) tooltip_ = text;
      };
    });
  }

  void nameCell() {
    const ProxyPlace& place = now().place;
    if (!place.valid()) {
      cell_name_.clear();
      sample_.reset();
      return;
    }
    const CellWalk* walk = this->walk();
    if (walk == nullptr) return;
    cell_name_ = walk->graph().name;
    const auto spot = walk->spotOf(place);
    if (!spot) return;
    sample_ = walk->graph().sample_ids[spot->t > 0.5 ? spot->parent : spot->child];
  }

  Camera camera() {
    // Between two places the world glides: the eye sees where it is taken.
    const NavigationSnapshot& s = now();
    Shown target{s.centre_W, s.rotation_WD, s.zoom_um};
    const double t = (now_s_ - flight_begin_s_) / kFlight_s;
    if (flight_begin_s_ >= 0 && t < 1) {
      const double e = t * t * (3 - 2 * t);
      shown_.centre_W = flight_from_.centre_W + e * (target.centre_W - flight_from_.centre_W);
      shown_.rotation_WD = flight_from_.rotation_WD.slerp(e, target.rotation_WD);
      shown_.zoom_um = flight_from_.zoom_um * std::pow(target.zoom_um / flight_from_.zoom_um, e);
    } else {
      shown_ = target;
      flight_begin_s_ = -1;
    }
    workspace_->lay(target.centre_W, target.rotation_WD, target.zoom_um);
    if (overview_) {
      const SceneView& picture = *running_->picture;
      Camera everything = overview(picture.lo_W(), picture.hi_W(), yaw_, pitch_, size_.aspect());
      everything = orbit(everything, 0, 0, overview_factor_);
      return fitDepth(everything, picture.lo_W(), picture.hi_W());
    }
    Workspace seen = *workspace_;
    seen.lay(shown_.centre_W, shown_.rotation_WD, shown_.zoom_um);
    return follow(seen, size_.aspect());
  }

  void frame() {
    now_s_ = window_.now_s();
    running_->worker.serve([this](const std::string& what) {
      junction_asked_ = tooltip_asked_ = false;
      walk_asked_ = UINT32_MAX;
      say(what);
    });
    watchSession();
    size_ = window_.size();
    if (!workspace_) workspace_.emplace(running_->session->workspaceOptions());
    camera_ = camera();
    view_ = viewOf(camera_, size_.aspect(), 1);
    lead();
    lookForFork();
    nameCell();
    measure();
    lookUnderPointer();

    SceneFrame frame;
    frame.camera = camera_;
    if (!overview_) frame.workspace = &*workspace_;
    if (now().tick > 0) frame.proxy_W = now().p_W;
    if (junction_ && !overview_) frame.junction = &*junction_;
    frame.palette = settings_.orange_blue ? kOrangeBlue : kRedGreen;
    frame.colour = settings_.colouring;
    frame.time_s = now_s_;
    frame.size = size_;
    frame.stereo = settings_.stereo;
    frame.eyes.gain = settings_.separation;
    frame.eyes.widening = settings_.widening;
    frame.budget = budget_;
    frame.frozen = frozen_;
    frame.mark_scale = window_.scale();
    try {
      if (picture_wanted_ > 0) writePicture(frame);
      figures_ = running_->picture->draw(frame);
    } catch (const GraphicsError& error) {
      if (last_message_ != error.what()) say(error.what());
    }
    for (const std::string& failure : figures_.failed)
      if (failures_told_.insert(failure).second) say(failure);
    busy_ = figures_.redrawn || figures_.pending > 0 || drag_ != Action::none || flight_begin_s_ >= 0;
    renderer_.present(size_);
    if (now_s_ - tiles_counted_s_ > 0.25) countTiles();
    window_.beginPanels();
    const PanelRequests requests = drawPanels(panelData(), tiles_, panels_, search_, settings_);
    window_.endPanels();
    if (window_picture_wanted_) {
      window_picture_wanted_ = false;
      write(window_.read());
    }
    serve(requests);
  }

  void blank() {
    now_s_ = window_.now_s();
    size_ = window_.size();
    busy_ = false;
    renderer_.draw({EyeView{}, EyeView{}}, {.size = size_, .samples = 1});
    renderer_.present(size_);
    window_.beginPanels();
    const bool opening = opening_.valid();
    drawOpening(size_, window_.scale(), opening ? "opening " + opening_name_ : "drop a tile set or an .swc file here",
                opening ? now_s_ - opening_since_s_ : -1);
    window_.endPanels();
  }

  PanelData panelData() {
    const NavigationSnapshot& s = now();
    PanelData d;
    d.size = size_;
    d.scale = window_.scale();
    d.um_px = camera_.focus_um / pixelsPerRadian(view_.frustum, size_);
    d.scene = running_->opened.scene.name;
    d.cell = cell_name_;
    if (sample_) d.place = "sample " + std::to_string(*sample_) + ", ";
    d.place += format("%.1f %.1f %.1f um", s.p_W.x(), s.p_W.y(), s.p_W.z());
    d.device = running_->session->deviceName();
    d.mode = toString(s.mode);
    if (running_->session->awaited()) d.mode += ", jumping";
    if (s.frontier) d.mode += ", waiting for a tile";
    d.zoom_um = s.zoom_um;
    d.force_N = s.force_N.norm();
    d.measure = measure_from_ && measure_.empty() ? "from here" : measure_;
    if (settings_.stereo != StereoMode::mono)
      d.stereo = std::string(toString(settings_.stereo)) + format(", separation %.1f", settings_.separation);
    d.segments = figures_.segments;
    d.left_out = figures_.left_out;
    d.pending = figures_.pending;
    d.error_px = figures_.error_px;
    d.complete = figures_.complete;
    d.frozen = frozen_;
    d.overview = overview_;
    d.forces_N = &forces_;
    if (!overview_ && s.mode == NavigationMode::constrained && flight_begin_s_ < 0) {
      d.proxy = project(view_, s.p_W, size_);
      d.hand = project(view_, s.h_W, size_);
    }
    d.lo_W = running_->picture->lo_W();
    d.hi_W = running_->picture->hi_W();
    d.proxy_W = s.p_W;
    d.centre_W = s.centre_W;
    d.visited_W = visited_W_;
    for (const std::string& name : history()->bookmarks()) {
      d.bookmark_names.push_back(name);
      d.bookmarks_W.push_back(history()->bookmark(name)->p_W);
    }
    for (const auto& [since_s, text] : messages_)
      if (now_s_ - since_s < kMessage_s) d.messages.push_back(text);
    if (awaiting_letter_ != Action::none)
      d.hint = awaiting_letter_ == Action::set_bookmark ? "bookmark: type a letter" : "go to bookmark: type its letter";
    else if (opening_.valid())
      d.hint = "opening " + opening_name_;
    else
      d.hint = "h: keys and mouse";
    d.tooltip = tooltip_;
    d.tooltip_x = pointer_x_;
    d.tooltip_y = pointer_y_;
    return d;
  }

  void countTiles() {
    const Residency* residency = running_->session->residency();
    const double since_s = std::max(now_s_ - tiles_counted_s_, 1e-3);
    tiles_counted_s_ = now_s_;
    TilePanel t;
    t.tiles = store().tile_count();
    t.in_memory = residency == nullptr;
    t.frontiers = now().frontiers;
    if (residency != nullptr) {
      t.counters = residency->counters();
      t.budget_bytes = residency->budget_bytes();
      t.failures = residency->failures();
      for (const std::string& failure : t.failures)
        if (failures_told_.insert(failure).second) say(failure);
      t.reads_s = static_cast<double>(t.counters.reads - tiles_.counters.reads) / since_s;
      t.read_bytes_s =
          static_cast<double>(t.counters.bytes_read_decoded - tiles_.counters.bytes_read_decoded) / since_s;
    }
    if (settings_.show_tiles) listTiles(residency, t);
    tiles_ = std::move(t);
  }

  void listTiles(const Residency* residency, TilePanel& t) {
    const Grid grid = store().grid();
    const Vector3d p_W = now().p_W;
    std::vector<std::pair<double, TileId>> nearest;
    for (TileId tile = 0; tile < store().tile_count(); ++tile) {
      const GridBox& box = store().entry(tile).content;
      if (residency != nullptr) ++t.counts[static_cast<int>(residency->state(tile))];
      if (box.empty() || tile == store().long_tile()) continue;
      const Vector3d lo = grid.toWorld(box.lo), hi = grid.toWorld(box.hi);
      nearest.emplace_back((lo - p_W).cwiseMax(p_W - hi).cwiseMax(0.0).squaredNorm(), tile);
    }
    const std::size_t kept = std::min(kTilesShown, nearest.size());
    std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(kept), nearest.end());
    for (std::size_t i = 0; i < kept; ++i) {
      const TileId tile = nearest[i].second;
      const GridBox& box = store().entry(tile).content;
      const Vector3d lo = grid.toWorld(box.lo), hi = grid.toWorld(box.hi);
      t.boxes.push_back(
          {lo.x(), lo.y(), hi.x(), hi.y(), residency != nullptr ? residency->state(tile) : TileState::resident});
    }
    // Those that are there are drawn over those that are not.
    std::stable_sort(t.boxes.begin(), t.boxes.end(), [](const TilePanel::Box& a, const TilePanel::Box& b) {
      return (a.state != TileState::absent) < (b.state != TileState::absent);
    });
  }

  void serve(const PanelRequests& requests) {
    if (requests.search_changed) findNames();
    if (requests.reset) {
      const int width = settings_.width, height = settings_.height;
      settings_ = {};
      settings_.width = width;
      settings_.height = height;
    }
    const PlaceFinder& finder = *running_->opened.finder;
    if (requests.go) {
      search_.error.clear();
      const CellQuery query = parseCellQuery(*requests.go);
      goWhenFound([query, &finder] { return finder.find(query); });
    }
    if (requests.go_to_W) {
      const Vector3d p_W = *requests.go_to_W;
      goWhenFound([p_W, &finder] {
        const auto found = finder.nearest(p_W);
        if (!found) throw UsageError("the scene has no segment");
        return found->place;
      });
    }
  }

  // ---- pictures and the state

  void takePicture(int times) { picture_wanted_ = times; }

  void writePicture(SceneFrame frame) {
    const int most = Renderer::kMaxSize / std::max(size_.width, size_.height);
    const int times = std::clamp(std::exchange(picture_wanted_, 0), 1, std::max(most, 1));
    frame.size = {size_.width * times, size_.height * times};
    frame.mark_scale *= times;
    try {
      running_->picture->drawWhole(frame);
      write(renderer_.read());
    } catch (const std::exception& error) {
      say(error.what());
    }
  }

  void write(const Picture& picture) {
    const std::time_t now = std::time(nullptr);
    std::tm local{};
    localtime_r(&now, &local);
    char stamp[32];
    std::strftime(stamp, sizeof stamp, "%Y%m%d-%H%M%S", &local);
    const std::string path = options_.pictures + "/filiform-" + stamp + "-" + std::to_string(++pictures_) + ".png";
    try {
      options_.write(picture, path);
      last_picture_ = path;
      say(format("%d x %d pixels: ", picture.width, picture.height) + escaped(path));
    } catch (const std::exception& error) {
      say(error.what());
    }
  }

  void dumpState() {
    last_dump_s_ = window_.now_s();
    if (options_.state.empty()) return;
    nlohmann::ordered_json json{{"frames", frames_},
                                {"frame_ms", frame_ms_},
                                {"ended", ended_},
                                {"open", running_ != nullptr},
                                {"width", size_.width},
                                {"height", size_.height},
                                {"renderer", window_.context().description()},
                                {"colour_by", toString(settings_.colouring)},
                                {"stereo", toString(settings_.stereo)},
                                {"separation", settings_.separation},
                                {"orange_blue", settings_.orange_blue},
                                {"reduced_motion", settings_.reduced_motion},
                                {"help", panels_.help},
                                {"search", panels_.search},
                                {"tiles_panel", settings_.show_tiles},
                                {"overview", overview_},
                                {"frozen", frozen_},
                                {"actions", actions_},
                                {"last_action", last_action_},
                                {"message", last_message_},
                                {"messages", said_},
                                {"last_picture", last_picture_},
                                {"pictures", pictures_},
                                {"jumps", jumps_}};
    if (running_) {
      const NavigationSnapshot& s = now();
      const auto three = [](const Vector3d& v) { return nlohmann::ordered_json{v.x(), v.y(), v.z()}; };
      json["scene"] = running_->opened.scene.name;
      json["device"] = running_->session->deviceName();
      json["replaying"] = running_->session->replaying();
      json["replay_ended"] = running_->session->replayEnded();
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
      const ScreenPoint proxy = project(view_, s.p_W, size_);
      if (proxy.depth_um > 0) json["proxy_px"] = {proxy.x, proxy.y};
      json["jumping"] = running_->session->awaited().has_value();
      json["waiting"] = s.frontier;
      json["frontiers"] = s.frontiers;
      json["interruptions"] = running_->session->interruptions();
      json["history"] = history()->places().size();
      json["bookmarks"] = history()->bookmarks();
      json["measuring"] = measure_from_.has_value();
      if (measure_from_ && measured_path_um_) json["measured_um"] = *measured_path_um_;
      json["tooltip"] = tooltip_;
      json["touring"] = !tour_.empty();
      json["fork"] = junction_.has_value();
      json["segments"] = figures_.segments;
      json["left_out"] = figures_.left_out;
      json["pending"] = figures_.pending;
      json["complete"] = figures_.complete;
      json["error_px"] = figures_.error_px;
      json["resident_bytes"] = tiles_.counters.bytes;
      json["failures"] = figures_.failed.size() + tiles_.failures.size();
      if (const LoopMetrics* metrics = running_->session->metrics()) {
        json["missed_deadlines"] = metrics->missed_deadlines();
        json["compute_p99_us"] = 1e-3 * static_cast<double>(metrics->compute().percentile_ns(0.99));
      }
    }
    const std::string partial = options_.state + ".partial";
    std::ofstream out(partial, std::ios::binary);
    out << json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
    out.close();
    if (out) std::rename(partial.c_str(), options_.state.c_str());
  }

  struct Shown {
    Vector3d centre_W = Vector3d::Zero();
    Eigen::Quaterniond rotation_WD = Eigen::Quaterniond::Identity();
    double zoom_um = 300;
  };

  const ApplicationOptions& options_;
  // Before what says something while it is made.
  double now_s_ = 0;
  std::deque<std::pair<double, std::string>> messages_;
  std::string last_message_;
  std::uint64_t said_ = 0;
  std::string settings_path_;
  Settings settings_;
  Window window_;
  Renderer renderer_;
  SceneBudget budget_;

  std::future<Opened> opening_;
  std::string opening_name_, device_;
  double opening_since_s_ = 0;
  bool opened_once_ = false, quitting_ = false, ended_ = false, busy_ = false;
  NavigationHistory unsaved_history_;

  std::set<Action> held_;
  Action drag_ = Action::none, awaiting_letter_ = Action::none;
  double pointer_x_ = 0, pointer_y_ = 0, last_x_ = 0, last_y_ = 0;
  double pressed_x_ = 0, pressed_y_ = 0, pressed_s_ = -1, closer_m_ = 0, still_since_s_ = 0;

  PictureSize size_;
  Camera camera_;
  EyeView view_;
  std::optional<Workspace> workspace_;
  Shown shown_, flight_from_;
  double flight_begin_s_ = -1;
  bool overview_ = false, frozen_ = false;
  double yaw_ = 0, pitch_ = 0, overview_factor_ = 1;
  SceneFigures figures_;

  std::shared_ptr<const CellWalk> walk_;
  std::uint32_t walk_cell_ = UINT32_MAX, walk_asked_ = UINT32_MAX;
  std::string cell_name_;
  std::optional<std::int64_t> sample_;
  std::vector<std::uint32_t> tips_;
  std::size_t tips_at_ = 0;
  Vector3d last_tip_ = Vector3d::Constant(NAN);
  std::optional<ProxyPlace> measure_from_, measured_to_;
  std::optional<double> measured_path_um_;
  std::string measure_;
  std::vector<Vector3d> tour_;
  std::size_t tour_at_ = 0;
  std::optional<Junction> junction_;
  std::optional<ProxyPlace> junction_at_;
  double junction_zoom_um_ = 0;
  bool junction_asked_ = false, tooltip_asked_ = false, replay_told_ = false, fault_told_ = false;
  std::string tooltip_;
  double tooltip_for_s_ = -1;
  std::uint32_t asked_constrain_ = 0, asked_back_ = 0, asked_forward_ = 0;
  std::vector<float> forces_, new_forces_;
  std::vector<Vector3d> visited_W_;
  std::set<std::string> failures_told_;

  OpenPanels panels_;
  SearchPanel search_;
  TilePanel tiles_;
  double tiles_counted_s_ = -1, last_dump_s_ = -1, frame_ms_ = 0;
  int picture_wanted_ = 0, pictures_ = 0;
  bool window_picture_wanted_ = false;
  std::uint64_t frames_ = 0, actions_ = 0, jumps_ = 0;
  std::string last_action_, last_picture_;
  std::unique_ptr<Running> running_;  // goes first
};

}  // namespace

void runApplication(const ApplicationOptions& options) { Application(options).run(); }

}  // namespace filiform
