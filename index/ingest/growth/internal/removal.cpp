#include "index/ingest/growth/internal/removal.h"

#include "index/geometry/internal/grown_leaves.h"
#include "index/geometry/partition.h"
#include "index/query/internal/box_levels.h"
#include "index/tile/internal/merged_tile.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace filiform::internal {
namespace {

// Finds the tiles that hold a segment of the removed cells.
class Holders {
 public:
  Holders(const TileSet& set, const std::vector<bool>& removed) : set_(set), removed_(removed) {
    for (TileId t = 0; t < set.tile_count(); ++t)
      if (t != set.long_tile()) keys_.push_back(set.entry(t).key);
    partition_ = Partition(grownLeaves(keys_));
  }
  std::vector<TileId> find() {
    std::set<TileId> owners;
    for (std::uint32_t cell = 0; cell < removed_.size(); ++cell) {
      if (!removed_[cell]) continue;
      const std::vector<TileId> tiles = set_.cellTiles(cell);
      owners.insert(tiles.begin(), tiles.end());
    }
    for (const TileId t : owners) addFrom(t);
    return {holders_.begin(), holders_.end()};
  }

 private:
  void addFrom(TileId t) {
    const auto tile = set_.load(t);
    holders_.insert(t);
    const GridBox inner = closedBlock(tile->key());
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
      if (!tile->owned(s) || !removed_[tile->segmentId(s).cell]) continue;
      const GridPoint a = tile->gridPoint(tile->child(s)), b = tile->gridPoint(tile->parent(s));
      if (tile->isLong()) {
        holders_.insert(set_.home(a));
        holders_.insert(set_.home(b));
      } else if (!inside(inner, a) || !inside(inner, b)) {
        addMet(a, b);
      }
    }
  }
  static bool inside(const GridBox& closed, const GridPoint& p) {
    return (p.array() > closed.lo.array()).all() && (p.array() < closed.hi.array()).all();
  }
  void addMet(const GridPoint& a, const GridPoint& b) {
    std::vector<std::uint32_t> met;
    if (partition_.leavesMet(a, b, met)) {
      for (const std::uint32_t leaf : met) {
        const BlockKey& block = partition_.leaves()[leaf];
        const auto at =
            std::partition_point(keys_.begin(), keys_.end(), [&](const BlockKey& k) { return k.low < block.low; });
        if (at != keys_.end() && *at == block) holders_.insert(static_cast<TileId>(at - keys_.begin()));
      }
      return;
    }
    for (TileId t = 0; t < keys_.size(); ++t)  // rare
      if (segmentMeetsBox(a, b, closedBlock(keys_[t]))) holders_.insert(t);
  }

  const TileSet& set_;
  const std::vector<bool>& removed_;
  std::vector<BlockKey> keys_;
  Partition partition_{std::vector<BlockKey>{BlockKey{}}};
  std::set<TileId> holders_;
};

// The squared distance of a point to the nearest of some points, which levels and positions hold in one order.
class NearestPoint {
 public:
  // Consecutive points should lie close together. Requires at least one.
  explicit NearestPoint(std::vector<Vector3d> points_W) : points_W_(std::move(points_W)), levels_(boxesOf(points_W_)) {}
  double squared(const Vector3d& p_W) const {
    double nearest2 = HUGE_VAL;
    visit(levels_.root(), levels_.probe(p_W), p_W, nearest2);
    return nearest2;
  }

 private:
  static std::vector<WorldBox> boxesOf(const std::vector<Vector3d>& points_W) {
    std::vector<WorldBox> boxes;
    for (const Vector3d& p_W : points_W) boxes.push_back({p_W, p_W});
    return boxes;
  }
  void visit(BoxLevels::Place node, const BoxLevels::Probe& probe, const Vector3d& p_W, double& nearest2) const {
    BoxLevels::Bounds below;
    levels_.squaredBelow(probe, node, below);
    std::sort(below.begin(), below.end());
    for (const BoxLevels::Bound& bound : below) {
      if (bound.child() >= levels_.children(node)) continue;
      if (bound.squared() >= nearest2) return;
      const BoxLevels::Place place = BoxLevels::child(node, bound.child());
      if (place.level < 0)
        nearest2 = std::min(nearest2, (points_W_[place.at] - p_W).squaredNorm());
      else
        visit(place, probe, p_W, nearest2);
    }
  }

  std::vector<Vector3d> points_W_;
  BoxLevels levels_;
};

}  // namespace

