#include "viewer/window/internal/window_actions.h"

#include "index/text.h"
#include "viewer/scene/pointer.h"
#include "viewer/window/settings/internal/setting_actions.h"
#include "viewer/window/settings/internal/text_format.h"

#include <cmath>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::internal {
namespace {

constexpr double kTurn_rad = 0.1;                                                        // by one press of a key
constexpr double kDoubleClick_px = 6, kOnProxy_px = 16, kTooltip_px = 5, kClick_px = 4;  // times the scale
constexpr double kClick_s = 0.25;  // a press that lasts longer is none

}  // namespace

void WindowActions::enter(OpenScene* scene) {
  scene_ = scene;
  input_.drag(Action::none);
  tooltip_.reset();
  panels.menu = {};
}

void WindowActions::handle(const InputEvent& event) {
  input_.point(event);
  if (event.kind == InputEvent::Kind::drop) return take(event.paths);
  if (event.kind == InputEvent::Kind::key) return press(event.key, event.repeated);
  if (event.kind == InputEvent::Kind::key_up) return input_.release(event.key);
  if (!scene_) return;
  switch (event.kind) {
    case InputEvent::Kind::button:
      return pressButton(event);
    case InputEvent::Kind::button_up:
      releaseButton(event);
      break;
    case InputEvent::Kind::move:
      return moved();
    case InputEvent::Kind::scroll:
      if ((event.modifiers & Key::kControl) != 0)
        changeSeparation(kSeparationStep * event.y, settings_, messages_);
      else
        zoom(std::pow(1 / kZoomNotch, event.y));
      break;
    default:
      break;
  }
}

// A table of bookmarks, or a scene.
void WindowActions::take(const std::vector<std::string>& paths) {
  if (paths.size() != 1 || !endsWithNoCase(paths.front(), ".csv")) return open_(paths);
  if (scene_)
    scene_->bookmarks().readFile(paths.front());
  else
    messages_.say("open a scene first; then drop the bookmarks");
}

void WindowActions::pressButton(const InputEvent& event) {
  panels.menu.open = may_click_ = false;
  awaiting_pull_ = Action::none;
  if (input_.press(event, kDoubleClick_px * window_.scale()))
    return scene_->travel().goAlong(
        pickRay(scene_->view(), event.x, event.y, window_.size(), kDoubleClick_px * window_.scale()));
  may_click_ = event.button <= 1;
  pressed_ = event;
  const Action drag = dragOf(event);
  if (event.button == 1)
    awaiting_pull_ = drag;
  else
    input_.drag(drag);
  scene_->travel().stopHand();
}

void WindowActions::releaseButton(const InputEvent& event) {
  input_.drag(Action::none);
  awaiting_pull_ = Action::none;
  if (!std::exchange(may_click_, false) || event.button != pressed_.button) return;
  if (event.button == 1) return openMenu(pressed_);
  chooseAt(pressed_);
}

void WindowActions::pull(double now_s) {
  if (now_s - pressed_.time_s < kClick_s) return;
  may_click_ = false;
  if (awaiting_pull_ != Action::none) input_.drag(std::exchange(awaiting_pull_, Action::none));
}

void WindowActions::chooseAt(const InputEvent& event) {
  const RayQuery ray = pickRay(scene_->view(), event.x, event.y, window_.size(), kTooltip_px * window_.scale());
  scene_->travel().lookAlong(ray, false, [this, modifiers = event.modifiers](const auto& seen) {
    CellChoice& choice = scene_->choice();
    if (!seen) {
      if (modifiers == 0) choice.choose({});
      return;
    }
    const std::uint32_t cell = seen->place.segment.cell;
    if ((modifiers & Key::kControl) != 0 || ((modifiers & Key::kShift) != 0 && !choice.isChosen(cell)))
      choice.toggle(cell);
    else if (modifiers == 0)
      choice.choose({&cell, 1});
    if (choice.isChosen(cell)) messages_.say(nameText(*seen) + (seen->kind.empty() ? "" : ": " + seen->kind));
  });
}

void WindowActions::openMenu(const InputEvent& event) {
  const RayQuery ray = pickRay(scene_->view(), event.x, event.y, window_.size(), kTooltip_px * window_.scale());
  scene_->travel().lookAlong(ray, true, [this, event](const auto& seen) {
    if (!seen) return messages_.say("no neurite under the pointer");
    const std::uint32_t cell = seen->place.segment.cell;
    if (!scene_->choice().isChosen(cell)) scene_->choice().choose({&cell, 1});
    std::string text = seen->kind;
    text += seen->radius_um > 0 ? format("\nradius %.3g \u00b5m", seen->radius_um) : std::string("\nradius not known");
    text += "\n" + placeText(*seen);
    panels.menu = {.open = true,
                   .x = event.x / window_.pixelsPerPoint(),
                   .y = event.y / window_.pixelsPerPoint(),
                   .title = nameText(*seen),
                   .text = text,
                   .copied = nameText(*seen) + "\t" + placeText(*seen),
                   .place = seen->place};
  });
}

