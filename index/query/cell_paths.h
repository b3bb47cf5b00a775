// Shortest paths along one cell: the length between two places, the points of the path, and the farthest tip.
//
//   const auto set = TileSet::open("column.fil");
//   const CellPaths paths(readCell(*set, 0, false));
//   const CellPlace root = paths.at(0);
//   if (const auto tip = paths.farthestTip(root))
//     std::cout << paths.path(root, paths.at(*tip))->length_um() << " um\n";
//
// Lengths are sums in double over the positions on the grid, added from the first place to the second. In a cell
// without loops, exactly one path joins two places of one tree. Of equally short ways round a loop, always the same one
// is taken. Segments between the samples of a soma count like all others. Thread rule: immutable after construction.
#pragma once

#include "index/query/cell_graph.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace filiform {

// A place on a cell: on a segment between two samples, or at a sample.
struct CellPlace {
  std::uint32_t segment = 0;            // rank
  double t = 0;                         // 0 child .. 1 parent
  std::uint32_t child = 0, parent = 0;  // ranks of samples; equal for an isolated sample
};

// A way along a cell.
struct CellPath {
  // A place on the way.
  struct Point {
    Vector3d p_W;                         // um
    double along_um;                      // from the first point; never decreases
    std::optional<std::uint32_t> sample;  // rank; none: a place between two samples
  };
  // The first place, each sample on the way, and the last place. One point if both places are the same.
  std::vector<Point> points;
  double length_um() const { return points.back().along_um; }
};

class CellPaths {
 public:
  // O(samples).
  explicit CellPaths(CellGraph graph);

  const CellGraph& graph() const { return graph_; }
  std::uint32_t samples() const { return static_cast<std::uint32_t>(graph_.samples()); }

  // The place of a sample, on a segment that ends there. Requires sample < samples(). O(1).
  CellPlace at(std::uint32_t sample) const;
  // The place at t (0 child .. 1 parent) of a segment. Nullopt if the cell has no such segment, or if t is outside 0 to
  // 1. O(1).
  std::optional<CellPlace> on(std::uint32_t segment, double t) const;
  Vector3d position_W(const CellPlace& place) const;
  // The segments that end at a sample, ascending: for an isolated sample of a cell with loops its own, without loops
  // none. Requires sample < samples(). O(their number).
  std::vector<std::uint32_t> segmentsAt(std::uint32_t sample) const;

  // The length of the shortest path, um; nullopt if no path joins the places. O(samples log samples).
  std::optional<double> length_um(const CellPlace& from, const CellPlace& to) const;
  // The shortest path; nullopt if no path joins the places. O(samples log samples).
  std::optional<CellPath> path(const CellPlace& from, const CellPlace& to) const;
  // The path length to each sample, um, by rank; infinite if no path leads there. O(samples log samples).
  std::vector<double> lengths_um(const CellPlace& from) const;

  // A tip is a sample where a single segment ends: the end of a neurite, or a root with one neurite. Samples that only
  // give a soma its shape (Soma::dead_ends) are no tips, and their segments do not count. O(segments at the sample).
  bool isTip(std::uint32_t sample) const;
  bool isSomaEnd(std::uint32_t sample) const { return is_soma_end_[sample]; }
  // The tips that a path reaches, nearest first, at most `most`, without the place itself; ranks; equally far tips in
  // ascending order. O(samples log samples).
  std::vector<std::uint32_t> tips(const CellPlace& from, std::size_t most) const;
  // The tip that is farthest along the path; if several are, the lowest rank. Nullopt if there is no tip at a distance.
  // O(samples log samples).
  std::optional<std::uint32_t> farthestTip(const CellPlace& from) const;

 private:
  struct Reached {
    std::vector<double> length_um;      // by sample; infinite: not reached
    std::vector<std::uint32_t> before;  // the sample before each sample on its path
  };
  struct Arrival {
    double length_um;
    std::uint32_t by;  // the last sample before the place; kNoParent: both places are on one segment
  };
  Reached reach(const CellPlace& from, const CellPlace* until = nullptr) const;
  std::optional<Arrival> arrive(const Reached& reached, const CellPlace& from, const CellPlace& to) const;
  CellPath::Point pointAt(const CellPlace& place, double along_um) const;
  std::array<std::uint32_t, 2> ends(std::uint32_t segment) const;
  std::uint32_t segmentRanks() const;
  double distance_um(std::uint32_t a, std::uint32_t b) const {
    return (graph_.position_W(a) - graph_.position_W(b)).norm();
  }

  CellGraph graph_;
  std::vector<bool> is_soma_end_;                // by sample
  std::vector<std::uint32_t> first_, segments_;  // at sample n end segments_[first_[n] .. first_[n + 1])
};

}  // namespace filiform
