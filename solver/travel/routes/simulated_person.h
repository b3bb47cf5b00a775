// A simulated person who sees the proxy and wants it to travel a route. In each tick the person decides where the hand
// pulls to. The hand's mechanics are a device (device/simulated/simulated_hand.h).
//
// The aim moves ahead of the proxy along the route. If the proxy does not follow, the person pushes further: at the
// first try along the route, at the next try straight on from the proxy. If that fails, the person backs off (the aim
// returns to the proxy) and tries again. The error of the aim is constant during a run; backing off cancels it, because
// the hand then yields to the force. Tremor is added last. The result depends only on the seed and is the same on every
// machine: the only library function is the square root. Thread rule: haptic thread only; target_D is haptic-safe.
#pragma once

#include "solver/travel/routes/route.h"
#include "solver/workspace/workspace.h"

#include <cstdint>
#include <random>

#include <Eigen/Core>

namespace filiform {

struct PersonParameters {      // lengths are of the device (m), at any zoom
  double speed_m_s = 0.05;     // of the aim; exploring hands move at 0.02 to 0.15 m/s
  double lookahead_m = 0.008;  // greatest arc length from proxy to aim
  double tail_m = 0.0005;      // how far the aim goes past the tip; more would find neighbours of short twigs
  double arrive_m = 0.0005;    // arrived within this arc length of the tip
  // The following values are assumptions; they were not measured on persons.
  double progress_m = 0.0005;    // a shorter advance is no progress
  double stuck_after_s = 1.0;    // time without progress before the person pushes
  double push_speed_m_s = 0.02;  // growth of the push
  double push_most_m = 0.03;     // greatest push, in addition to the look-ahead
  double hold_s = 1.0;           // time at the full push, before backing off
  double back_off_s = 0.5;       // time in which the aim returns to the proxy
  int tries = 6;                 // back-offs without progress before the person gives up
  // Tremor: an Ornstein-Uhlenbeck process on each axis. 0 rms: none.
  double tremor_rms_m = 0.0005;
  double tremor_time_s = 0.15;
  // Distance (m) between the point that the person wants and the point to which the hand pulls: an error of depth
  // perception. The seed gives its direction, once, within 36 degrees of the depth axis (z of frame D). 0: none.
  double aim_error_m = 0;
};

enum class PersonStatus : std::uint8_t { travelling, pushing, backing_off, arrived, gave_up };
const char* toString(PersonStatus status);

class SimulatedPerson {
 public:
  // The route must outlive the person. Throws UsageError for parameters that are negative or not finite; also for zero
  // times, speeds, tries, and distances other than tail, tremor and aim error.
  SimulatedPerson(const Route& route, const PersonParameters& parameters, std::uint64_t seed);

  // One tick: returns the point to which the hand shall pull (m, frame D; within the device's box). O(log route).
  Eigen::Vector3d target_D(const ProxyPlace& proxy, const Workspace& workspace, double dt_s) noexcept;

  PersonStatus status() const { return status_; }
  double reached_um() const { return tracker_.reached_um(); }  // see RouteTracker
  int back_offs() const { return back_offs_; }                 // in total

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
  double phase_s_ = 0;        // time at the full push, or since the start of backing off
  double push_m_ = 0;
  int tries_ = 0, back_offs_ = 0;
  Eigen::Vector3d tremor_m_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d aim_error_m_ = Eigen::Vector3d::Zero();
  bool straight_ = false;  // this try pulls straight on from the proxy
  bool trembles_ = false;  // the tremor has a first value
};

}  // namespace filiform
