// Search inside one tile: the interface of all engines, and the list of best candidates that a search fills.
//
// Engines prune with bounds rounded so that no segment is missed. closestPoint() alone decides which segment is
// nearest; ties go to the lowest (cell, segment). So every engine, tiling and order of visits gives the same bits.
#pragma once

#include "index/geometry/closest_point.h"
#include "index/tile/tile.h"
#include "index/tile/tile_engine_kind.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <unordered_set>
#include <utility>
#include <vector>

namespace filiform {

// A box in world coordinates, exact for boxes of grid points. Thread rule: immutable value.
struct WorldBox {
  Vector3d lo_W, hi_W;

  // Lower bound of the squared distance, um^2, that closestPoint() can report for a segment point in the box. Rounded
  // down by more than the error of both computations. O(1).
  double squaredDistanceBelow(const Vector3d& h_W) const noexcept {
    const Vector3d gap = (lo_W - h_W).cwiseMax(h_W - hi_W).cwiseMax(0.0);
    const double d2 = gap.squaredNorm();
    if (d2 == 0.0) return 0.0;
    constexpr double kUlps = 16 * std::numeric_limits<double>::epsilon();
    const double size = std::max(lo_W.cwiseAbs().maxCoeff(),
                                 hi_W.cwiseAbs().maxCoeff());  // the closest point was itself rounded
    const double d = std::sqrt(d2);
    const double below = d - kUlps * (d + size);
    return below > 0.0 ? below * below : 0.0;
  }
};

// A part of the world against which boxes are tested.
class Region {
 public:
  virtual ~Region() = default;
  // May return false only if no wanted segment has its closest or common points in the box. O(1).
  virtual bool mayMeet(const WorldBox& box) const noexcept = 0;
};

// One segment found by a search.
struct Candidate {
  double squared_distance;  // um^2
  SegmentId segment;
  double t;  // 0 child .. 1 parent
  Vector3d p_W;
  TileId tile;  // a tile that stores the segment

  bool operator<(const Candidate& other) const {
    return squared_distance != other.squared_distance ? squared_distance < other.squared_distance
                                                      : segment < other.segment;
  }
};

// Removes all but the first of each segment, or of each cell. Requires that equal segments follow each other. O(n).
template <class Found>
void keepFirst(std::vector<Found>& found, bool of_cells) {
  std::unordered_set<std::uint32_t> cells;
  SegmentId last{UINT32_MAX, UINT32_MAX};
  std::erase_if(found, [&](const Found& f) {
    if (of_cells) return !cells.insert(f.segment.cell).second;
    return f.segment == std::exchange(last, f.segment);
  });
}

// The k best segments seen so far, each segment once, or the best segments of the k best cells. Thread rule:
// thread-compatible.
class Candidates {
 public:
  // Keeps k segments within the squared distance `limit2`, um^2 (closed). With epsilon > 0, the segment of each rank
  // may be up to (1 + epsilon) times too far. `of_cells`: keeps one segment a cell. Requires k > 0, epsilon >= 0,
  // limit2 >= 0. Takes no segment of the cell `without`.
  static constexpr std::uint32_t kNoCell = UINT32_MAX;
  Candidates(std::size_t k, double epsilon, double limit2, bool of_cells = false, std::uint32_t without = kNoCell)
      : k_(k),
        slack_(k / 8),
        shrink_(1.0 / ((1.0 + epsilon) * (1.0 + epsilon))),
        limit2_(limit2),
        bound2_(limit2),
        of_cells_(of_cells),
        without_(without) {}

  // Bound for pruning, um^2: skip what lies farther; keep what lies at the same distance (ties).
  double bound2() const noexcept { return bound2_; }

  // True if only the best segment is kept, of any cell. Pruning may then use boundIf().
  bool single() const noexcept { return k_ == 1 && without_ == kNoCell; }
  // The value of bound2() after an offer at that squared distance. Requires single().
  double boundIf(double squared_distance) const noexcept { return std::min(bound2_, squared_distance * shrink_); }
  // The largest squared distance, um^2, that is still kept, without pruning.
  double limit2() const noexcept { return full_ ? std::min(limit2_, worst_.squared_distance) : limit2_; }

  // Adds a candidate if it is among the best. Usually O(1), amortised O(log k).
  void offer(const Candidate& c) {
    if (c.squared_distance > limit2_ || c.segment.cell == without_) return;
    if (full_ && !(c < worst_)) return;
    if (k_ == 1) return setWorst(c);
    best_.push_back(c);
    if (best_.size() >= k_ && (!full_ || best_.size() > k_ + slack_)) compact();
  }
  // Measures one segment of the tile by closestPoint() and offers it.
  void offer(const Tile& tile, std::uint32_t segment, const Vector3d& child_W, const Vector3d& parent_W,
             const Vector3d& h_W) {
    const ClosestPoint c = closestPoint(child_W, parent_W, h_W);
    if (c.squared_distance <= limit2_ && (!full_ || c.squared_distance <= worst_.squared_distance))
      offer({c.squared_distance, tile.segmentId(segment), c.t, c.p_W, tile.id()});
  }

  // At most k candidates, best first; valid until the next offer. O(k log k).
  std::span<const Candidate> sorted() {
    if (k_ == 1) return {&worst_, full_ ? 1u : 0u};
    compact();
    return best_;
  }

 private:
  void setWorst(const Candidate& c) {
    full_ = true;
    worst_ = c;
    bound2_ = std::min(limit2_, worst_.squared_distance * shrink_);
  }
  void compact() {
    std::sort(best_.begin(), best_.end());
    keepFirst(best_, of_cells_);
    if (best_.size() > k_) best_.resize(k_, best_.front());
    full_ = best_.size() == k_;
    if (full_) setWorst(best_.back());
  }

  std::size_t k_, slack_;
  double shrink_, limit2_, bound2_;
  bool of_cells_;
  std::uint32_t without_;
  bool full_ = false;
  Candidate worst_{};
  std::vector<Candidate> best_;
};

// A search structure over one tile. Thread rule: immutable; any number of threads may search.
class TileEngine {
 public:
  virtual ~TileEngine() = default;
  // Offers every segment that may be among the best; it may offer others. Requires finite h_W. O(log segments)
  // expected.
  virtual void search(const Vector3d& h_W, Candidates& best) const = 0;
  // Appends the index of every segment whose box may meet the region, and possibly others. Each index once, in any
  // order. O(log segments + found) expected.
  virtual void collect(const Region& region, std::vector<std::uint32_t>& segments) const = 0;
  // Heap and object bytes, without the tile's own.
  virtual std::size_t bytes() const = 0;
};

// Runs of segments of a tile, each a run of Tile::runs() or a part of one, in the order of these. nullopt: all runs.
using SomeRuns = std::optional<std::vector<SegmentRun>>;

// Builds an engine over a tile, or over some of its segments. The engine keeps the tile alive.
std::unique_ptr<TileEngine> makeTileEngine(TileEngineKind kind, std::shared_ptr<const Tile> tile, SomeRuns some = {});

}  // namespace filiform
