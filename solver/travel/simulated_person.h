// A person who sees the proxy and wants it to travel a route: decides, tick by tick, where the hand pulls to. The
// hand's own mechanics are a device (device/simulated/simulated_hand.h).
//
// The aim runs ahead of the proxy along the route. Where the proxy does not follow, the person pushes further: first on
// along the route, at the next try straight on from the proxy; when that fails the aim is led back to the proxy, and
// the person tries again. The error of the aim is constant over a run; backing off takes it out, because the hand then
// yields to the force. Tremor is added last. Deterministic by seed: the same numbers on every machine (no library
// function but the square root). Thread rule: haptic thread only; target_D is haptic-safe.
#pragma once

#include "solver/travel/route.h"
#include "solver/workspace/workspace.h"

#include <cstdint>
#include <random>

#include <Eigen/Core>

namespace filiform {

struct PersonParameters {      // lengths are of the device (m), whatever the zoom
  double speed_m_s = 0.05;     // of the aim; exploring hands move at 0.02 to 0.15 m/s
  double lookahead_m = 0.008;  // the aim is at most so far ahead of the proxy, as arc length
  double tail_m = 0.0005;      // the aim goes so far past the tip: more finds neighbouring neurites of short twigs
  double arrive_m = 0.0005;    // arrived within this arc length of the tip
  // Assumptions of ours, not measured on persons:
  double progress_m = 0.0005;    // less than this is no progress
  double stuck_after_s = 1.0;    // without progress: begin to push
  double push_speed_m_s = 0.02;  // how fast the push grows
  double push_most_m = 0.03;     // beyond the look-ahead
  double hold_s = 1.0;           // at the full push, before backing off
  double back_off_s = 0.5;       // over which the aim is led back to the proxy
  int tries = 6;                 // back-offs without progress between them, before giving up
  // Tremor: an Ornstein-Uhlenbeck process on each axis. 0 rms: none.
  double tremor_rms_m = 0.0005;
  double tremor_time_s = 0.15;
  // The hand pulls so far (m) beside where the person means to pull: an error of depth perception. Its direction is
  // drawn once by the seed, within 36 degrees of the depth axis (z of frame D). 0: none.
  double aim_error_m = 0;
};

enum class PersonStatus : std::uint8_t { travelling, pushing, backing_off, arrived, gave_up };
const char* toString(PersonStatus status);

class SimulatedPerson {
 public:
  // The route must outlive the person. Throws UsageError for parameters that are negative or not finite, and for times,
  // speeds, distances (but the tail) and tries that are 0.
  SimulatedPerson(const Route& route, const PersonParameters& parameters, std::uint64_t seed);

  // One tick: sees the proxy, and answers where the hand shall pull to (m, frame D; within the device's box). O(log
  // route).
  Eigen::Vector3d target_D(const ProxyPlace& proxy, const Workspace& workspace, double dt_s) noexcept;

  PersonStatus status() const { return status_; }
  double reached_um() const { return tracker_.reached_um(); }  // see RouteTracker
  int back_offs() const { return back_offs_; }                 // all of them

 private:
  void decide(const Route::Progress& seen, double scale_um_m, double dt_s) noexcept;
  double normal() noexcept;

  const Route& route_;
  PersonParameters parameters_;
  std::mt19937_64 random_;
  RouteTracker tracker_;
  PersonStatus status_ = PersonStatus::travelling;
  double aim_um_ = 0;         // arc length of the aim
  double best_um_ = 0;        // arc length at the last progress of this try
  double furthest_um_ = 0;    // arc length at the last progress beyond all tries
  double no_progress_s_ = 0;  // in this try
  double phase_s_ = 0;        // at full push, or backing off
  double push_m_ = 0;
  int tries_ = 0, back_offs_ = 0;
  Eigen::Vector3d tremor_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d aim_error_m_ = Eigen::Vector3d::Zero();
  bool straight_ = false;  // this try
  bool trembles_ = false;
};

}  // namespace filiform
