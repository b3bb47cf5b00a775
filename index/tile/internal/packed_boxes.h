// The boxes of the packed tree and its vector code: eight boxes or eight segments at once. One source is compiled for
// every instruction set that Highway knows, and chosen when the program runs. Vector code only excludes boxes and
// segments; closestPoint() measures what is left. So every set gives the same bits. Thread rule: immutable after
// construction.
#pragma once

#include "index/geometry/offsets.h"
#include "index/tile/internal/run_order.h"
#include "index/tile/tile_engine.h"

#include <array>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace filiform::internal::packed {

inline constexpr std::uint32_t kWidth = 8;
inline constexpr std::uint32_t kRun = kRunSegments;
inline constexpr std::uint32_t kTopNodes = 16;
static_assert(2 * kRun == kWidth);
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

// The boxes of up to eight children, in units from the tile's origin. Empty lanes are neutral under join.
struct alignas(32) Node {
  std::array<std::array<std::uint16_t, kWidth>, 3> lo, hi;
};

// The points of a run: its children, and the parent of its first segment, as offsets. A tree holds a copy for each run,
// in the order of runs, so that the eight runs of a node lie side by side. Segments beyond the count have any values.
struct alignas(32) NarrowRun {  // of tiles with narrowOffsets()
  std::array<std::uint16_t, kRun> x, y, z;
  std::array<std::uint16_t, 3> parent;
  std::uint16_t count;
};
struct alignas(16) WordRun {  // of tiles with wordOffsets()
  std::array<std::uint64_t, kRun> child;
  std::uint64_t parent, count;
};

// A run: the nodes of its first segment, and the number of segments.
struct RunEnds {
  std::uint32_t child, parent, count;
};

// A probe in units, as a small box that surely contains it: float rounds, and closestPoint() rounds too. With it the
// bounds of float's error.
struct Query {
  std::array<float, 3> lo, hi;
  std::array<float, 3> near;  // the probe, in quanta
  float per_quantum;          // units a quantum: a power of two
  float sift_margin;          // quanta
  double per_unit2;           // um^2 a squared unit

  // Converts a squared distance in um^2 to units for box tests, rounded up.
  float boxBound(double squared) const {
    const double bound = squared * per_unit2;
    return bound < 1e37 ? static_cast<float>(bound * (1 + 0x1p-19)) + FLT_MIN : kInfinity;
  }
  // Converts a bound of boxes to quanta, for segment distances computed in float.
  float siftBound(float box_bound) const {
    const float far = std::sqrt(box_bound) * per_quantum * (1 + 0x1p-16f) + sift_margin;
    return far * far;
  }
  // An upper bound, um^2, of what closestPoint() reports for a distance computed in float.
  double surely(float sifted) const {
    const double far = (std::sqrt(double{sifted}) * (1 + 0x1p-16) + double{sift_margin}) / double{per_quantum};
    return far * far / per_unit2;
  }
};

// Levels from the leaves up: a node of level 0 holds the boxes of eight runs, a node of level l those of eight nodes of
// level l - 1. The last level is small enough to scan.
struct Level {
  std::uint32_t begin, children;  // its first node; number of boxes in all its nodes

  std::uint32_t nodes() const { return (children + kWidth - 1) / kWidth; }
};

struct Boxes {
  const Tile* tile;
  const SegmentRun* runs;
  int shift;  // a unit is 2^shift quanta
  std::uint32_t level_count = 0;
  std::array<Level, 11> levels{};  // enough for 8^10 runs
  std::vector<Node> nodes;
  std::vector<NarrowRun> narrow;  // at most one of the two has the runs
  std::vector<WordRun> words;

  // True if eight segments can be read at once.
  bool lean() const { return !narrow.empty() || !words.empty(); }
  std::size_t bytes() const {
    return nodes.size() * sizeof(Node) + narrow.size() * sizeof(NarrowRun) + words.size() * sizeof(WordRun);
  }
  RunEnds endsOf(std::uint32_t run) const {
    const SegmentRun r = runs[run];
    return {tile->child(r.begin()), tile->parent(r.begin()), r.count()};
  }
  // One bit for each child of a node.
  unsigned present(std::uint32_t level, std::uint32_t node) const {
    const std::uint32_t left = levels[level].children - kWidth * node;
    return left >= kWidth ? 0xff : (1u << left) - 1;
  }
  // Measures the i-th segment of a run.
  void offer(std::uint32_t run, std::uint32_t i, const Vector3d& h_W, Candidates& best) const;
  // Measures all segments of a run.
  void searchRun(std::uint32_t run, const Vector3d& h_W, Candidates& best) const;
};

// The vector code of one instruction set.
struct Kernels {
  const char* name;
  // Computes the boxes of all nodes. Requires levels, nodes of the right number and, if lean(), the points of all runs.
  // O(nodes).
  void (*build)(Boxes& boxes);
  // Finds one nearest segment. Requires lean(), best.single() and a probe within 2^24 units. O(log segments) expected.
  void (*searchNearest)(const Boxes& boxes, const Query& query, const Vector3d& h_W, Candidates& best);
  // Finds any number of segments, nearest boxes first. O(log segments) expected.
  void (*searchOrdered)(const Boxes& boxes, const Query& query, const Vector3d& h_W, Candidates& best);
};

// The instruction sets that this machine runs, the fastest last. O(1) after the first call.
const std::vector<Kernels>& kernelsHere();

}  // namespace filiform::internal::packed