Action WindowActions::dragOf(const InputEvent& event) {
  const bool shift = (event.modifiers & Key::kShift) != 0;
  if (event.button == 1) return shift ? Action::pull_depth : Action::pull;
  if (event.button == 2 || shift) return Action::pan;
  const ScreenPoint proxy = project(scene_->view(), scene_->now().p_W, window_.size());
  const bool on_proxy =
      proxy.depth_um > 0 && std::hypot(proxy.x - event.x, proxy.y - event.y) < kOnProxy_px * window_.scale();
  return on_proxy && !scene_->viewpoint().isOverview() ? Action::pull : Action::rotate;
}

void WindowActions::moved() {
  tooltip_.pointerMoved(window_.now_s());
  if (may_click_ && std::hypot(input_.x() - pressed_.x, input_.y() - pressed_.y) > kClick_px * window_.scale())
    pull(INFINITY);
  const HandInput::Step step = input_.step(window_.size());
  if (input_.dragged() == Action::rotate) scene_->turn(turnOf(step.dx_px, step.dy_px, window_.size()));
  if (input_.dragged() == Action::pan) scene_->viewpoint().pan(step.dx_px, step.dy_px, window_.size());
}

void WindowActions::press(const Key& key, bool repeated) {
  key_repeats_ += repeated ? 1 : 0;
  if (awaiting_letter_ != Action::none) {
    if (repeated) return;  // of the key that asked for the letter
    const Action what = std::exchange(awaiting_letter_, Action::none);
    if (!scene_ || key.code <= ' ' || key.code >= 0x7F || key.modifiers != 0) return;
    const std::string name(1, static_cast<char>(key.code));
    if (what == Action::set_bookmark) return scene_->bookmarks().set(name);
    return scene_->bookmarks().go(name);
  }
  if (key.code == Key::kEnter && panels.cells.open && scene_ && scene_->choice().lastChosen() != UINT32_MAX)
    return scene_->travel().goToCell(scene_->choice().lastChosen());
  const Action action = actionOf(key, repeated);
  if (action != Action::none) act(action);
}

void WindowActions::act(Action action) {
  ++acted_;
  last_action_ = bindingOf(action).name;
  if (action != Action::quit) asked_to_quit_ = false;
  switch (action) {
    case Action::quit:
      return quit();
    case Action::help:
      panels.help = !panels.help;
      return;
    case Action::commands:
      panels.commands = {.open = !panels.commands.open, .focus = !panels.commands.open, .text = {}};
      return;
    case Action::panel_settings:
      panels.settings = !panels.settings;
      return;
    case Action::panel_cells:
      panels.cells.open = panels.cells.focus = scene_ != nullptr && !panels.cells.open;
      return;
    case Action::panel_bookmarks:
      panels.bookmarks.open = panels.bookmarks.focus = scene_ != nullptr && !panels.bookmarks.open;
      return;
    case Action::panel_contacts:
      panels.contacts.open = scene_ != nullptr && !panels.contacts.open;
      if (panels.contacts.open) scene_->findContacts(panels.contacts.within_um);
      return;
    case Action::panel_force:
      settings_.show_force = !showsForce();
      return;
    case Action::fullscreen:
      window_.toggleFullscreen();
      return;
    case Action::close:
      closeTop();
      return;
    case Action::save_view:
      view_wanted_ = scene_ != nullptr;
      return;
    case Action::window_picture:
      window_picture_wanted_ = true;
      return;
    default:
      break;
  }
  if (action == Action::next_colouring && scene_ && scene_->nextColouring(settings_.colouring)) return;
  if (changeSetting(action, action == Action::next_stereo && renderer_.hasQuadBuffer(), settings_, messages_)) return;
  if (scene_) actInScene(action);
}

