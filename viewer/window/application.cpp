#include "viewer/window/application.h"

#include "device/haptic_device.h"
#include "index/errors.h"
#include "viewer/gl/frame_governor.h"
#include "viewer/window/internal/answer_times.h"
#include "viewer/window/internal/open_scene.h"
#include "viewer/window/internal/state_file.h"
#include "viewer/window/internal/wanted_texts.h"
#include "viewer/window/internal/window_actions.h"
#include "viewer/window/panels/panels.h"
#include "viewer/window/settings/internal/kept_settings.h"
#include "viewer/window/settings/internal/messages.h"
#include "viewer/window/settings/internal/text_format.h"
#include "viewer/window/travel/internal/closing.h"
#include "viewer/window/travel/internal/opening.h"
#include "viewer/window/travel/internal/screenshots.h"
#include "viewer/window/window.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform {

namespace {

using internal::CellChoice;
using internal::Closing;
using internal::format;
using internal::KeptSettings;
using internal::Messages;
using internal::Opened;
using internal::Opening;
using internal::OpenScene;
using internal::Screenshots;
using internal::StateFile;
using internal::Travel;
using internal::wantTexts;
using internal::WindowActions;

constexpr double kSaveState_s = 0.1;  // between two writes of the state
// What a finer picture adds fades in: the part of its first frame, and the time.
constexpr double kFirstShown = 0.2, kFade_s = 0.25;
constexpr double kBlank_s = 0.1;  // between two frames while no scene is open
// Between two frames: while something is under way, otherwise, and once nothing has changed for kSettled_s.
constexpr double kBusyWait_s = 0.001, kWait_s = 0.015, kRestWait_s = 0.05, kSettled_s = 0.5;

// The hint of the first start, until this long after the first action.
constexpr double kGreets_s = 20;
constexpr const char* kGreeting =
    "double click: go to a neurite    /: go to a cell    o: inside, and back\n"
    "right drag: pull the proxy along its neurite    t: it travels by itself\n"
    "drag: turn    wheel: zoom    h: all keys and mouse";

}  // namespace

class Application::Impl {
 public:
  explicit Impl(const ApplicationOptions& options)
      : options_(options),
        kept_(options.reset, messages_),
        window_("filiform", options.size.value_or(PictureSize{settings_.width, settings_.height}),
                settings_.interface_scale),
        renderer_(window_.context()),
        governor_(options.segments),
        state_file_(options.state),
        screenshots_(options.pictures, options.write, messages_, closing_) {
    if (options.theme) settings_.theme = *options.theme;
    actions_.panels.bookmarks.can_save = !options.tables.empty();
    if (!options_.paths.empty()) open(options_.paths);
  }

  bool step() {
    if (!window_.isOpen() || actions_.isQuitting()) return false;
    options_.poll();
    const double begin_s = window_.now_s();
    if (options_.seconds && !opening_.isUnderWay() && begin_s - entered_s_ > *options_.seconds) return false;
    messages_.setTime(begin_s);
    const bool rests = begin_s - changed_s_ > kSettled_s;
    const std::vector<InputEvent> events = window_.poll(busy_ ? kBusyWait_s : rests ? kRestWait_s : kWait_s);
    const double polled_s = window_.now_s();
    if (!events.empty()) changed_s_ = polled_s;
    answers_.poll(begin_s, polled_s, !events.empty(), 2 * kBusyWait_s);
    for (const InputEvent& event : events) handle(event);
    finishOpening();
    for (const std::string& failure : closing_.takeFailures()) say(failure);
    screenshots_.serve();
    if (scene_)
      frame();
    else
      blank();
    if (window_.now_s() - last_state_s_ > kSaveState_s) writeState();
    frame_ms_ += 0.1 * (1000 * (window_.now_s() - begin_s) - frame_ms_);
    answers_.endFrame();
    if (scene_ && presented_ > 0) longest_ms_ = std::max(longest_ms_, 1000 * (window_.now_s() - polled_s));
    ++frames_;
    return true;
  }

  void finish() {
    window_.hide();
    options_.ending();
    if (!scene_ && options_.session.ending) options_.session.ending();
    end();
  }

  void keep() {
    try {
      kept_.save();
    } catch (const std::exception& error) {
      messages_.sayOnce(error.what());
    }
  }

