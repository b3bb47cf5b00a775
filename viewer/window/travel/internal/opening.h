// Opens a scene and its device beside the frames. The scene comes first. The owner then closes the scene before,
// because only one session can have the device, and has the device opened. Thread rule: one owner.
#pragma once

#include "solver/travel/places/place_finder.h"
#include "solver/travel/session/session.h"
#include "solver/workspace/saved_history.h"
#include "viewer/gl/scene_view.h"
#include "viewer/window/travel/opened_scene.h"

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

// An opened scene with its place finder, its picture and its session.
struct Opened {
  OpenedScene scene;
  std::unique_ptr<PlaceFinder> finder;
  std::unique_ptr<SavedHistory> saved;  // nullptr: history and bookmarks cannot be kept
  ProxyPlace start;                     // the user's last place, else one that opening chose
  std::vector<std::string> warnings;
  std::unique_ptr<SceneView> picture;  // nullptr without a renderer
  SessionOptions options;              // with which the session was made
  std::unique_ptr<Session> session;    // started
};

// Adapts the options to the scene: a scene in memory has no tile budget.
SessionOptions fitTo(const OpenedScene& scene, SessionOptions options);

class Opening {
 public:
  using Open = std::function<OpenedScene(const std::vector<std::string>&)>;

  // Begins to open a scene at a place, as the search field takes it; empty: the user's last place. Requires
  // !isUnderWay(). The renderer must outlive the opened scene.
  void begin(const std::vector<std::string>& paths, const std::string& place, const Open& open, Renderer& renderer,
             double now_s);
  bool isUnderWay() const { return scene_.valid() || opened_.has_value(); }
  const std::string& name() const { return name_; }  // of the scene, for the user
  double since_s() const { return since_s_; }

  bool awaitsScene() const { return scene_.valid(); }
  bool isSceneReady() const;
  void takeScene();  // throws the reason if it cannot be opened; requires isSceneReady()
  bool awaitsDevice() const { return opened_ && !session_.valid(); }
  void openDevice(const SessionOptions& options);  // requires awaitsDevice()
  bool isReady() const;
  Opened take();  // throws the reason if the device cannot be opened; requires isReady()

 private:
  std::string name_;
  double since_s_ = 0;
  std::future<Opened> scene_;
  std::optional<Opened> opened_;
  std::future<std::unique_ptr<Session>> session_;  // destroyed first: it uses the scene
};

}  // namespace filiform::internal
