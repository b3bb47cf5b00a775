// A user's travel through a scene in real time: device, tiles, navigation and haptic loop together, on their own
// threads. One thread, that of the window, commands and watches the session.
//
//   Session session(*set, {.device = "mouse"});
//   session.start();
//   session.jump(place);
//   for (;;) {
//     const NavigationSnapshot& now = session.update();   // never waits
//     session.point(Pointing::at(target_D));              // where the mouse pulls to
//   }
//
// The device "mouse" is a simulated hand (device/simulated/simulated_hand.h) whose muscles pull to the pointer. The
// proxy holds and pulls this hand like a haptic device, so the distance from pointer to hand shows the force. The hand
// stays in the device's box; at the edge the world moves under the hand.
//
// A recorded session (SessionOptions::record) is replayed by the device "replay:FILE", at the recorded rate, through
// bit-identical states.
//
// A host can tick many sessions on one thread (SessionOptions::shared): instead of start(), that thread calls tick()
// and prepare() once a period.
//
// Thread rule: all members belong to one commanding thread, except tick(), prepare() and graph(), which belong to the
// ticking thread. Only the constructor, advance(), finish() and the destructor may wait for the disk.
#pragma once

#include "device/haptic_device.h"
#include "index/streaming/residency.h"
#include "solver/loop/loop_metrics.h"
#include "solver/travel/hand/shared_tiles.h"
#include "solver/travel/session/pointing.h"
#include "solver/workspace/button_map.h"
#include "solver/workspace/navigation_link.h"
#include "solver/workspace/workspace.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

class GraphView;

struct SessionOptions {
  std::string device = "mouse";  // or as makeDevice() takes it; simulated hands follow the pointer too
  SolverMethod method = SolverMethod::climb;
  double zoom_um = 300;  // world across 0.12 m of device
  double leap = 1;       // 0 to 1: see NavigationOptions
  double rate_Hz = 1000;
  std::optional<double> stiffness_N_m{};  // none: 200, with the loose hand 50; hardware: defaultStiffness()
  // The buttons of a device that was opened; none: defaultButtons(). A replay takes them from its recording.
  std::function<std::optional<ButtonMap>(const DeviceCapabilities&)> buttons{};
  bool in_memory = false;                       // the store has all tiles in memory (a small scene): no reads
  std::optional<std::uint64_t> budget_bytes{};  // of decoded tiles; none: unlimited
  // The tiles of a host that ticks this session and others; budget_bytes is then ignored. They must outlive the
  // session.
  SharedTiles shared{};
  // Write the exchanges with the device to this file; if it is a regular file, also write the commands to FILE.json.
  // Empty: no recording.
  std::string record{};
  // Called by finish() after the recording is written, before it waits for reads that may hang. Must not throw.
  std::function<void()> ending{};
  // Makes `device` from its name and the period (s), not opened. None: makeDevice().
  std::function<std::unique_ptr<HapticDevice>(const std::string&, double)> make_device{};
};

class Session {
 public:
  // Opens the device. The store must outlive the session. A replay takes zoom, method, stiffness and rate from its
  // recording. Throws DeviceError and UnknownDevice from the device; UsageError for a budget below the minimum and for
  // inconsistent options; CorruptTile and IoError from the store; IoError and InputError for a recording whose commands
  // are missing or do not fit the scene.
  Session(const TileStore& store, const SessionOptions& options);
  // Like finish(), but ignores exceptions.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Starts the haptic loop and the thread that reads tiles. Further calls do nothing.
  void start();
  // Instead of start(): computes `ticks` ticks now, in virtual time. Throws std::logic_error unless the scene is in
  // memory or a recording is replayed; in a replay, CorruptTile and IoError.
  void advance(std::uint64_t ticks);
  // With SessionOptions::shared: exchanges with the device and computes a tick over the time since its last state. The
  // result is valid until the next tick. Haptic-safe.
  const NavigationSnapshot& tick() noexcept;
  // With SessionOptions::shared, after each tick: see Navigation::prepare(). Haptic-safe.
  void prepare(double free_s) noexcept;
  const GraphView& graph() const noexcept;
  // With SessionOptions::shared and a recording, at least every few seconds: writes what was recorded. Throws
  // DeviceError.
  void drainRecording();

  // Ends the loop with zero force, closes the device and writes the recording. Waits for the tile that is being read.
  // Throws DeviceError and IoError. Further calls do nothing.
  void finish();

  // Takes the newest snapshot. Sends a waiting jump if its tile is in memory. Takes a few microseconds.
  const NavigationSnapshot& update();
  const NavigationSnapshot& now() const;  // of the last update()

  void point(const Pointing& pointing);
  // Returns false if too many commands wait; try again later. During a replay commands are ignored.
  bool send(const NavigationCommand& command);
  // Moves the proxy to `place` as soon as its tile is in memory, and for a jump to another cell with a force-based
  // method, as soon as that cell was read. Replaces a jump that waits. `under_hand`: the world moves so that the place
  // lies under the hand; otherwise the force draws the hand to the place. Ignored during a replay and for an invalid
  // place.
  void jump(const ProxyPlace& place, bool under_hand = true);
  // The place of the jump that waits for its tile; nullopt if no jump waits.
  std::optional<ProxyPlace> awaited() const;

  bool replaying() const;
  bool replayEnded() const;
  bool waitsForFailedTile() const;        // of the last update(): the proxy rests at a tile that cannot be read
  bool hasHand() const;                   // there is a simulated hand, which the pointer moves
  const std::string& deviceName() const;  // for the user
  double stiffness_N_m() const;
  const WorkspaceOptions& workspaceOptions() const;
  // Why the device, the loop or the replay ended by itself; empty if all is well.
  std::string fault() const;
  // New notes for the user: settings that the system refused, and jumps that failed. Returns each note once.
  std::vector<std::string> takeNotes();
  // Magnitudes (N) of the forces since the last call, oldest first. At most 8192; later ones are left out.
  void takeForces(std::vector<float>& forces_N);

  std::uint64_t ticks() const;          // of the last update()
  std::uint64_t interruptions() const;  // of the haptic loop
  // nullptr before finish(), and without a real-time loop.
  const LoopMetrics* metrics() const;
  // nullptr for a scene in memory and during a replay.
  const Residency* residency() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
