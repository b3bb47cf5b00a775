// A person's travel through a scene as it happens: device, tiles, navigation and haptic loop together on their own
// threads. One thread, that of the window, commands and watches it.
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
// proxy holds and pulls this hand as it does a haptic device, so the distance from pointer to hand shows the force. The
// hand stays in the device's box: at the rim the world moves under the hand.
//
// A recorded session (SessionOptions::record) is replayed by the device "replay:FILE", at the recorded rate, through
// bit-identical states.
//
// Thread rule: all members belong to one commanding thread. Only the constructor, advance(), finish() and the
// destructor may wait for the disk.
#pragma once

#include "device/haptic_device.h"
#include "index/streaming/residency.h"
#include "solver/loop/loop_metrics.h"
#include "solver/workspace/navigation_link.h"
#include "solver/workspace/workspace.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

struct SessionOptions {
  std::string device = "mouse";  // or as makeDevice() takes it; simulated hands follow the pointer too
  SolverMethod method = SolverMethod::climb;
  double zoom_um = 300;  // world across 0.12 m of device
  double rate_Hz = 1000;
  std::optional<double> stiffness_N_m{};        // none: 200, with the loose hand 50; hardware: defaultStiffness()
  bool in_memory = false;                       // the store holds its tiles in memory (a small scene): no reads
  std::optional<std::uint64_t> budget_bytes{};  // of decoded tiles; none: unlimited
  // Write the exchanges with the device to this file, and if it is a regular file, the commands to FILE.json. Empty:
  // none.
  std::string record{};
  // Makes `device` from its name and the period (s), not opened. None: makeDevice().
  std::function<std::unique_ptr<HapticDevice>(const std::string&, double)> make_device{};
};

// What the pointer asks of the hand.
struct Pointing {
  enum class Kind : std::uint8_t {
    rest,  // the hand stays with the proxy, without force
    at,    // the hand is pulled to a point of frame D
    push,  // the hand is pulled to a point at this distance from the proxy, so the proxy travels on
  };
  Kind kind = Kind::rest;
  Vector3d target_D = Vector3d::Zero();  // m

  static Pointing at(const Vector3d& target_D) { return {Kind::at, target_D}; }
  static Pointing push(const Vector3d& by_D) { return {Kind::push, by_D}; }
};

class Session {
 public:
  // Opens the device. The store must outlive the session. A replay takes zoom, method, stiffness and rate from its
  // recording. Throws DeviceError and UnknownDevice from the device; UsageError for a budget below the floor and
  // options that make no sense; CorruptTile and IoError from the store; IoError and InputError for a recording whose
  // commands are missing or do not fit the scene.
  Session(const TileStore& store, const SessionOptions& options);
  // As finish(), without exceptions.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // Starts the haptic loop and the thread that reads tiles. Does nothing the second time.
  void start();
  // Instead of start(): computes `ticks` ticks now, in virtual time. Throws std::logic_error unless the scene is in
  // memory or a recording is replayed; in a replay, CorruptTile and IoError.
  void advance(std::uint64_t ticks);
  // Ends what start() began, with zero force, closes the device and writes the recording. Waits for the tile that is
  // being read. Throws DeviceError and IoError. Does nothing the second time.
  void finish();

  // Takes the newest snapshot, and sends a jump whose tile has come. A few microseconds.
  const NavigationSnapshot& update();
  const NavigationSnapshot& now() const;  // as of the last update()

  void point(const Pointing& pointing);
  // False: too many commands wait; try again. During a replay commands are ignored.
  bool send(const NavigationCommand& command);
  // Puts the proxy to `place` as soon as its tile has come; replaces a jump that waits. `under_hand`: the world moves
  // so that the place lies under the hand; otherwise the hand is drawn to the place. Ignored during a replay and for an
  // invalid place.
  void jump(const ProxyPlace& place, bool under_hand = true);
  // The place of the jump that waits for its tile, if there is one.
  std::optional<ProxyPlace> awaited() const;

  bool replaying() const;
  bool replayEnded() const;
  bool hasHand() const;                   // the pointer moves it
  const std::string& deviceName() const;  // for a person
  double stiffness_N_m() const;
  const WorkspaceOptions& workspaceOptions() const;
  // Why the device, the loop or the replay ended; empty while all is well.
  std::string fault() const;
  // For the person, each once: what the system refused, jumps that failed.
  std::vector<std::string> takeNotes();
  // Magnitudes of the force (N) of the ticks since the last call, oldest first; at most 8192, later ones are left out.
  void takeForces(std::vector<float>& forces_N);

  std::uint64_t ticks() const;          // as of the last update()
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
