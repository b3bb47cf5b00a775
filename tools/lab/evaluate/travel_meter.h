// How honestly a proxy travels a route: the arc that it wanders off it, and the arc that it leaps over. Thread rule:
// thread-compatible.
#pragma once

#include "solver/travel/route.h"
#include "tools/lab/evaluate/trial_cell.h"

namespace filiform::tools {

class TravelMeter {
 public:
  // A move along the route is a leap if it passes more than this of it within a tick (m of the device), and more than
  // kLeapChords times the straight line between its ends.
  static constexpr double kLeap_m = 0.001;
  static constexpr double kLeapChords = 2;

  // Cell and route must outlive it.
  TravelMeter(const TrialCell& cell, const Route& route, double scale_um_m)
      : cell_(cell), route_(route), leap_um_(kLeap_m * scale_um_m) {}

  // The proxy's place after each tick. O(nodes between it and the last one).
  void update(const ProxyPlace& place) noexcept;

  double off_um() const { return off_um_; }    // arc travelled off the route: of each move, what is not along the route
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
