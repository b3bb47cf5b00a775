// Search inside one tile: the interface that every engine serves, and the list of best candidates that a search fills.
//
// An engine prunes with bounds rounded so that they never miss; which segment is nearest is decided by closestPoint()
// alone, ties by the lowest (cell, segment). So every engine, tiling and order of visits gives the same answers, bit
// for bit.
#pragma once

#include "index/closest_point.h"
#include "index/tile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace filiform {

// A box of the world in double, exact for boxes of grid points. Immutable value.
struct WorldBox {
  Vector3d lo_W, hi_W;

  // At most the squared distance, um^2, that closestPoint() can report for any segment point in the box: rounded down
  // by more than the error of both computations. O(1).
  double squaredDistanceBelow(const Vector3d& h_W) const noexcept {
    const Vector3d gap = (lo_W - h_W).cwiseMax(h_W - hi_W).cwiseMax(0.0);
    const double d2 = gap.squaredNorm();
    if (d2 == 0.0) return 0.0;
    constexpr double kUlps = 16 * std::numeric_limits<double>::epsilon();
    const double size = std::max(lo_W.cwiseAbs().maxCoeff(),
                                 hi_W.cwiseAbs().maxCoeff());  // rounding of an inner closest point
    const double d = std::sqrt(d2);
    const double below = d - kUlps * (d + size);
    return below > 0.0 ? below * below : 0.0;
  }
};

// A part of the world that boxes can be tested against.
class Region {
 public:
  virtual ~Region() = default;
  // False only if no segment whose closest or common points lie in the box can be wanted. O(1).
  virtual bool mayMeet(const WorldBox& box) const noexcept = 0;
};

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

// The k best segments seen so far, each once however many tiles store it. Thread-compatible.
class Candidates {
 public:
  // Keeps k segments within `limit2` um^2 (closed). With epsilon > 0 what is kept may be (1 + epsilon) times too far,
  // rank by rank, and no more. Requires k > 0, epsilon >= 0, limit2 >= 0.
  Candidates(std::size_t k, double epsilon, double limit2)
      : k_(k), slack_(k / 8), shrink_(1.0 / ((1.0 + epsilon) * (1.0 + epsilon))), limit2_(limit2), bound2_(limit2) {}

  // Nothing at a squared distance above this can matter: prune what lies farther, keep what is equal (ties).
  double bound2() const noexcept { return bound2_; }

  // Promises that k segments lie within `limit2`: tightens the pruning without giving up any of them. Not weakened by
  // epsilon, since the promised segments have yet to be met.
  void promise(double limit2) noexcept {
    limit2_ = std::min(limit2_, limit2);
    bound2_ = std::min(bound2_, limit2_);
  }

  // Only the best one is kept: then pruning may tighten by hearsay, see boundIf().
  bool single() const noexcept { return k_ == 1; }
  // What bound2() would be after an offer at that squared distance. Requires single().
  double boundIf(double squared_distance) const noexcept { return std::min(bound2_, squared_distance * shrink_); }
  // What a segment must not exceed to be kept, pruning aside.
  double limit2() const noexcept { return full_ ? std::min(limit2_, worst_.squared_distance) : limit2_; }

  // O(1) as a rule, amortised O(log k).
  void offer(const Candidate& c) {
    if (c.squared_distance > limit2_) return;
    if (full_ && !(c < worst_)) return;
    if (k_ == 1) return setWorst(c);
    best_.push_back(c);
    if (best_.size() >= k_ && (!full_ || best_.size() > k_ + slack_)) compact();
  }
  // The segment of the tile with that index, measured by closestPoint().
  void offer(const Tile& tile, std::uint32_t segment, const Vector3d& child_W, const Vector3d& parent_W,
             const Vector3d& h_W) {
    const ClosestPoint c = closestPoint(child_W, parent_W, h_W);
    if (c.squared_distance <= limit2_ && (!full_ || c.squared_distance <= worst_.squared_distance))
      offer({c.squared_distance, tile.segmentId(segment), c.t, c.p_W, tile.id()});
  }

  // At most k, best first. O(k log k).
  const std::vector<Candidate>& sorted() {
    if (k_ == 1)
      best_.assign(full_ ? 1 : 0, worst_);
    else
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
    best_.erase(std::unique(best_.begin(), best_.end(),
                            [](const Candidate& a, const Candidate& b) { return a.segment == b.segment; }),
                best_.end());
    if (best_.size() > k_) best_.resize(k_, best_.front());
    full_ = best_.size() == k_;
    if (full_) setWorst(best_.back());
  }

  std::size_t k_, slack_;
  double shrink_, limit2_, bound2_;
  bool full_ = false;
  Candidate worst_{};
  std::vector<Candidate> best_;
};

// A search structure over one tile. Immutable after construction: any number of threads may search.
class TileEngine {
 public:
  virtual ~TileEngine() = default;
  // Offers every segment that may be among the best. Requires finite h_W. O(log segments) expected.
  virtual void search(const Vector3d& h_W, Candidates& best) const = 0;
  // Appends every segment of the tile, by index, whose box may meet the region, and others perhaps; in any order, each
  // once. O(log segments + found) expected.
  virtual void collect(const Region& region, std::vector<std::uint32_t>& segments) const = 0;
  // Heap and object bytes, the tile's own aside.
  virtual std::size_t bytes() const = 0;
};

// Throws UsageError, naming what is built, for an engine that this build does not hold.
void requireTileEngine(const std::string& name);

// Builds the engine of that name ("packed", "cgal") over a tile; the tile is kept alive by it. Throws as
// requireTileEngine().
std::unique_ptr<TileEngine> makeTileEngine(const std::string& name, std::shared_ptr<const Tile> tile);

}  // namespace filiform
