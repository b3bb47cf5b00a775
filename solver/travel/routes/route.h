// A wanted path along one cell, and the progress of a proxy along it. Thread rule: immutable after construction.
#pragma once

#include "index/geometry/grid.h"
#include "index/tile/tile.h"
#include "solver/proxy/proxy_solver.h"
#include "solver/travel/routes/route_choice.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace filiform {

struct CellGraph;

// The nodes and arc lengths from a first to a last sample of a cell. The tree has exactly one path between them.
class Route {
 public:
  struct Point {
    std::uint32_t rank;  // of the sample
    Vector3d p_W;        // um
    double arc_um;       // from the first point; never decreases
  };
  struct Progress {
    // Arc length of the proxy's place on the route. Off the route: of the point where the neurites lead back to the
    // route. 0 unless connected.
    double arc_um = 0;
    bool on_route = false;   // on a segment or node of the route
    bool connected = false;  // on the route's tree
  };

  // The path from sample `first` to sample `last` (ranks). Requires `parents` (kNoParent at roots) without cycles and
  // with the size of `positions`. For a cell with loops, `parents` is a spanning forest, which contains the route, and
  // `links` are its segments, as in CellGraph. Throws UsageError if no path joins the samples or the path has no
  // length. O(samples).
  Route(std::uint32_t cell, const Grid& grid, const std::vector<GridPoint>& positions,
        std::vector<std::uint32_t> parents, std::uint32_t first, std::uint32_t last,
        std::vector<std::array<std::uint32_t, 2>> links = {});

  std::uint32_t cell() const { return cell_; }
  const std::vector<Point>& points() const { return points_; }  // at least two
  double length_um() const { return points_.back().arc_um; }

  // The route's segment at its first point, and the parameter of that point on the segment (0 at the segment's child, 1
  // at its parent).
  SegmentId first_segment() const;
  double first_t() const;

  // The point at this arc length; before the first point: the first point; past the last point: straight on. O(log
  // points).
  Vector3d pointAt(double arc_um) const noexcept;
  // O(1).
  Progress progress(const ProxyPlace& place) const noexcept;

 private:
  std::uint32_t cell_;
  std::vector<Point> points_;
  Vector3d beyond_ = Vector3d::Zero();               // unit vector past the last point
  std::vector<std::uint32_t> parents_;               // of all samples of the cell
  std::vector<std::array<std::uint32_t, 2>> links_;  // only for a cell with loops
  // By rank: index of the sample's point on the route; off the route, of the point where the sample's branch leaves it.
  std::vector<std::uint32_t> route_index_;
  std::vector<bool> on_route_;  // by rank
};

// The progress of a proxy: the greatest arc length at which it was on the route. In a tree, a proxy on the neurites has
// then passed the whole route before that point. Thread rule: thread-compatible, haptic-safe.
class RouteTracker {
 public:
  explicit RouteTracker(const Route& route) : route_(route) {}  // the route must outlive it
  Route::Progress update(const ProxyPlace& place) noexcept;
  double reached_um() const { return reached_um_; }

 private:
  const Route& route_;
  double reached_um_ = 0;
};

// The ranks of all samples, each parent before its children; files may list samples in any order. Requires parents
// without cycles, kNoParent at roots. O(samples).
std::vector<std::uint32_t> parentsFirst(const std::vector<std::uint32_t>& parents);

// Plans a route of the cell. Samples that only give a soma its shape (index/cell/soma.h) are not tips. `cell` is the id
// of `graph` in its set. Throws UsageError for a tour, for unknown or unconnected samples, and for a cell without
// segments. O(samples).
Route planRoute(const CellGraph& graph, std::uint32_t cell, const RouteChoice& choice);
// A random route; nullopt if no segment of the cell has a length.
std::optional<Route> planRandomRoute(const CellGraph& graph, std::uint32_t cell, std::uint64_t seed);

}  // namespace filiform