TilesWithout::TilesWithout(const TileSet& base, const std::vector<bool>& removed) : base_(base), removed_(removed) {
  if (std::find(removed.begin(), removed.end(), true) != removed.end()) touched_ = Holders(base, removed).find();
}

bool TilesWithout::touches(TileId tile) const { return std::binary_search(touched_.begin(), touched_.end(), tile); }

std::pair<std::vector<StoredSegment>, TileAppearance> TilesWithout::left(TileId t) const {
  const TileAppearance look = base_.loadAppearance(t);
  std::vector<StoredSegment> all, left;
  TileAppearance left_look;
  appendSegments(*base_.load(t), all);
  std::size_t owned = 0;
  for (const StoredSegment& s : all) {
    const std::size_t at = owned;
    owned += s.owned ? 1 : 0;
    if (removed_[s.id.cell]) continue;
    left.push_back(s);
    if (!s.owned) continue;
    left_look.radii_um.push_back(look.radii_um[at]);
    left_look.types.push_back(look.types[at]);
  }
  return {std::move(left), std::move(left_look)};
}

void removeFromTiles(const TileSet& base, const std::vector<bool>& removed, GrownRevision& to,
                     const std::function<void(std::uint64_t, std::uint64_t)>& step) {
  const TilesWithout without(base, removed);
  std::size_t next = 0;
  for (TileId t = 0; t < base.tile_count(); ++t) {
    if (!without.touches(t)) {
      to.keep(t);
      continue;
    }
    step(next++, without.touched().size());
    auto [left, look] = without.left(t);
    if (!left.empty())
      to.write(t, base.entry(t).key, t == base.long_tile(), std::move(left), look, base.entry(t).types);
  }
  to.number();
}

Landmarks withoutCells(const TileSet& base, const std::vector<bool>& removed, const GridBox& bounds) {
  const Landmarks& all = base.landmarks();
  const Grid grid = base.grid();
  Landmarks left;
  std::vector<Vector3d> gone_W;
  for (std::size_t i = 0; i < all.points.size(); ++i) {
    if (removed[all.segments[i].cell]) {
      gone_W.push_back(grid.toWorld(all.points[i]));
      continue;
    }
    left.points.push_back(all.points[i]);
    left.segments.push_back(all.segments[i]);
    left.t.push_back(all.t[i]);
  }
  for (TileId t = 0; left.points.empty() && t < base.tile_count(); ++t) {
    const auto tile = base.load(t);
    for (std::uint32_t s = 0; s < tile->segment_count() && left.points.empty(); ++s) {
      if (!tile->owned(s) || removed[tile->segmentId(s).cell]) continue;
      left.points.push_back(tile->gridPoint(tile->child(s)));
      left.segments.push_back(tile->segmentId(s));
      left.t.push_back(0);
      left.covering_radius_um = (grid.toWorld(bounds.hi) - grid.toWorld(bounds.lo)).norm();
      return left;
    }
  }
  if (left.points.empty()) return left;
  std::vector<Vector3d> left_W;
  for (const GridPoint& p : left.points) left_W.push_back(grid.toWorld(p));
  const NearestPoint nearest(std::move(left_W));
  double farthest2 = 0;
  for (const Vector3d& p_W : gone_W) farthest2 = std::max(farthest2, nearest.squared(p_W));
  left.covering_radius_um = all.covering_radius_um + std::sqrt(farthest2);
  return left;
}

Landmarks withLandmarks(const Landmarks& base, const Landmarks& added, std::uint32_t cells) {
  struct One {
    MortonKey key;
    SegmentId segment;
    GridPoint point;
    float t;
  };
  std::vector<One> all;
  const auto take = [&all](const Landmarks& from, std::uint32_t shift) {
    for (std::size_t i = 0; i < from.points.size(); ++i)
      all.push_back({mortonKey(from.points[i]),
                     {from.segments[i].cell + shift, from.segments[i].segment},
                     from.points[i],
                     from.t[i]});
  };
  take(base, 0);
  take(added, cells);
  std::sort(all.begin(), all.end(),
            [](const One& a, const One& b) { return a.key != b.key ? a.key < b.key : a.segment < b.segment; });
  Landmarks both;
  both.covering_radius_um = std::max(base.covering_radius_um, added.covering_radius_um);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i > 0 && all[i].key == all[i - 1].key) continue;
    both.points.push_back(all[i].point);
    both.segments.push_back(all[i].segment);
    both.t.push_back(all[i].t);
  }
  return both;
}

}  // namespace filiform::internal
