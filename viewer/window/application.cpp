#include "viewer/window/application.h"

#include "device/haptic_device.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "solver/travel/worker.h"
#include "viewer/gl/internal/large_picture.h"
#include "viewer/gl/scene_view.h"
#include "viewer/scene/pointer.h"
#include "viewer/window/internal/closing.h"
#include "viewer/window/internal/messages.h"
#include "viewer/window/internal/opening.h"
#include "viewer/window/internal/text_format.h"
#include "viewer/window/internal/tile_census.h"
#include "viewer/window/internal/travel.h"
#include "viewer/window/internal/viewpoint.h"
#include "viewer/window/panels.h"
#include "viewer/window/window.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <set>
#include <thread>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform {

namespace {

using internal::Closing;
using internal::format;
using internal::LargePicture;
using internal::Messages;
using internal::Opened;
using internal::Opening;
using internal::Travel;
using internal::Viewpoint;

constexpr double kDoubleClick_s = 0.4, kStillBeforeTooltip_s = 0.25;
constexpr double kPush_m = 0.006;  // of a held key, from the proxy
// Of a frame, for a picture that takes many: the window stays at 30 frames a second and more.
constexpr double kPicture_ms = 15;

template <class T, std::size_t N>
T next(T value, const T (&choices)[N]) {
  return choices[(static_cast<std::size_t>(value) + 1) % N];
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
    try {
      while (window_.isOpen() && !quitting_) {
        options_.poll();
        const double begin_s = window_.now_s();
        if (options_.seconds && begin_s > *options_.seconds) break;
        messages_.setTime(begin_s);
        for (const InputEvent& event : window_.poll(busy_ ? 0.001 : 0.015)) handle(event);
        finishOpening();
        for (const std::string& failure : closing_.takeFailures()) say(failure);
        writer_.serve([this](const std::string& failure) { say(failure); });
        if (travel_) {
          frame();
        } else {
          blank();
        }
        window_.show();
        if (window_.now_s() - last_dump_s_ > 0.1) dumpState();
        frame_ms_ += 0.1 * (1000 * (window_.now_s() - begin_s) - frame_ms_);
        ++frames_;
      }
    } catch (...) {
      options_.ending();
      throw;
    }
    window_.hide();
    options_.ending();
    end();
  }

 private:
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

  void say(const std::string& text) { messages_.say(text); }

  // ---- scenes

  void open(const std::vector<std::string>& paths) {
    if (opening_.isUnderWay()) return say("one scene is being opened already");
    opening_.begin(paths, options_.open, renderer_, window_.now_s());
  }

  void finishOpening() {
    try {
      if (opening_.isSceneReady()) {
        opening_.takeScene();
        closeScene();
      }
      // Only one session can have a device: the one before lets go of it first.
      const bool is_free = options_.session.device == "mouse" || !closing_.isUnderWay();
      if (opening_.awaitsDevice() && is_free) {
        SessionOptions session = options_.session;
        if (opened_once_) session.record.clear();  // a recording is of one scene
        opening_.openDevice(session);
      }
      if (opening_.isReady()) enter(opening_.take());
    } catch (const std::exception& error) {
      if (!opened_once_) throw;  // the person is at the terminal still
      say(error.what());
    }
  }

  void enter(Opened opened) {
    picture_ = std::move(opened.picture);
    const Travel::Callbacks callbacks{[this] { leave(); }, [this](const std::string& why) { search_.error = why; },
                                      options_.plugged_in};
    travel_ = std::make_unique<Travel>(std::move(opened), messages_, callbacks);
    viewpoint_.emplace(travel_->session().workspaceOptions());
    figures_ = {};
    tiles_ = {};
    near_.clear();
    levels_missed_ = false;
    drag_ = Action::none;
    tooltip_asked_ = false;
    opened_once_ = true;
    window_.setTitle("filiform: " + travel_->scene().name);
    travel_->start();
  }

  // Its end may wait for the disk or the device: beside the frames.
  void closeScene() {
    if (!travel_) return;
    endPicture();
    closing_.begin([loader = picture_->end(), travel = std::shared_ptr<Travel>(std::move(travel_))]() mutable {
      loader.reset();
      travel->finish();
    });
    picture_.reset();
  }

