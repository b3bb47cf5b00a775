// A scene and its device while they are opened, beside the frames: first the scene; then, once the owner has closed the
// one before, the device, which only one session can have. Thread rule: one owner.
#pragma once

#include "solver/travel/place_finder.h"
#include "solver/workspace/saved_history.h"
#include "viewer/gl/scene_view.h"
#include "viewer/window/application.h"

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform::internal {

// A scene that is open, what knows its places, what draws it, and the session in it.
struct Opened {
  OpenedScene scene;
  std::unique_ptr<PlaceFinder> finder;
  std::unique_ptr<SavedHistory> saved;  // nullptr where it cannot be kept
  ProxyPlace start;                     // where the person was last, else the soma of the largest cell
  std::vector<std::string> warnings;
  std::unique_ptr<SceneView> picture;  // none without a renderer
  SessionOptions options;              // of the session
  std::unique_ptr<Session> session;    // not started
};

// The options as they fit the scene.
SessionOptions fitTo(const OpenedScene& scene, SessionOptions options);

class Opening {
 public:
  using Open = std::function<OpenedScene(const std::vector<std::string>&)>;

  // Requires none under way. The renderer must outlive what is opened.
  void begin(const std::vector<std::string>& paths, const Open& open, Renderer& renderer, double now_s);
  bool isUnderWay() const { return scene_.valid() || opened_.has_value(); }
  const std::string& name() const { return name_; }  // of what is opened, for the person
  double since_s() const { return since_s_; }

  bool awaitsScene() const { return scene_.valid(); }
  bool isSceneReady() const;
  void takeScene();  // throws why it cannot be opened. Requires isSceneReady()
  bool awaitsDevice() const { return opened_ && !session_.valid(); }
  void openDevice(const SessionOptions& options);  // requires awaitsDevice()
  bool isReady() const;
  Opened take();  // throws why the device cannot be opened. Requires isReady()

 private:
  std::string name_;
  double since_s_ = 0;
  std::future<Opened> scene_;
  std::optional<Opened> opened_;
  std::future<std::unique_ptr<Session>> session_;  // goes first: it uses the scene
};

}  // namespace filiform::internal
