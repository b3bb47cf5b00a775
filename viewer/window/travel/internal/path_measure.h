// Measures the distance from a start place to the proxy, straight and along the cell. Thread rule: one owner.
#pragma once

#include "solver/proxy/proxy_solver.h"
#include "solver/travel/places/cell_walk.h"

#include <optional>
#include <string>

namespace filiform::internal {

class PathMeasure {
 public:
  void begin(const ProxyPlace& from);
  void end() { *this = {}; }
  bool isOn() const { return from_.has_value(); }

  // True: `to` is valid and differs from the last measured place.
  bool isBehind(const ProxyPlace& to) const;
  // Measures to this place. `walk` must be of the cell of `to`. O(samples log samples).
  void measure(const ProxyPlace& to, const CellWalk& walk);

  std::string text() const;  // for the user; empty if it is off
  std::optional<double> path_um() const { return isOn() ? path_um_ : std::nullopt; }

 private:
  std::optional<ProxyPlace> from_, to_;
  std::optional<double> path_um_;
  std::string text_;
};

}  // namespace filiform::internal