  void say(const std::string& text) { messages_.say(text); }

  void accompany(const std::optional<Companion>& companion) {
    companion_ = companion && companion->isFinite() ? companion : std::nullopt;
  }

 private:
  // ---- input

  // A key belongs to the text field that has the keyboard when the key is pressed, however many keys one frame brings:
  // the panels take each key before the next one is looked at.
  void handle(const InputEvent& event) {
    using Kind = InputEvent::Kind;
    const bool acts = event.kind == Kind::key || event.kind == Kind::button || event.kind == Kind::scroll;
    if (acts) greets_until_s_ = std::min(greets_until_s_, window_.now_s() + kGreets_s);
    if (event.kind != Kind::key && event.kind != Kind::key_up) return actions_.handle(event);
    const bool types = scene_ && window_.isTyping(), is_press = event.kind == Kind::key;
    // A held key that opened the field does not type into it.
    if (is_press && !event.repeated) began_in_field_ = types;
    if (!is_press) window_.type(event);
    if (types && is_press && event.key.code != Key::kEscape && began_in_field_) {
      window_.type(event);
      return takeInput();
    }
    if (event.key.code == Key::kNone) return;
    actions_.handle(event);
    if (scene_ && (types || actions_.wantsKeyboard())) takeInput();
  }

  // Dear ImGui gives a field the keyboard in the second frame after it was asked to, and tells of it in the third.
  void takeInput() {
    const bool focuses = actions_.wantsKeyboard();
    for (int i = 0; i < 2 || (i < 4 && focuses && !window_.isTyping()); ++i) {
      const PanelRequests requests = layPanels();
      window_.dropPanels();
      serve(requests);
    }
  }

  // ---- scenes

  void open(const std::vector<std::string>& paths) {
    if (opening_.isUnderWay()) return say("another scene is already being opened");
    opening_.begin(paths, opened_once_ ? "" : options_.place, options_.open, renderer_, window_.now_s());
  }

  void finishOpening() {
    try {
      if (opening_.isSceneReady()) {
        opening_.takeScene();
        closeScene();
      }
      // Only one session can have a device: wait until the session before has released it.
      const bool is_free = options_.session.device == "mouse" || !closing_.isUnderWay();
      if (opening_.awaitsDevice() && is_free) {
        SessionOptions session = options_.session;
        if (opened_once_) session.record.clear();  // a recording is of one scene
        opening_.openDevice(session);
      }
      if (opening_.isReady()) enter(opening_.take());
    } catch (const std::exception& error) {
      if (!opened_once_) throw;  // the user still looks at the terminal
      say(error.what());
    }
  }

  void enter(Opened opened) {
    const Travel::Callbacks callbacks{[this] { jumping(); },
                                      [this](const std::string& why) { actions_.searchFailed(why); },
                                      options_.plugged_in, options_.awaited_device};
    scene_ = std::make_unique<OpenScene>(std::move(opened), messages_, callbacks);
    actions_.enter(scene_.get());
    if (!opened_once_) {
      entered_s_ = window_.now_s();
      colourBy(options_.colour_by);
      if (options_.view) settings_.orthographic = options_.view->orthographic;
    }
    window_.setTitle("filiform: " + scene_->travel().scene().name);
    scene_->travel().start();
    // Who has never seen the program sees the scene first.
    const bool from_afar =
        kept_.isFirst() && !opened_once_ && options_.place.empty() && options_.session.device == "mouse";
    if (from_afar) scene_->nextOverview();
    greets_until_s_ = from_afar ? INFINITY : 0;
    if (options_.view && !opened_once_) shown_view_ = &*options_.view;
    opened_once_ = true;
  }

  void colourBy(const std::string& name) {
    if (const auto kind = colouringNamed(name)) {
      settings_.colouring = *kind;
      return;
    }
    constexpr std::string_view kAttributePrefix = "attribute:";
    PanelRequests asked;
    asked.attribute = name.starts_with(kAttributePrefix) ? name.substr(kAttributePrefix.size()) : name;
    scene_->serveAttributes(asked);
  }

  // Ending the scene may wait for the disk or the device: it runs beside the frames.
  void closeScene() {
    if (!scene_) return;
    screenshots_.drop();
    actions_.enter(nullptr);
    closing_.begin(scene_->end());
    scene_.reset();
    shown_view_ = nullptr;
  }