  void end() {
    std::string failure;
    endPicture();
    while (!writer_.idle()) {
      writer_.serve([&](const std::string& why) { failure = why; });
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    if (travel_) {
      try {
        travel_->finish();
      } catch (const std::exception& error) {
        failure = error.what();
      }
    }
    for (std::string& why : closing_.finish()) failure = std::move(why);
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
    if (!state_failure_.empty()) failure = state_failure_;
    if (!failure.empty()) throw DeviceError(failure);
  }

  // The proxy is taken elsewhere.
  void leave() {
    panels_.search = false;
    viewpoint_->depart(now_s_, settings_.reduced_motion);
  }

  // ---- input

  const NavigationSnapshot& now() const { return travel_->now(); }

  void handle(const InputEvent& event) {
    pointer_x_ = event.kind == InputEvent::Kind::scroll ? pointer_x_ : event.x;
    pointer_y_ = event.kind == InputEvent::Kind::scroll ? pointer_y_ : event.y;
    if (event.kind == InputEvent::Kind::drop) return open(event.paths);
    if (event.kind == InputEvent::Kind::key) return press(event.key, event.repeated);
    if (event.kind == InputEvent::Kind::key_up) {
      // A modifier may have been let go before.
      for (const Binding& binding : bindings())
        if (binding.first.code == event.key.code) held_.erase(binding.action);
      return;
    }
    if (!travel_) return;
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
    if (twice) return travel_->goAlong(pickRay(view_, event.x, event.y, size_, 6 * window_.scale()));
    drag_ = dragOf(event);
    travel_->endTour();
  }

  Action dragOf(const InputEvent& event) const {
    const bool shift = (event.modifiers & Key::kShift) != 0;
    if (event.button == 1) return shift ? Action::pull_depth : Action::pull;
    if (event.button == 2 || shift) return Action::pan;
    const ScreenPoint proxy = project(view_, now().p_W, size_);
    const bool on_proxy = proxy.depth_um > 0 && std::hypot(proxy.x - event.x, proxy.y - event.y) < 16 * window_.scale();
    return on_proxy && !viewpoint_->isOverview() ? Action::pull : Action::rotate;
  }

  void moved(const InputEvent& event) {
    still_since_s_ = window_.now_s();
    tooltip_.clear();
    const double dx = event.x - last_x_, dy = event.y - last_y_;
    if (drag_ == Action::rotate) turn(turnOf(dx, dy, size_));
    if (drag_ == Action::pan) viewpoint_->pan(dx, dy, size_);
    if (drag_ == Action::pull_depth) closer_m_ += dy / size_.height * 0.12;
  }

  void press(const Key& key, bool repeated) {
    key_repeats_ += repeated ? 1 : 0;
    if (awaiting_letter_ != Action::none) {
      if (repeated) return;  // of the key that asked for the letter
      const Action what = std::exchange(awaiting_letter_, Action::none);
      if (!travel_ || key.code <= ' ' || key.code >= 0x7F || key.modifiers != 0) return;
      const std::string name(1, static_cast<char>(key.code));
      if (what == Action::set_bookmark) return travel_->setBookmark(name);
      return travel_->goToBookmark(name);
    }
    const Action action = actionOf(key, repeated);
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
        return say(format("coloured by %s", toString(settings_.colouring)));
      case Action::next_stereo:
        return nextStereo();
      case Action::orthographic:
        settings_.orthographic = !settings_.orthographic;
        return say(settings_.orthographic ? "orthographic" : "in perspective");
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
    if (travel_) actInScene(action);
  }

  void actInScene(Action action) {
    switch (action) {
      case Action::push_left:
      case Action::push_right:
      case Action::push_up:
      case Action::push_down:
      case Action::push_away:
      case Action::push_closer:
        held_.insert(action);
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
        tooltip_.clear();
        return viewpoint_->toggleOverview();
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
      case Action::screenshot:
        picture_wanted_ = 1;
        return;
      case Action::screenshot_large:
        picture_wanted_ = 3;
        return;
      default:
        if (action == Action::centre) viewpoint_->centre();
        travel_->act(action);
    }
  }

  void nextStereo() {
    const bool all_seen = settings_.stereo == *std::rbegin(kStereoModes);
    if (all_seen && renderer_.hasQuadBuffer())
      settings_.stereo = StereoMode::quad_buffer;
    else if (settings_.stereo == StereoMode::quad_buffer)
      settings_.stereo = StereoMode::mono;
    else
      settings_.stereo = next(settings_.stereo, kStereoModes);
    say(format(all_seen && settings_.stereo == StereoMode::mono ? "stereo: %s (this display has no quad-buffer)"
                                                                : "stereo: %s",
               toString(settings_.stereo)));
  }

  void closeTop() {
    if (panels_.help)
      panels_.help = false;
    else if (panels_.search)
      panels_.search = false;
    else if (panels_.settings)
      panels_.settings = false;
    else if (large_)
      cancelPicture();
    else if (travel_)
      travel_->endTour();
  }

  void separate(double by) {
    settings_.separation = std::clamp(settings_.separation + by, 0.0, 2.0);
    say(format("separation of the eyes: %.1f", settings_.separation));
  }

  void zoom(double factor) {
    tooltip_.clear();
    if (viewpoint_->isOverview())
      viewpoint_->zoom(factor);
    else
      travel_->zoom(factor);
  }

  void turn(const Turn& turn) {
    if (viewpoint_->isOverview())
      viewpoint_->turn(turn);
    else
      travel_->turn(turn);
  }

  void findNames() {
    travel_->findNames(search_.text, [this, text = search_.text](std::vector<std::string> names) {
      if (text == search_.text) search_.names = std::move(names);
    });
  }

  // What the pointer or held keys ask of the hand.
  std::optional<Pointing> pointing() const {
    if (drag_ == Action::pull)
      return Pointing::at(
          pointedAt_D(view_, pointer_x_, pointer_y_, size_, viewpoint_->workspace(), now().p_W, closer_m_));
    if (drag_ == Action::pull_depth)
      return Pointing::at(
          pointedAt_D(view_, pressed_x_, pressed_y_, size_, viewpoint_->workspace(), now().p_W, closer_m_));
    const auto held = [&](Action a) { return held_.count(a) > 0 ? 1.0 : 0.0; };
    const Vector3d push(held(Action::push_right) - held(Action::push_left),
                        held(Action::push_up) - held(Action::push_down),
                        held(Action::push_closer) - held(Action::push_away));
    if (push.isZero()) return std::nullopt;
    return Pointing::push(kPush_m * push.normalized());
  }

  void lookUnderPointer() {
    if (panels_.help || panels_.search || panels_.settings || drag_ != Action::none || window_.pointerOnPanel()) {
      tooltip_.clear();
      return;
    }
    if (tooltip_asked_ || !tooltip_.empty() || now_s_ - still_since_s_ < kStillBeforeTooltip_s ||
        still_since_s_ == tooltip_for_s_ || !travel_->isIdle())
      return;
    tooltip_for_s_ = still_since_s_;
    tooltip_asked_ = true;
    const RayQuery ray = pickRay(view_, pointer_x_, pointer_y_, size_, 5 * window_.scale());
    travel_->describeAlong(ray, [this, asked = tooltip_for_s_](std::string text) {
      tooltip_asked_ = false;
      if (still_since_s_ == asked) tooltip_ = std::move(text);
    });
  }

  // ---- frames

  void frame() {
    now_s_ = window_.now_s();
    size_ = window_.size();
    try {
      travel_->serve();
      camera_ = viewpoint_->look(now(), picture_->lo_W(), picture_->hi_W(), size_.aspect(), now_s_);
      if (settings_.orthographic) camera_ = parallel(camera_);
      view_ = viewOf(camera_, size_.aspect(), 1);
      travel_->lead(pointing(), viewpoint_->workspace());
      travel_->observe();
      lookUnderPointer();
      if (now_s_ - tiles_counted_s_ > 0.25) countTiles();
      drawScene();
    } catch (const Error& error) {  // of the source, or the graphics: what can go on does
      messages_.sayOnce(error.what());
    }
    for (const std::string& failure : figures_.failed) sayFailure(failure);
    busy_ = large_ || figures_.redrawn || figures_.pending > 0 || drag_ != Action::none || viewpoint_->isGliding();
    renderer_.present(size_);
    const PanelData data = panelData();
    using Text = const std::string*;
    for (const Text text : std::initializer_list<Text>{&data.scene, &data.cell, &data.device, &data.hint, &data.tooltip,
                                                       &search_.text, &search_.error})
      window_.want(*text);
    using Texts = const std::vector<std::string>*;
    for (const Texts texts : std::initializer_list<Texts>{&data.messages, &search_.names, &tiles_.failures})
      for (const std::string& text : *texts) window_.want(text);
    window_.setInterfaceScale(settings_.interface_scale);
    window_.beginPanels();
    const PanelRequests requests = drawPanels(data, tiles_, panels_, search_, settings_);
    window_.endPanels();
    if (std::exchange(window_picture_wanted_, false)) write(window_.read());
    advancePicture();
    serve(requests);
  }

  void drawScene() {
    if (settings_.stereo == StereoMode::quad_buffer && !renderer_.hasQuadBuffer()) {
      settings_.stereo = StereoMode::mono;
      say("this display has no quad-buffer stereo; s goes through the other modes");
    }
    const bool overview = viewpoint_->isOverview();
    SceneFrame frame;
    frame.camera = camera_;
    if (!overview) frame.workspace = &viewpoint_->workspace();
    if (now().tick > 0) frame.proxy_W = now().p_W;
    if (!overview) frame.junction = travel_->junction();
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
    if (picture_wanted_ > 0) beginPicture(frame);
    figures_ = picture_->draw(frame);
    const bool lacks_levels = figures_.tiles_left_out > 0 && !figures_.moving && !travel_->scene().levels;
    if (lacks_levels && !std::exchange(levels_missed_, true))
      say("this scene has no levels of detail: what is far away is left out (filiform ingest --levels makes them)");
  }

  void sayFailure(const std::string& failure) {
    if (failures_told_.insert(failure).second) say(failure);
  }

  void blank() {
    now_s_ = window_.now_s();
    size_ = window_.size();
    busy_ = false;
    renderer_.draw({EyeView{}, EyeView{}}, {.size = size_, .samples = 1});
    renderer_.present(size_);
    const bool opening = opening_.isUnderWay();
    std::string what = "drop a tile set or an .swc file here";
    if (opening)
      what = "opening " +
             (opening_.awaitsScene() || options_.session.device == "mouse" ? opening_.name() : options_.session.device);
    const std::vector<std::string> messages = messages_.shown();
    window_.want(what);
    for (const std::string& text : messages) window_.want(text);
    window_.beginPanels();
    drawOpening(size_, window_.scale(), what, opening ? now_s_ - opening_.since_s() : -1, messages);
    window_.endPanels();
  }

  PanelData panelData() {
    const NavigationSnapshot& s = now();
    PanelData d;
    d.size = size_;
    d.scale = window_.scale();
    d.um_px = camera_.focus_um / pixelsPerRadian(view_.frustum, size_);
    d.scene = travel_->scene().name;
    d.cell = travel_->cellName();
    if (travel_->sample()) d.place = format("sample %lld, ", static_cast<long long>(*travel_->sample()));
    d.place += format("%.1f %.1f %.1f um", s.p_W.x(), s.p_W.y(), s.p_W.z());
    d.device = travel_->session().deviceName();
    d.mode = toString(s.mode);
    if (travel_->session().awaited()) d.mode += ", jumping";
    if (s.frontier) d.mode += ", waiting for a tile";
    d.zoom_um = s.zoom_um;
    d.force_N = s.force_N.norm();
    d.measure = travel_->measured();
    if (settings_.stereo != StereoMode::mono)
      d.stereo = std::string(toString(settings_.stereo)) + format(", separation %.1f", settings_.separation);
    d.segments = figures_.segments;
    d.left_out = figures_.left_out;
    d.pending = figures_.pending;
    d.error_px = figures_.error_px;
    d.complete = figures_.complete;
    d.frozen = frozen_;
    d.overview = viewpoint_->isOverview();
    d.forces_N = &travel_->forces_N();
    if (s.tick > 0 && !viewpoint_->isGliding()) {
      d.proxy = project(view_, s.p_W, size_);
      if (!d.overview && s.mode == NavigationMode::constrained) d.hand = project(view_, s.h_W, size_);
    }
    d.lo_W = picture_->lo_W();
    d.hi_W = picture_->hi_W();
    d.proxy_W = s.p_W;
    d.centre_W = s.centre_W;
    d.visited_W = travel_->visited_W();
    for (const std::string& name : travel_->history().bookmarks()) {
      d.bookmark_names.push_back(name);
      d.bookmarks_W.push_back(travel_->history().bookmark(name)->p_W);
    }
    d.messages = messages_.shown();
    if (awaiting_letter_ != Action::none)
      d.hint = awaiting_letter_ == Action::set_bookmark ? "bookmark: type a letter" : "go to bookmark: type its letter";
    else if (opening_.isUnderWay())
      d.hint = "opening " + opening_.name();
    else
      d.hint = "h: keys and mouse";
    if (large_) {
      d.picture = format("picture of %d x %d pixels", large_->size().width, large_->size().height);
      d.picture_part = large_->done();
    } else if (!writer_.idle()) {
      d.picture = "writing the picture";
    }
    d.tooltip = tooltip_;
    d.tooltip_x = pointer_x_;
    d.tooltip_y = pointer_y_;
    return d;
  }

  void countTiles() {
    const Residency* residency = travel_->session().residency();
    tiles_ = internal::countTiles(travel_->store(), residency, tiles_, std::max(now_s_ - tiles_counted_s_, 1e-3));
    tiles_counted_s_ = now_s_;
    tiles_.frontiers = now().frontiers;
    for (const std::string& failure : tiles_.failures) sayFailure(failure);
    if (!settings_.show_tiles) return;
    travel_->listTiles([this](std::vector<internal::NearTile> near) { near_ = std::move(near); });
    internal::showTiles(near_, residency, tiles_);
  }

  void serve(const PanelRequests& requests) {
    if (requests.cancel_picture) cancelPicture();
    if (requests.search_changed) findNames();
    if (requests.reset) {
      const int width = settings_.width, height = settings_.height;
      settings_ = {};
      settings_.width = width;
      settings_.height = height;
    }
    if (requests.go) {
      search_.error.clear();
      travel_->goTo(parseCellQuery(*requests.go));
    }
    if (requests.go_to_W) travel_->goNear(*requests.go_to_W);
  }

  // ---- pictures and the state

  void beginPicture(SceneFrame frame) {
    const int most = Renderer::kMaxSize / std::max(size_.width, size_.height);
    const int times = std::clamp(std::exchange(picture_wanted_, 0), 1, std::max(most, 1));
    if (large_) return say("one picture is being drawn already (Esc cancels it)");
    frame.size = {size_.width * times, size_.height * times};
    frame.mark_scale *= times;
    large_ = std::make_unique<LargePicture>(travel_->store(), travel_->scene().levels.get(), window_.context(), frame);
  }

  void advancePicture() {
    if (!large_) return;
    try {
      large_->advance(kPicture_ms);
      if (!large_->isDone()) return;
      write(large_->take());
    } catch (const std::exception& error) {
      say(error.what());
    }
    endPicture();
  }

  void cancelPicture() {
    if (!large_) return;
    endPicture();
    say("the picture is cancelled");
  }

  void endPicture() {
    if (!large_) return;
    closing_.begin([loader = large_->end()]() mutable { loader.reset(); });
    large_.reset();
  }

  // Packing and writing a large picture takes a second: beside the frames.
  void write(Picture picture) {
    const std::time_t now = std::time(nullptr);
    std::tm local{};
    localtime_r(&now, &local);
    char stamp[32];
    std::strftime(stamp, sizeof stamp, "%Y%m%d-%H%M%S", &local);
    std::string path = options_.pictures + "/filiform-" + stamp + "-" + std::to_string(++pictures_asked_) + ".png";
    writer_.ask([this, path = std::move(path),
                 picture = std::make_shared<const Picture>(std::move(picture))]() -> Worker::Done {
      options_.write(*picture, path);
      return [this, path, width = picture->width, height = picture->height] {
        ++pictures_;
        last_picture_ = path;
        say(format("%d x %d pixels: ", width, height) + escaped(path));
      };
    });
  }

  void dumpState() {
    last_dump_s_ = window_.now_s();
    if (options_.state.empty()) return;
    nlohmann::ordered_json json{{"frames", frames_},
                                {"frame_ms", frame_ms_},
                                {"ended", ended_},
                                {"open", travel_ != nullptr},
                                {"scale", window_.scale()},
                                {"width", size_.width},
                                {"height", size_.height},
                                {"renderer", window_.context().description()},
                                {"colour_by", toString(settings_.colouring)},
                                {"stereo", toString(settings_.stereo)},
                                {"separation", settings_.separation},
                                {"orthographic", settings_.orthographic},
                                {"orange_blue", settings_.orange_blue},
                                {"reduced_motion", settings_.reduced_motion},
                                {"help", panels_.help},
                                {"search", panels_.search},
                                {"search_text", search_.text},
                                {"search_error", search_.error},
                                {"tiles_panel", settings_.show_tiles},
                                {"frozen", frozen_},
                                {"actions", actions_},
                                {"key_repeats", key_repeats_},
                                {"last_action", last_action_},
                                {"message", messages_.last()},
                                {"messages", messages_.count()},
                                {"last_picture", last_picture_},
                                {"picture_part", large_ ? large_->done() : -1},
                                {"pictures", pictures_}};
    if (travel_) {
      travel_->describe(json);
      const ScreenPoint proxy = project(view_, now().p_W, size_);
      if (proxy.depth_um > 0) json["proxy_px"] = {proxy.x, proxy.y};
      json["overview"] = viewpoint_->isOverview();
      json["shift"] = {viewpoint_->shift().x(), viewpoint_->shift().y()};
      json["tooltip"] = tooltip_;
      json["segments"] = figures_.segments;
      json["left_out"] = figures_.left_out;
      json["pending"] = figures_.pending;
      json["complete"] = figures_.complete;
      json["moving"] = figures_.moving;
      json["error_px"] = figures_.error_px;
      json["resident_bytes"] = tiles_.counters.bytes;
      json["failures"] = figures_.failed.size() + tiles_.failures.size();
    }
    static const std::atomic<bool> kDoNotWait{true};  // for a pipe's reader
    try {
      Output out(options_.state, {.sync = false, .cancel = &kDoNotWait});
      out.stream() << json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
      out.finish();
      state_failure_.clear();
    } catch (const Interrupted&) {  // a pipe that nobody reads now
    } catch (const ClosedPipe&) {
    } catch (const Error& error) {  // tried again a tenth of a second later
      if (state_failure_.empty()) say(error.what());
      state_failure_ = error.what();
    }
  }

  const ApplicationOptions& options_;
  Messages messages_;  // before what says something while it is made
  std::string settings_path_;
  Settings settings_;
  Window window_;
  Renderer renderer_;
  SceneBudget budget_;

  Opening opening_;
  bool opened_once_ = false, quitting_ = false, ended_ = false, busy_ = false;

  std::set<Action> held_;
  Action drag_ = Action::none, awaiting_letter_ = Action::none;
  double pointer_x_ = 0, pointer_y_ = 0, last_x_ = 0, last_y_ = 0;
  double pressed_x_ = 0, pressed_y_ = 0, pressed_s_ = -1, closer_m_ = 0, still_since_s_ = 0;

  double now_s_ = 0;
  PictureSize size_;
  Camera camera_;
  EyeView view_;
  bool frozen_ = false;
  SceneFigures figures_;
  bool levels_missed_ = false;  // and that was said
  bool tooltip_asked_ = false;
  std::string tooltip_;
  double tooltip_for_s_ = -1;
  std::set<std::string> failures_told_;

  OpenPanels panels_;
  SearchPanel search_;
  TilePanel tiles_;
  std::vector<internal::NearTile> near_;  // tiles about the proxy
  double tiles_counted_s_ = -1, last_dump_s_ = -1, frame_ms_ = 0;
  int picture_wanted_ = 0, pictures_asked_ = 0, pictures_ = 0;
  bool window_picture_wanted_ = false;
  std::uint64_t frames_ = 0, actions_ = 0, key_repeats_ = 0;
  std::string last_action_, last_picture_, state_failure_;
  // Of the open scene; what uses the others goes first.
  std::unique_ptr<Travel> travel_;
  std::optional<Viewpoint> viewpoint_;
  std::unique_ptr<SceneView> picture_;
  std::unique_ptr<LargePicture> large_;  // that is being drawn
  Worker writer_;                        // of pictures into files
  Closing closing_;                      // what it ends may still use the open scene
};

}  // namespace

void runApplication(const ApplicationOptions& options) { Application(options).run(); }

}  // namespace filiform
