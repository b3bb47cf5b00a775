// A person's travel through a scene as it happens: device, tiles, navigation and haptic loop together, on threads of
// their own, commanded and watched by one thread (the window's).
//
//   Session session(*set, {.device = "mouse"});
//   session.start();
//   session.jump(place);
//   for (;;) {
//     const NavigationSnapshot& now = session.update();   // never waits
//     session.point(Pointing::at(target_D));              // where the mouse pulls to
//   }
//
// The device "mouse" is a simulated hand (device/simulated_hand.h) whose muscles pull to where the pointer is: so the
// proxy resists and pulls as it does on a haptic device, and the pointer's distance from the hand is the force cue. It
// reaches no farther than the device's box: at its rim the world moves under the hand. A
// recorded session (SessionOptions::record) is played back by the device "replay:FILE", at the same fixed rate, and
// goes through the same states to the bit.
//
// Thread rule: one commanding thread, to which all members belong. Nothing here waits for the disk but finish(), the
// constructor, and advance().
#pragma once

#include "device/haptic_device.h"
#include "index/residency.h"
#include "solver/loop_metrics.h"
#include "solver/navigation_link.h"
#include "solver/workspace.h"

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
  std::optional<double> stiffness_N_m{};        // none: 200, the loose hand 50; hardware as defaultStiffness()
  bool in_memory = false;                       // the store holds its tiles: no residency
  std::optional<std::uint64_t> budget_bytes{};  // none: unlimited
  std::string record{};                         // FILE, and where it is a regular file FILE.json beside it; empty: none
  // Makes `device`, not opened, from its name and the period in s; none: makeDevice().
  std::function<std::unique_ptr<HapticDevice>(const std::string&, double)> make_device{};
};

// What the pointer asks of the hand.
struct Pointing {
  enum class Kind : std::uint8_t {
    rest,  // the hand stays with the proxy, and nothing pulls
    at,    // pulls to a point of frame D
    push,  // pulls to a point that far from the proxy, which so travels on
  };
  Kind kind = Kind::rest;
  Vector3d target_D = Vector3d::Zero();  // m

  static Pointing at(const Vector3d& target_D) { return {Kind::at, target_D}; }
  static Pointing push(const Vector3d& by_D) { return {Kind::push, by_D}; }
};

class Session {
 public:
  // Opens the device. Throws DeviceError and UnknownDevice from it, UsageError for a budget below the floor or options
  // that make no sense, CorruptTile, IoError; InputError for a recording that does not fit the scene.
  Session(const TileStore& store, const SessionOptions& options);
  // Zero force, then everything ends; what was recorded is kept, unless that fails.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  // The haptic loop, and the thread that reads tiles.
  void start();
  // Instead of start(): that many ticks now, in virtual time. Requires a scene in memory, or a replay.
  void advance(std::uint64_t ticks);
  // Ends what start() began, and writes the recording. Throws DeviceError, IoError. Idempotent.
  void finish();

  // The newest snapshot; sends jumps whose tiles have come. A few microseconds.
  const NavigationSnapshot& update();
  const NavigationSnapshot& now() const;

  void point(const Pointing& pointing);
  // False: too many commands at once; try again. While a recording is replayed commands do nothing.
  bool send(const NavigationCommand& command);
  // Constrained at `place`, when its tile has come; replaces a jump that waits. `under_hand`: the world is moved so
  // that the place lies under the hand; otherwise the hand is drawn there.
  void jump(const ProxyPlace& place, bool under_hand = true);
  // The place that a jump waits for.
  std::optional<ProxyPlace> awaited() const;

  bool replaying() const;
  bool replayEnded() const;
  bool hasHand() const;  // the pointer moves it
  const std::string& deviceName() const;
  double stiffness_N_m() const;
  const WorkspaceOptions& workspaceOptions() const;
  // Why the device or the loop ended; empty while all is well.
  std::string fault() const;
  // For the person, once each: what the system refused, jumps that failed.
  std::vector<std::string> takeNotes();
  // Magnitudes (N) of the ticks since the last call, oldest first; the newest 8192 at most.
  void takeForces(std::vector<float>& forces_N);

  std::uint64_t ticks() const;
  std::uint64_t interruptions() const;
  // After finish() only; none without a real-time loop.
  const LoopMetrics* metrics() const;
  // nullptr for a scene in memory and a replay.
  const Residency* residency() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