  void end() {
    screenshots_.drop();
    std::string failure = screenshots_.finish();
    if (scene_) {
      try {
        scene_->travel().finish();
      } catch (const std::exception& error) {
        failure = error.what();
      }
    }
    for (std::string& why : closing_.finish()) failure = std::move(why);
    const PictureSize size = window_.size();
    settings_.width = static_cast<int>(size.width / window_.scale() * settings_.interface_scale);
    settings_.height = static_cast<int>(size.height / window_.scale() * settings_.interface_scale);
    try {
      kept_.save();
    } catch (const std::exception& error) {
      failure = error.what();
    }
    ended_ = true;
    writeState();
    if (!state_file_.failure().empty()) failure = state_file_.failure();
    if (!failure.empty()) throw DeviceError(failure);
  }

  // Called right before the proxy jumps.
  void jumping() {
    actions_.panels.search = false;
    scene_->viewpoint().depart(now_s_, settings_.reduced_motion);
  }

  // ---- frames

  void frame() {
    now_s_ = window_.now_s();
    size_ = window_.size();
    Travel& travel = scene_->travel();
    const Workspace& workspace = scene_->viewpoint().workspace();
    try {
      travel.serve();
      if (shown_view_ != nullptr && scene_->now().tick > 0 && !travel.session().awaited())
        scene_->show(*std::exchange(shown_view_, nullptr));
      scene_->accompany(companion_);
      scene_->look(size_, settings_.orthographic, now_s_);
      if (!scene_->goesAlong())
        travel.lead(actions_.input().pointing(scene_->view(), size_, workspace, scene_->now().p_W), workspace);
      else
        travel.lead(std::nullopt, workspace);
      travel.observe();
      if (options_.observe)
        for (const std::string& line : options_.observe(travel.scene(), scene_->now())) say(line);
      actions_.lookUnderPointer(now_s_);
      scene_->countTiles(settings_.show_tiles, now_s_);
      drawScene();
    } catch (const Error& error) {  // of the scene or the graphics: the window goes on
      messages_.sayOnce(error.what());
    }
    const SceneFigures& figures = scene_->figures();
    const bool lost = scene_->hasLostNetwork();  // its line then says enough
    for (const auto* failures : {&figures.failed, &scene_->tiles().failures})
      for (const std::string& failure : *failures)
        if (told_failures_.insert(failure).second && !lost) say(failure);
    busy_ = screenshots_.isDrawing() || figures.redrawn || figures.drawing || figures.pending > 0 ||
            actions_.input().isDragging() || scene_->viewpoint().isGliding() || companion_.has_value();
    pictures_ += figures.redrawn ? 1 : 0;
    scene_->servePanels(actions_.panels);
    if (actions_.wantsKeyboard()) takeInput();  // a search that failed
    const PanelRequests requests = layPanels();
    const bool wanted = actions_.takeWindowPicture();
    if (figures.redrawn) refined_s_ = figures.refined && !settings_.reduced_motion ? now_s_ : -INFINITY;
    const double shown = std::min(kFirstShown + (now_s_ - refined_s_) / kFade_s, 1.0);
    const bool fades = std::exchange(fading_, shown < 1) || shown < 1;
    busy_ |= fades;
    if (window_.endPanels() || figures.redrawn || fades || wanted) present(wanted, shown);
    screenshots_.advance();
    serve(requests);
  }

  void present(bool picture_wanted, double shown = 1) {
    renderer_.present(size_, shown);
    window_.drawPanels();
    if (picture_wanted) screenshots_.save(window_.read());
    window_.show();
    ++presented_;
    changed_s_ = window_.now_s();
    answers_.presented(changed_s_);
  }

