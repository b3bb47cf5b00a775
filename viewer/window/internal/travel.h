// A person's way through one open scene: the session under the hand, and all that finds places for it: jumps, steps
// along the cell, names, bookmarks, the fork ahead, a simulated hand's tour. What may read the disk is done on a thread
// beside the frames, and its result taken up by a later serve().
//
// What goes wrong is said (Messages) and the travel goes on. Thread rule: one owner, the window's thread; the callbacks
// come on it.
#pragma once

#include "solver/travel/session.h"
#include "solver/travel/worker.h"
#include "viewer/scene/glyph.h"
#include "viewer/scene/pointer.h"
#include "viewer/window/bindings.h"
#include "viewer/window/internal/closing.h"
#include "viewer/window/internal/hand_path.h"
#include "viewer/window/internal/messages.h"
#include "viewer/window/internal/opening.h"
#include "viewer/window/internal/path_measure.h"
#include "viewer/window/internal/tile_census.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace filiform::internal {

class Travel {
 public:
  struct Callbacks {
    std::function<void()> jumps;                            // right before the proxy is taken elsewhere
    std::function<void(const std::string&)> finds_nothing;  // what was asked for leads nowhere
    // Whether what --device takes by that name could be opened now; on another thread. None: a lost device is not
    // looked for.
    std::function<bool(const std::string&)> plugged_in{};
  };

  // `messages` must outlive it. Requires a session, not started.
  Travel(Opened opened, Messages& messages, Callbacks callbacks);
  // Ends the session, its failures unheard, and waits for the work under way.
  ~Travel();

  // The hand's loop, and the jump to the scene's first place.
  void start();
  // Ends the session, waits for those that were replaced, and saves history and bookmarks. May wait for the disk and
  // the device; may run on another thread than the window's, which then calls nothing but the destructor and const
  // members that do not look for places. Throws DeviceError, CorruptSet, IoError. Idempotent.
  void finish();

  // Once a frame, in this order. Takes up what came from the hand and from the finished works.
  void serve();
  // The hand does that; else what the tour asks for.
  void lead(const std::optional<Pointing>& pointing, const Workspace& workspace);
  // The cell's name, the fork ahead and the measured path catch up with the proxy.
  void observe();

  const NavigationSnapshot& now() const { return session_->now(); }
  const Session& session() const { return *session_; }
  const OpenedScene& scene() const { return opened_.scene; }
  const TileStore& store() const { return *opened_.scene.store; }
  NavigationHistory& history() { return opened_.saved ? opened_.saved->history() : unsaved_; }

  // What that action does to hand, proxy or world, if it is one of those; else false.
  bool act(Action action);
  void turn(const Turn& turn);
  void zoom(double factor);
  void endTour() { path_.end(); }

  // Jumps to what is found there.
  void goAlong(const RayQuery& ray);
  void goTo(const CellQuery& query);
  void goNear(const Vector3d& p_W);
  void setBookmark(const std::string& name);
  void goToBookmark(const std::string& name);

  // Names of cells that fit, cells and samples that a line of sight meets: told when they are found.
  void findNames(const std::string& text, std::function<void(std::vector<std::string>)> found);
  void describeAlong(const RayQuery& ray, std::function<void(std::string)> described);
  // The tiles nearest to the proxy. Without effect while an earlier list is being made.
  void listTiles(std::function<void(std::vector<NearTile>)> listed);
  bool isIdle() const { return worker_->idle(); }  // nothing is looked for

  const std::string& cellName() const { return cell_name_; }
  std::optional<std::int64_t> sample() const { return sample_; }  // nearest to the proxy, its id in the file
  const Junction* junction() const { return junction_ ? &*junction_ : nullptr; }
  std::string measured() const { return measure_.text(); }
  const std::vector<float>& forces_N() const { return forces_; }         // of the last seconds, oldest first
  const std::vector<Vector3d>& visited_W() const { return visited_W_; }  // oldest first

  void describe(nlohmann::ordered_json& state) const;

 private:
  // On the worker's thread. A failure is said.
  void savePlaces();
  void rememberPlace();
  void watch();
  void replaceDevice(const std::string& fault);
  void lookForLostDevice();
  void takeBackLostDevice();
  void replaceSession(SessionOptions options);
  void finishReplacing();
  void go(const ProxyPlace& place, bool remember);
  void goWhenFound(std::function<ProxyPlace()> find);
  void constrain();
  void goBack();
  void goForward();
  void step(Action action);
  void startTour();
  void toggleMeasure();
  const CellWalk* walk();
  void nameCell();
  void lookForFork();
  const PlaceFinder& finder() const { return *opened_.finder; }

  Messages& messages_;
  Callbacks callbacks_;
  SessionOptions options_;
  Opened opened_;
  NavigationHistory unsaved_;
  std::unique_ptr<Session> session_;
  // The session that takes its place, while its device is opened.
  std::future<std::unique_ptr<Session>> replacement_;
  SessionOptions replacement_options_;
  Closing closing_;  // of replaced sessions

  std::shared_ptr<const CellWalk> walk_;
  std::uint32_t walk_cell_ = UINT32_MAX, walk_asked_ = UINT32_MAX;
  std::string cell_name_;
  std::optional<std::int64_t> sample_;
  std::vector<std::uint32_t> tips_;
  std::size_t tips_at_ = 0;
  Vector3d last_tip_ = Vector3d::Constant(NAN);
  PathMeasure measure_;
  HandPath path_;
  std::optional<Junction> junction_;
  std::optional<ProxyPlace> junction_at_;
  double junction_zoom_um_ = 0;
  bool junction_asked_ = false, replay_told_ = false, fault_told_ = false;
  std::string lost_device_;  // as --device takes it; empty: none
  std::chrono::steady_clock::time_point look_again_{}, replace_again_{};
  bool looking_ = false;
  std::uint32_t asked_constrain_ = 0, asked_back_ = 0, asked_forward_ = 0;
  TileCensus census_;
  bool listing_ = false;
  std::vector<float> forces_, new_forces_;
  std::vector<Vector3d> visited_W_;
  std::uint64_t jumps_ = 0;
  std::unique_ptr<Worker> worker_;  // goes first: its works use the rest
};

}  // namespace filiform::internal
