// Measures how exactly a proxy travels a route: the arc travelled off the route, and the arc leapt over. Thread rule:
// thread-compatible.
#pragma once

#include "solver/travel/routes/route.h"
#include "tools/lab/evaluate/trials/trial_cell.h"

namespace filiform::tools {

class TravelMeter {
 public:
  // A move along the route is a leap if, in one tick, it passes more than kLeap_m of the route (on the device) and more
  // than kLeapChords times the straight line between its ends.
  static constexpr double kLeap_m = 0.001;
  static constexpr double kLeapChords = 2;

  // Cell and route must outlive it.
  TravelMeter(const TrialCell& cell, const Route& route, double scale_um_m)
      : cell_(cell), route_(route), leap_um_(kLeap_m * scale_um_m) {}

  // Takes the proxy's place after each tick. O(nodes between this place and the last).
  void update(const ProxyPlace& place) noexcept;

  double off_um() const { return off_um_; }    // arc travelled off the route: the part of each move not along the route
  double skip_um() const { return skip_um_; }  // arc of the route that leaps passed over, in either direction

 private:
  double distance(const ProxyPlace& a, const ProxyPlace& b) const noexcept;
  double depth(const ProxyPlace& place) const noexcept;

  const TrialCell& cell_;
  const Route& route_;
  double leap_um_;
  ProxyPlace last_;
  double last_arc_um_ = 0;
  double off_um_ = 0, skip_um_ = 0;
};

}  // namespace filiform::tools
