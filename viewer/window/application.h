// `filiform view`: the window in which a user travels through a scene by hand. Connects window, session, picture,
// panels and places. Thread rule: the main thread.
#pragma once

#include "solver/travel/session/session.h"
#include "viewer/gl/renderer.h"
#include "viewer/scene/view_state.h"
#include "viewer/window/settings/settings.h"
#include "viewer/window/travel/companion.h"
#include "viewer/window/travel/opened_scene.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct ApplicationOptions {
  std::vector<std::string> paths;                                      // the first scene; empty: none
  std::function<OpenedScene(const std::vector<std::string>&)> open;    // opens a scene; runs on another thread
  std::function<void(const Picture&, const std::string& path)> write;  // writes a picture; runs on another thread
  std::function<void()> poll = [] {};                                  // runs once a frame; may throw to end
  // Runs once a frame of an open scene, and must not wait. Returns lines for the user.
  std::function<std::vector<std::string>(const OpenedScene&, const NavigationSnapshot&)> observe;
  // Returns whether a lost device, by the value of --device, could be opened now; runs on another thread. Empty: lost
  // devices are not looked for.
  std::function<bool(const std::string&)> plugged_in;
  std::string awaited_device;  // replaces the mouse as soon as `plugged_in` returns true for it; empty: none
  // Runs before the program waits for its threads. A read that hangs can delay them without end.
  std::function<void()> ending = [] {};
  SessionOptions session;
  std::string place;                // where the first scene begins, as the search field takes it; empty: the last place
  std::optional<PictureSize> size;  // none: that of the settings
  std::uint64_t segments = 0;       // draw at most this many; 0: by the time of frames, see FrameGovernor
  std::string colour_by;            // of the first scene: ColourBy, an attribute or measure:FEATURE; empty: the setting
  std::optional<ViewState> view;    // the first scene is to show; its place, zoom and colours are given above
  bool reset = false;               // start with default settings
  std::optional<Theme> theme;       // replaces the setting
  std::string state;                // file for the state; empty: none
  std::string pictures = ".";       // folder for screenshots
  std::string tables;               // folder for bookmarks as CSV; empty: they go by the clipboard
  std::optional<double> seconds;    // end this long after the first scene was opened; none: when the user quits
};

// The window by single frames, for a host that has a loop of its own.
class Application {
 public:
  // Opens the window, and begins to open the first scene. The options must outlive it. Throws as runApplication().
  explicit Application(const ApplicationOptions& options);
  ~Application();
  Application(const Application&) = delete;
  Application& operator=(const Application&) = delete;

  // Handles input and draws a frame. Returns false once the user has quit or the time is over. Throws the reason if the
  // first scene cannot be opened.
  bool step();
  // Ends scene and devices, and saves the settings. Throws DeviceError. Call it once, after the last step().
  void finish();

  // Saves the settings if they have changed, for a host that may end without finish(). A failure becomes a message.
  void keep();
  // Shows this companion from the next frame on; nullopt: none. Numbers that are not finite show none.
  void accompany(const std::optional<Companion>& companion);
  // Shows a message in the window, one line.
  void say(const std::string& text);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// Runs the window until the user quits. Failures of a scene or device become messages in the window. Throws
// GraphicsError if no window can be opened; the reason if the first scene cannot be opened; and DeviceError, at the
// end, if something could not be closed or saved.
void runApplication(const ApplicationOptions& options);

}  // namespace filiform
