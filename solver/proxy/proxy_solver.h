// The common interface of all methods that move the proxy.
//
// A solver gets the probe h (frame W, um) and finds the proxy's new place from its old place, on the tiles in memory,
// within a bounded number of visited segments. Thread rule: haptic thread only. All members except makeProxySolver()
// are noexcept and make no allocation, lock or system call.
#pragma once

#include "index/tile/tile.h"
#include "solver/graph/proxy_place.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>

namespace filiform {

class GraphView;

// The methods that compute the proxy; solver/README.md describes them.
enum class SolverMethod : std::uint8_t { basic, shading, force, force_listing, climb };
inline constexpr SolverMethod kSolverMethods[] = {SolverMethod::basic, SolverMethod::shading, SolverMethod::force,
                                                  SolverMethod::force_listing, SolverMethod::climb};

// Parameters of bounded climb (bounded_climb.h), in millimetres of the device. All >= 0. "Pull" is |proxy - probe|.
struct ClimbParameters {
  // Climb that is allowed without a pull. With less than 2 mm the proxy stays on the wrong one of two nearly parallel
  // branches. Compared with 0.5 mm, 2 mm costs 1.6 times the visits, and 5 mm 3 to 4 times.
  double rest_mm = 2.0;
  double gain = 4;      // additional climb for each mm of pull; 3 to 6 perform alike, 2 and less lose routes
  double most_mm = 60;  // upper limit of the climb: half the workspace
  // The patience m, mm of climb, in each tick: it loses motion_cost (1 + growth_1_mm m) for each mm that the proxy has
  // moved, and gains patience_1_s (1 + growth_1_mm m) a second for each mm of pull beyond pull_mm, at most for
  // most_pull_mm: tiles must arrive while it grows. patience_1_s 0: none.
  double patience_1_s = 160;
  double pull_mm = 0.25;
  double most_pull_mm = 0.5;
  double growth_1_mm = 1;
  double motion_cost = 1.5;
};

// Limits of a solver, and the parameters of each method.
struct SolverParameters {
  std::uint32_t max_visited = 2048;  // segments a tick; basic and force-based continue in the next tick
  std::uint32_t pool_nodes = 4096;   // decoded nodes that are kept, 0.4 KB each; changes speed and memory, no result
  // Force-based only, both variants: r = min(r_max, G |q-h| + r_min), um in frame W (the paper, 3.3).
  double gain = 1.0;
  double r_min_um = 0.0;
  double r_max_um = 0.0;
  ClimbParameters climb;
};

// The force-based reach in a cell: r_min and r_max of SolverParameters.
struct CellReach {
  double r_min_um = 0, r_max_um = 0;
};

struct ProbeState {                 // input of a tick
  Vector3d h_W = Vector3d::Zero();  // um
  double dt_s = 1e-3;               // since the last tick
  double scale_um_m = 2500;         // um of world for each metre of device; 2500: 300 um across 0.12 m
  double leap = 1;                  // bounded climb only, 0 to 1: the part of its budget that it may use
};

// A small set of tiles. add() does not allocate.
struct TileList {
  std::array<TileId, 320> ids;
  std::uint32_t count = 0;
  bool overflow = false;  // a tile was left out

  void add(TileId tile) noexcept {
    for (std::uint32_t i = count; i-- > 0;)
      if (ids[i] == tile) return;
    if (count == ids.size()) {
      overflow = true;
      return;
    }
    ids[count++] = tile;
  }
  void clear() noexcept {
    count = 0;
    overflow = false;
  }
};

// What one tick of a solver did.
struct SolverStep {
  std::uint32_t visited = 0;    // segments tested; climb counts 16 segments in a row as one, see bounded_climb.h
  bool capped = false;          // stopped at max_visited or at a full table: the place is the best so far
  std::uint32_t frontiers = 0;  // nodes whose home tile was absent
  TileList touched;             // tiles that were read
  TileList absent;              // tiles that the search needed but that are not in memory

  void clear() noexcept {
    visited = frontiers = 0;
    capped = false;
    touched.clear();
    absent.clear();
  }
};

class ProxySolver {
 public:
  virtual ~ProxySolver() = default;

  virtual const ProxyPlace& place() const noexcept = 0;
  // A jump or the first placement. Resets everything except the parameters.
  virtual void setPlace(const ProxyPlace& place) noexcept = 0;
  // With setPlace() in another cell: the reach of that cell. Both >= 0 and finite. Only force-based methods use it.
  virtual void setReach(const CellReach& /*reach*/) noexcept {}
  // One tick. Overwrites `step`. A probe that is not finite leaves the place unchanged and visits nothing. A dt or a
  // scale that is not > 0 and finite gives no patience and no budget.
  virtual void advance(const GraphView& graph, const ProbeState& probe, SolverStep& step) noexcept = 0;
  // Restores the state before the last advance(), bit for bit. Valid once after each advance(), before prepare().
  virtual void undo() noexcept = 0;
  // Between ticks: decodes up to `most` nodes around the place, those towards ahead_W (um) first, so that the next
  // ticks need not. Changes no result and reports no tiles. At most 0.1 us a node with warm caches.
  virtual void prepare(const GraphView& /*graph*/, const Vector3d& /*ahead_W*/, std::uint32_t /*most*/) noexcept {}
  // True if the proxy may jump far. The force should then come from an Anchor, not from the proxy itself.
  virtual bool wantsAnchor() const noexcept { return false; }
};

// Throws UsageError for parameters that are out of range or not finite.
std::unique_ptr<ProxySolver> makeProxySolver(SolverMethod method, const SolverParameters& parameters);
// "basic", "shading", "force", "force-listing", "climb".
const char* toString(SolverMethod method) noexcept;
// The inverse of toString(); throws UsageError that lists the names.
SolverMethod solverMethod(const std::string& name);

}  // namespace filiform