  void drawScene() {
    if (settings_.stereo == StereoMode::quad_buffer && !renderer_.hasQuadBuffer()) {
      settings_.stereo = StereoMode::mono;
      say("this display has no quad-buffer stereo; s selects another mode");
    }
    SceneFrame frame = scene_->frame(settings_.own_cell, settings_.theme);
    frame.palette = settings_.orange_blue ? kOrangeBlue : kRedGreen;
    frame.colour = settings_.colouring;
    frame.time_s = now_s_;
    frame.size = size_;
    frame.stereo = settings_.stereo;
    frame.eyes.gain = settings_.separation;
    frame.eyes.widening = settings_.widening;
    frame.budget = governor_.budgetFor(size_, window_.scale() / settings_.interface_scale);
    frame.frozen = actions_.isFrozen();
    frame.overlay_scale = window_.scale();
    const int times = actions_.takePicture();
    const OpenedScene& scene = scene_->travel().scene();
    if (times > 0) screenshots_.begin(frame, times, *scene.store, scene.levels.get(), window_.context());
    scene_->draw(frame);
    governor_.drew(scene_->figures());
  }

  PanelRequests layPanels() {
    const PanelData data = panelData();
    wantTexts(window_, data, *scene_, actions_);
    window_.setInterfaceScale(settings_.interface_scale);
    window_.setTheme(settings_.theme);
    window_.beginPanels();
    return drawPanels(data, scene_->tiles(), actions_.panels, actions_.search, settings_);
  }

  // The frame while no scene is open. Few of them: drawing takes time from opening.
  void blank() {
    busy_ = false;
    const PictureSize size = window_.size();
    const bool same_size = size.width == size_.width && size.height == size_.height;
    if (same_size && window_.now_s() - last_blank_s_ < kBlank_s) return;
    now_s_ = last_blank_s_ = window_.now_s();
    size_ = size;
    const bool opening = opening_.isUnderWay();
    std::string what = "drop a tile set or an .swc file here";
    if (opening)
      what = "opening " +
             (opening_.awaitsScene() || options_.session.device == "mouse" ? opening_.name() : options_.session.device);
    const std::vector<std::string> messages = messages_.shown();
    window_.want(what);
    for (const std::string& text : messages) window_.want(text);
    window_.setTheme(settings_.theme);
    window_.beginPanels();
    drawOpening(window_.points(), window_.scale() / window_.pixelsPerPoint(), what,
                opening ? now_s_ - opening_.since_s() : -1, messages);
    if (!window_.endPanels() && same_size) return;
    const bool is_first = presented_ == 0;
    renderer_.draw({EyeView{}, EyeView{}}, {.size = size_, .samples = 1, .background = groundOf(settings_.theme)});
    present(false);
    if (is_first) renderer_.warmUp();  // beside the opening
  }

  PanelData panelData() const {
    PanelData d;
    d.size = window_.points();
    d.scale = window_.scale() / window_.pixelsPerPoint();
    scene_->fill(d, d.size, settings_.colouring);
    if (settings_.stereo != StereoMode::mono)
      d.status.stereo = std::string(toString(settings_.stereo)) + format(", separation %.1f", settings_.separation);
    d.lines.messages = messages_.shown();
    d.lines.hint = opening_.isUnderWay()      ? "opening " + opening_.name()
                   : now_s_ < greets_until_s_ ? kGreeting
                                              : "h: keys and mouse";
    actions_.fill(d);
    d.picture.text = screenshots_.text();
    d.picture.part = screenshots_.part();
    return d;
  }

  void serve(const PanelRequests& requests) {
    if (requests.cancel_picture) screenshots_.cancel();
    if (requests.search_changed) actions_.findNames();
    if (requests.reset) {
      const int width = settings_.width, height = settings_.height;
      settings_ = {};
      settings_.width = width;
      settings_.height = height;
    }
    scene_->serveAttributes(requests);
    CellChoice& choice = scene_->choice();
    if (requests.choose_cells) {
      const bool again = choice.chosen() == *requests.choose_cells && !requests.go_to_cell;
      choice.choose(again ? std::vector<std::uint32_t>() : *requests.choose_cells);
    }
    if (requests.toggle_cell) choice.toggle(*requests.toggle_cell);
    if (requests.act != Action::none && !(requests.act_on && scene_->actOnCells(requests.act, requests.act_on)))
      actions_.act(requests.act);
    if (requests.go_to_place) scene_->travel().goToFound(*requests.go_to_place);
    if (requests.copy) window_.copy(*requests.copy);
    if (const std::string copied = scene_->takeCopied(); !copied.empty()) window_.copy(copied);
    if (actions_.takeView()) scene_->saveView(settings_, size_, options_.tables);
    scene_->serveBookmarks(requests.bookmarks, options_.tables);
    if (requests.find_contacts) scene_->findContacts(actions_.panels.contacts.within_um);
    if (requests.jump_across) scene_->jumpAcross(requests.jump_across);
    if (requests.go_to_cell) scene_->travel().goToCell(*requests.go_to_cell);
    if (requests.go && scene_->attributes().isCondition(*requests.go)) {
      if (scene_->selectCells(*requests.go, actions_.search.error)) actions_.panels.search = false;
    } else if (requests.go) {
      actions_.search.error.clear();
      scene_->travel().goTo(parseCellQuery(*requests.go));
    }
    if (requests.go_to_W) scene_->travel().goNear(*requests.go_to_W);
  }

