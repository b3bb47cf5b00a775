// `filiform view`: a scene in a window, travelled by hand. Everything on the screen and under the hand comes together
// here: window, session, picture, panels, places. Thread rule: the main thread.
#pragma once

#include "index/set/levels.h"
#include "index/set/tile_store.h"
#include "solver/travel/session.h"
#include "viewer/gl/renderer.h"
#include "viewer/window/settings.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct OpenedScene {
  std::unique_ptr<TileStore> store;
  std::unique_ptr<Levels> levels;  // of the store; none: nullptr
  bool in_memory = false;
  std::string name;  // for the person, and for what is kept of it
};

struct ApplicationOptions {
  std::vector<std::string> paths;                                      // to open at first; empty: none
  std::function<OpenedScene(const std::vector<std::string>&)> open;    // not on the main thread
  std::function<void(const Picture&, const std::string& path)> write;  // a picture; not on the main thread
  std::function<void()> poll = [] {};                                  // once a frame; may throw to end
  std::function<bool(const std::string&)> plugged_in;  // see internal::Travel: a lost device is looked for; any thread
  std::function<void()> ending = [] {};  // before its threads are waited for, which a read that hangs can hold up
  SessionOptions session;
  std::optional<PictureSize> size;  // else the settings'
  std::uint64_t segments = 0;       // drawn at most; 0: by the renderer
  bool reset = false;               // settings as at first
  std::string state;                // file for the state dump; empty: none
  std::string pictures = ".";       // folder for screenshots
  std::optional<double> seconds;    // ends by itself
};

// Until the person quits. What goes wrong with a scene or a device is said in the window; throws GraphicsError where
// there is no window, and what the first scene cannot be opened for.
void runApplication(const ApplicationOptions& options);

}  // namespace filiform
