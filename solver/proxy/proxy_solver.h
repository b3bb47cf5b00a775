// Where the proxy goes: one interface for all methods.
//
// Given the probe h (frame W, um) and the proxy's old place on the graph, a solver finds the new place on the tiles
// that are resident, within a bounded number of visited segments. Thread rule: haptic thread only; every member but the
// factory is noexcept, without allocation, lock or system call.
#pragma once

#include "index/tile/tile.h"
#include "solver/graph/proxy_place.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>

namespace filiform {

class GraphView;

enum class SolverMethod : std::uint8_t { basic, shading, force, force_listing, climb };
inline constexpr SolverMethod kSolverMethods[] = {SolverMethod::basic, SolverMethod::shading, SolverMethod::force,
                                                  SolverMethod::force_listing, SolverMethod::climb};

struct ClimbParameters {  // bounded climb (bounded_climb.h), in millimetres of the device; all >= 0
  // Climb allowed to a hand at rest. Less than 2 mm keeps the proxy on the wrong one of two nearly parallel branches;
  // 5 mm costs 3 to 4 times the visits of 0.5 mm, 2 mm 1.6 times.
  double rest_mm = 2.0;
  double gain = 4;           // and for each mm of pull; 3 to 6 are alike, 2 and less lose routes
  double most_mm = 60;       // never more: half the workspace
  double patience_1_s = 40;  // growth a second for each mm of pull beyond pull_mm; 0: none
  double pull_mm = 0.25;
  double reset_mm = 2.0;  // progress of the proxy that ends the patience
};

struct SolverParameters {
  std::uint32_t max_visited = 256;  // segments a tick; basic and force-based resume what is left on the next one
  std::uint32_t pool_nodes = 4096;  // kept decoded, 0.4 KB each; more cost memory, fewer cost time, none changes a path
  // Force-based (both readings) only: r = min(r_max, G |q-h| + r_min), um in frame W (the paper's 3.3).
  double gain = 1.0;
  double r_min_um = 0.0;
  double r_max_um = 0.0;
  ClimbParameters climb;
};

struct ProbeState {                 // what a solver is told each tick
  Vector3d h_W = Vector3d::Zero();  // um
  double dt_s = 1e-3;               // since the last tick
  double scale_um_m = 2500;         // um of world a metre of device: 300 um across 0.12 m
};

// A small set of tiles, filled during a tick without allocation.
struct TileList {
  std::array<TileId, 320> ids;
  std::uint32_t count = 0;
  bool overflow = false;

  void add(TileId tile) noexcept {
    for (std::uint32_t i = count; i-- > 0;)
      if (ids[i] == tile) return;
    if (count == ids.size()) {
      overflow = true;
      return;
    }
    ids[count++] = tile;
  }
};

struct SolverStep {
  std::uint32_t visited = 0;    // segments tested
  bool capped = false;          // max_visited reached, or a table full: the place is the best so far
  std::uint32_t frontiers = 0;  // nodes whose home tile was absent
  TileList touched;             // tiles that were read
  TileList absent;              // tiles that would have been read
};

class ProxySolver {
 public:
  virtual ~ProxySolver() = default;

  virtual const ProxyPlace& place() const noexcept = 0;
  // Jump or first placement: forgets marks, unfinished front and everything else but the parameters.
  virtual void setPlace(const ProxyPlace& place) noexcept = 0;
  // One tick. A probe that is not finite leaves the place as it is and visits nothing; a dt or a scale that is not > 0
  // and finite counts as no time and no budget. `step` is overwritten.
  virtual void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept = 0;
  // Restores, bit for bit, the state before the last advance(). Valid once after each advance(), before prepare().
  virtual void undo() noexcept = 0;
  // Between ticks, where there is time: decodes up to `most` nodes around the place, first those towards ahead_W (um),
  // so that the next ticks need not. Changes no path and reports nothing. At most 0.1 us a node with warm caches.
  virtual void prepare(const GraphView& /*graph*/, const Vector3d& /*ahead_W*/, std::uint32_t /*most*/) noexcept {}
  // The proxy may jump by far: the force should come from an Anchor that follows it, not from the proxy itself.
  virtual bool wantsAnchor() const noexcept { return false; }
};

// Throws UsageError for parameters that are negative or not finite.
std::unique_ptr<ProxySolver> makeProxySolver(SolverMethod method, const SolverParameters& parameters);
// "basic", "shading", "force", "force-listing", "climb".
const char* toString(SolverMethod method) noexcept;
// The other way; throws UsageError naming the choices.
SolverMethod solverMethod(const std::string& name);

}  // namespace filiform
