// What keys, mouse and wheel do: they act on the scene, the panels, the settings and the pictures. Thread rule: the
// window's thread.
#pragma once

#include "viewer/gl/renderer.h"
#include "viewer/window/internal/hand_input.h"
#include "viewer/window/internal/open_scene.h"
#include "viewer/window/panels/panels.h"
#include "viewer/window/settings/internal/messages.h"
#include "viewer/window/travel/internal/screenshots.h"
#include "viewer/window/travel/internal/tooltip.h"
#include "viewer/window/window.h"

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace filiform::internal {

class WindowActions {
 public:
  using Open = std::function<void(const std::vector<std::string>& paths)>;  // for files dropped on the window

  // All references must outlive this object.
  WindowActions(Window& window, const Renderer& renderer, Settings& settings, Messages& messages,
                Screenshots& screenshots, Open open)
      : window_(window),
        renderer_(renderer),
        settings_(settings),
        messages_(messages),
        screenshots_(screenshots),
        open_(std::move(open)) {}

  // Events act on this scene from now on; nullptr: there is none.
  void enter(OpenScene* scene);
  void handle(const InputEvent& event);
  void act(Action action);
  // Once a frame: looks up the neurite under a pointer that rests; begins a pull by a button that is held. Requires a
  // scene.
  void lookUnderPointer(double now_s);
  // Looks up names for the text of `search`. Requires a scene, which calls back before this object ends.
  void findNames();

  // The search found nothing: says why, and gives its field the keyboard again.
  void searchFailed(const std::string& why);

  OpenPanels panels;
  // A field of a panel is to get the keyboard.
  bool wantsKeyboard() const {
    return search.focus || panels.commands.focus || panels.cells.focus || panels.bookmarks.focus;
  }
  SearchPanel search;

  const HandInput& input() const { return input_; }
  bool isQuitting() const { return quitting_; }
  bool isFrozen() const { return frozen_; }
  // What was asked for since the last call: a picture so many times as large as the window, 0: none; a picture of the
  // window with its panels.
  int takePicture() { return std::exchange(picture_wanted_, 0); }
  bool takeView() { return std::exchange(view_wanted_, false); }  // the view as a file
  bool takeWindowPicture() { return std::exchange(window_picture_wanted_, false); }

  // Adds tooltip and hint.
  void fill(PanelData& data) const;
  void describe(nlohmann::ordered_json& state) const;

 private:
  void take(const std::vector<std::string>& paths);
  void pressButton(const InputEvent& event);
  Action dragOf(const InputEvent& event);
  void moved();
  void releaseButton(const InputEvent& event);
  void pull(double now_s);
  void chooseAt(const InputEvent& event);
  void openMenu(const InputEvent& event);
  void press(const Key& key, bool repeated);
  void actInScene(Action action);
  void closeTop();
  void quit();
  void zoom(double factor);
  bool showsForce() const;

  Window& window_;
  const Renderer& renderer_;
  Settings& settings_;
  Messages& messages_;
  Screenshots& screenshots_;
  const Open open_;
  OpenScene* scene_ = nullptr;

  HandInput input_;
  Tooltip tooltip_;
  Action awaiting_letter_ = Action::none;
  // Of a button that is held: a press that neither moves nor lasts is a click. A pull waits for either.
  bool may_click_ = false;
  Action awaiting_pull_ = Action::none;
  InputEvent pressed_;
  bool quitting_ = false, asked_to_quit_ = false, frozen_ = false, window_picture_wanted_ = false, view_wanted_ = false;
  int picture_wanted_ = 0;
  std::uint64_t acted_ = 0, key_repeats_ = 0;
  std::string last_action_;
};

}  // namespace filiform::internal
