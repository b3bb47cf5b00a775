// The user's travel through one open scene: the session, and the commands that move the proxy. Commands are jumps,
// steps along the cell, names, bookmarks, and a simulated hand that travels to a tip. It also finds the fork ahead.
// Work that may read the disk runs on a worker thread; a later serve() takes up the result.
//
// A failure becomes a message, and the travel goes on. Thread rule: one owner, the window's thread; callbacks run on
// it.
#pragma once

#include "solver/travel/session/session.h"
#include "solver/travel/session/worker.h"
#include "viewer/scene/cell_palette.h"
#include "viewer/scene/glyph.h"
#include "viewer/scene/pointer.h"
#include "viewer/window/panels/internal/tile_census.h"
#include "viewer/window/settings/bindings.h"
#include "viewer/window/settings/internal/messages.h"
#include "viewer/window/travel/internal/hand_path.h"
#include "viewer/window/travel/internal/opening.h"
#include "viewer/window/travel/internal/path_measure.h"
#include "viewer/window/travel/internal/seen_neurite.h"
#include "viewer/window/travel/internal/session_keeper.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace filiform::internal {

class Travel {
 public:
  struct Callbacks {
    std::function<void()> jumps;                            // right before the proxy jumps
    std::function<void(const std::string&)> finds_nothing;  // a place was not found: the reason
    // Returns whether `--device NAME` could be opened now. Runs on another thread. None: a lost device is not looked
    // for.
    std::function<bool(const std::string&)> plugged_in{};
    std::string awaited_device{};  // replaces the mouse once `plugged_in` returns true for it; empty: none
  };

  // `messages` must outlive it. Requires a session that is not started.
  Travel(Opened opened, Messages& messages, Callbacks callbacks);
  // Ends the session, ignores its failures, and waits for the work under way.
  ~Travel();

  // Jumps to the first place of the scene, or to the first cell of those that are shown alone.
  void start();
  // Ends the session, waits for replaced sessions to end, and saves history and bookmarks. May wait for the disk and
  // the device. May run on any thread; then no other thread may use the object, except const members that read nothing
  // from the disk. Throws DeviceError, CorruptSet, IoError. Idempotent.
  void finish();

  // Call these three once a frame, in this order. Takes up the results of the haptic loop and of the worker.
  void serve();
  // Moves the hand as the user points; else along the path of the simulated hand, if it is under way.
  void lead(const std::optional<Pointing>& pointing, const Workspace& workspace);
  // Updates the cell's name, the fork ahead and the measured path for the proxy's place.
  void observe();

  const NavigationSnapshot& now() const { return sessions_.current().now(); }
  const Session& session() const { return sessions_.current(); }
  const OpenedScene& scene() const { return opened_.scene; }
  const TileStore& store() const { return *opened_.scene.store; }
  const PlaceFinder& finder() const { return *opened_.finder; }
  NavigationHistory& history() { return opened_.saved ? opened_.saved->history() : unsaved_; }
  const NavigationHistory& history() const { return opened_.saved ? opened_.saved->history() : unsaved_; }

  // Does an action that moves hand or proxy, or centres the workspace. False: the action is none of these.
  bool act(Action action);
  void turn(const Turn& turn);
  void turnTo(const Eigen::Quaterniond& rotation_WD);
  void zoom(double factor);
  void stopHand() { path_.end(); }  // the simulated hand

  // Look up a place on the worker thread, and jump to it.
  void goAlong(const RayQuery& ray);
  void goTo(const CellQuery& query);
  void goToCell(std::uint32_t cell);  // its soma
  void goToPlace(std::uint32_t cell, const CellPlace& place);
  void goNear(const Vector3d& p_W);
  void goToFound(const ProxyPlace& place) { go(place, true); }

  void savePlaces();  // bookmarks and history, on the worker's thread; a failure becomes a message
  // Runs work on the worker's thread; a failure becomes a message.
  void ask(Worker::Work work) { worker_->ask(std::move(work)); }
  bool isLeaving() const { return leaving_; }  // for long work: any thread

  // The first finds names of cells that match; the second looks up the neurite on a line of sight (nullopt: none). Both
  // call back from a later serve(). `whole`: also read the cell of a set at an address for its type and radius.
  void findNames(const std::string& text, std::function<void(std::vector<std::string>)> found);
  using Seen = std::function<void(const std::optional<SeenNeurite>&)>;
  void lookAlong(const RayQuery& ray, bool whole, Seen seen);
  // Lines of sight pass through cells that these states hide; nullptr: through none.
  void setStates(const std::shared_ptr<const CellStates>& states) { states_ = states; }
  // Lists the tiles nearest to the proxy, and calls back from a later serve(). No effect while a list is being made.
  void listTiles(std::function<void(std::vector<NearTile>)> listed);
  bool isIdle() const { return worker_->idle(); }  // the worker has nothing to do

  const std::string& cellName() const { return cell_name_; }
  const std::string& neurite() const { return neurite_; }         // kindText() of the proxy's place
  std::optional<std::int64_t> sample() const { return sample_; }  // id of the sample nearest to the proxy
  const Vector3d& heading_W() const { return heading_W_; }        // with which the fork was looked for
  const Junction* junction() const { return junction_ ? &*junction_ : nullptr; }
  std::string measured() const { return measure_.text(); }
  const std::vector<float>& forces_N() const { return forces_; }         // of the last seconds, oldest first
  const std::vector<Vector3d>& visited_W() const { return visited_W_; }  // oldest first

  void describe(nlohmann::ordered_json& state) const;

 private:
  void rememberPlace();
  void watch();
  void go(const ProxyPlace& place, bool remember);
  void goWhenFound(std::function<ProxyPlace()> find);
  void constrain();
  void goBack();
  void goForward();
  void step(Action action);
  void nextLeap();
  void toggleSimulatedHand(bool same_type);
  std::optional<ProxyPlace> pick(const RayQuery& ray, const CellStates* states) const;
  void toggleMeasure();
  const CellWalk* walk();
  void nameCell();
  void lookForFork();
  Messages& messages_;
  Callbacks callbacks_;
  Opened opened_;
  NavigationHistory unsaved_;
  SessionKeeper sessions_;

  std::shared_ptr<const CellWalk> walk_;
  std::uint32_t walk_cell_ = UINT32_MAX, walk_asked_ = UINT32_MAX;
  std::string cell_name_, neurite_;
  std::optional<ProxyPlace> named_at_;
  std::shared_ptr<const CellStates> states_;
  std::shared_ptr<const CellWalk> seen_walk_;  // of the cell looked at last; the worker's
  std::uint32_t seen_cell_ = UINT32_MAX;
  std::optional<std::int64_t> sample_;
  std::vector<std::uint32_t> tips_;
  std::size_t tips_at_ = 0;
  Vector3d last_tip_ = Vector3d::Constant(NAN);
  PathMeasure measure_;
  HandPath path_;
  std::optional<Junction> junction_;
  std::optional<ProxyPlace> junction_at_;
  double junction_zoom_um_ = 0;
  Vector3d heading_W_ = Vector3d::Zero();
  bool junction_asked_ = false, replay_told_ = false;
  std::uint32_t asked_constrain_ = 0, asked_back_ = 0, asked_forward_ = 0;
  TileCensus census_;
  bool listing_ = false;
  std::vector<float> forces_, new_forces_;
  std::vector<Vector3d> visited_W_;
  std::uint64_t jumps_ = 0;
  std::atomic<bool> leaving_{false};  // the worker stops reading a cell
  std::unique_ptr<Worker> worker_;    // destroyed first: its work uses the rest
};

}  // namespace filiform::internal