  // ---- the state

  nlohmann::ordered_json state() const {
    nlohmann::ordered_json json{{"frames", frames_},
                                {"presented", presented_},
                                {"pictures_drawn", pictures_},
                                {"longest_frame_ms", longest_ms_},
                                {"longest_answer_ms", answers_.longest_ms()},
                                {"frame_ms", frame_ms_},
                                {"ended", ended_},
                                {"open", scene_ != nullptr},
                                {"scale", window_.scale()},
                                {"width", size_.width},
                                {"height", size_.height},
                                {"renderer", renderer_name_},
                                {"colour_by", toString(settings_.colouring)},
                                {"stereo", toString(settings_.stereo)},
                                {"separation", settings_.separation},
                                {"orthographic", settings_.orthographic},
                                {"own_cell", settings_.own_cell},
                                {"orange_blue", settings_.orange_blue},
                                {"theme", toString(settings_.theme)},
                                {"reduced_motion", settings_.reduced_motion},
                                {"tiles_panel", settings_.show_tiles},
                                {"message", messages_.last()},
                                {"messages", messages_.count()},
                                {"last_picture", screenshots_.lastPath()},
                                {"picture_part", screenshots_.part()},
                                {"pictures", screenshots_.written()}};
    actions_.describe(json);
    if (scene_) scene_->describe(json, size_);
    return json;
  }

  void writeState() {
    last_state_s_ = window_.now_s();
    if (state_file_.isOn() && state_file_.write(state())) say(state_file_.failure());
  }

  const ApplicationOptions& options_;
  Messages messages_;  // before the members that send messages while they are made
  KeptSettings kept_;
  Settings& settings_ = kept_.now;
  Window window_;
  Renderer renderer_;
  std::string renderer_name_ = window_.context().description();
  FrameGovernor governor_;

  Opening opening_;
  bool opened_once_ = false, ended_ = false, busy_ = false, began_in_field_ = false;
  std::optional<Companion> companion_;

  const ViewState* shown_view_ = nullptr;  // is to be shown once the proxy is at its place
  double now_s_ = 0;
  PictureSize size_;
  std::set<std::string> told_failures_;

  StateFile state_file_;
  double last_state_s_ = -1, last_blank_s_ = -1, frame_ms_ = 0, longest_ms_ = 0;
  double entered_s_ = 0;          // the first scene
  double changed_s_ = 0;          // the last event or presented frame
  double refined_s_ = -INFINITY;  // the last picture of the same view: it fades in
  bool fading_ = false;
  double greets_until_s_ = 0;
  std::uint64_t frames_ = 0, presented_ = 0, pictures_ = 0;
  internal::AnswerTimes answers_;

  // Destroyed from the last to the first: each may use the ones before it.
  std::unique_ptr<OpenScene> scene_;
  Screenshots screenshots_;
  Closing closing_;
  WindowActions actions_{window_,   renderer_,    settings_,
                         messages_, screenshots_, [this](const auto& paths) { open(paths); }};
};

Application::Application(const ApplicationOptions& options) : impl_(std::make_unique<Impl>(options)) {}
Application::~Application() = default;
bool Application::step() { return impl_->step(); }
void Application::finish() { impl_->finish(); }
void Application::keep() { impl_->keep(); }
void Application::accompany(const std::optional<Companion>& companion) { impl_->accompany(companion); }
void Application::say(const std::string& text) { impl_->say(text); }

void runApplication(const ApplicationOptions& options) {
  Application application(options);
  try {
    while (application.step()) {
    }
  } catch (...) {
    options.ending();
    throw;
  }
  application.finish();
}

}  // namespace filiform