void WindowActions::actInScene(Action action) {
  switch (action) {
    case Action::push_left:
    case Action::push_right:
    case Action::push_up:
    case Action::push_down:
    case Action::push_away:
    case Action::push_closer:
      return input_.hold(action);
    case Action::zoom_in:
      return zoom(1 / kZoomNotch);
    case Action::zoom_out:
      return zoom(kZoomNotch);
    case Action::turn_left:
      return scene_->turn({0, -kTurn_rad});
    case Action::turn_right:
      return scene_->turn({0, kTurn_rad});
    case Action::turn_up:
      return scene_->turn({-kTurn_rad, 0});
    case Action::turn_down:
      return scene_->turn({kTurn_rad, 0});
    case Action::overview:
      tooltip_.clear();
      return scene_->nextOverview();
    case Action::freeze:
      frozen_ = !frozen_;
      return;
    case Action::search:
      panels.search = search.focus = true;
      search.text.clear();
      search.chosen = -1;
      search.error.clear();
      return findNames();
    case Action::set_bookmark:
    case Action::go_to_bookmark:
      awaiting_letter_ = action;
      return;
    case Action::jump_across:
      return scene_->jumpAcross();
    case Action::screenshot:
      picture_wanted_ = 1;
      return;
    case Action::screenshot_large:
      picture_wanted_ = 3;
      return;
    default:
      panels.menu.open = false;
      if (scene_->actOnCells(action)) return;
      if (action == Action::centre) scene_->viewpoint().centre();
      scene_->travel().act(action);
  }
}

void WindowActions::closeTop() {
  if (panels.menu.open)
    panels.menu.open = false;
  else if (panels.commands.open)
    panels.commands.open = false;
  else if (panels.help)
    panels.help = false;
  else if (panels.search)
    panels.search = false;
  else if (panels.settings)
    panels.settings = false;
  else if (panels.bookmarks.open)
    panels.bookmarks.open = false;
  else if (panels.cells.open)
    panels.cells.open = false;
  else if (panels.contacts.open)
    panels.contacts.open = false;
  else if (screenshots_.isDrawing())
    screenshots_.cancel();
  else if (scene_) {
    scene_->choice().choose({});
    scene_->travel().stopHand();
  }
}

// Asks if something would be lost.
void WindowActions::quit() {
  const char* lost = screenshots_.isDrawing()                         ? "the picture that is being drawn"
                     : scene_ && !scene_->travel().measured().empty() ? "the measurement"
                                                                      : nullptr;
  quitting_ = lost == nullptr || std::exchange(asked_to_quit_, true);
  if (!quitting_) messages_.say(std::string(lost) + " would be lost: press q again to quit");
}

void WindowActions::searchFailed(const std::string& why) {
  search.error = why;
  search.focus = panels.search;
}

void WindowActions::zoom(double factor) {
  tooltip_.clear();
  scene_->zoom(factor);
}

void WindowActions::findNames() {
  scene_->travel().findNames(search.text, [this, text = search.text](std::vector<std::string> names) {
    if (text == search.text) search.names = std::move(names);
  });
}

void WindowActions::lookUnderPointer(double now_s) {
  if (may_click_) pull(now_s);
  if (panels.menu.open || panels.help || panels.search || panels.settings || input_.isDragging() ||
      window_.pointerOnPanel())
    return tooltip_.clear();
  if (!tooltip_.isDue(now_s) || !scene_->travel().isIdle()) return;
  tooltip_.lookUp(scene_->travel(),
                  pickRay(scene_->view(), input_.x(), input_.y(), window_.size(), kTooltip_px * window_.scale()));
}

bool WindowActions::showsForce() const {
  return settings_.show_force.value_or(scene_ != nullptr && scene_->travel().session().deviceName() != "mouse");
}

void WindowActions::fill(PanelData& d) const {
  d.force.shown = showsForce();
  d.status.frozen = frozen_;
  if (awaiting_letter_ != Action::none)
    d.lines.hint =
        awaiting_letter_ == Action::set_bookmark ? "type a letter for the bookmark" : "type the bookmark's letter";
  d.tooltip.text = tooltip_.text();
  d.tooltip.x = input_.x() / window_.pixelsPerPoint();
  d.tooltip.y = input_.y() / window_.pixelsPerPoint();
}

void WindowActions::describe(nlohmann::ordered_json& json) const {
  json["help"] = panels.help;
  json["neurite_menu"] = panels.menu.open ? panels.menu.title + "\n" + panels.menu.text : "";
  json["force_panel"] = showsForce();
  json["search"] = panels.search;
  json["commands"] = panels.commands.open ? panels.commands.text : "";
  json["commands_open"] = panels.commands.open;
  json["bookmarks_panel"] = panels.bookmarks.open;
  json["search_text"] = search.text;
  json["search_error"] = search.error;
  json["frozen"] = frozen_;
  json["actions"] = acted_;
  json["key_repeats"] = key_repeats_;
  json["last_action"] = last_action_;
  if (scene_ != nullptr) json["tooltip"] = tooltip_.text();
}

}  // namespace filiform::internal
