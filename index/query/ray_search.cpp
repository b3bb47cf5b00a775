// Nearest::alongRay().
#include "index/errors.h"
#include "index/geometry/closest_point.h"
#include "index/query/internal/searched_set.h"
#include "index/query/internal/tile_rounds.h"
#include "index/query/internal/visit_in_rounds.h"
#include "index/query/nearest.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace filiform {
namespace {

constexpr double kMisses = std::numeric_limits<double>::infinity();

// The boxes in which a hit may lie. A hit's closest approach lies in its segment's box, at most radius + slope * along
// from the ray. `along` is at most the box's farthest reach. So the ray meets the box enlarged by that distance.
struct RayRegion final : Region {
  Vector3d origin_W, direction;
  double radius_um, slope, length_um;

  RayRegion(const RayQuery& ray, const Vector3d& unit)
      : origin_W(ray.origin_W), direction(unit), radius_um(ray.radius_um), slope(ray.slope), length_um(ray.length_um) {}

  bool mayMeet(const WorldBox& box) const noexcept override { return entry(box) < kMisses; }

  // The smallest distance along the ray at which a hit in the box may come, or infinity.
  double entry(const WorldBox& box) const noexcept {
    const Vector3d middle = 0.5 * (box.lo_W + box.hi_W) - origin_W, half = 0.5 * (box.hi_W - box.lo_W);
    const double centre = direction.dot(middle), reach = direction.cwiseAbs().dot(half);
    const double size = middle.cwiseAbs().maxCoeff() + half.maxCoeff() + origin_W.cwiseAbs().maxCoeff();
    const double rounding = 64 * std::numeric_limits<double>::epsilon() * size;
    const double last = centre + reach + rounding;
    const double grown = radius_um + slope * std::max(last, 0.0) + rounding;
    double from = 0, to = kMisses;
    for (int axis = 0; axis < 3; ++axis) {
      const double lo = middle[axis] - half[axis] - grown, hi = middle[axis] + half[axis] + grown;
      if (direction[axis] == 0.0) {
        if (lo > 0 || hi < 0) return kMisses;
        continue;
      }
      const double a = lo / direction[axis], b = hi / direction[axis];
      const double slack = 64 * std::numeric_limits<double>::epsilon() * std::max(std::abs(a), std::abs(b));
      from = std::max(from, std::min(a, b) - slack);
      to = std::min(to, std::max(a, b) + slack);
    }
    if (from > to) return kMisses;
    // The closest approach lies in the box itself.
    const double first = std::max(0.0, centre - reach - rounding);
    return first <= length_um ? first : kMisses;
  }
};

}  // namespace

std::vector<RayHit> Nearest::alongRay(const RayQuery& ray) const {
  std::vector<RayHit> hits;
  alongRay(ray, hits);
  return hits;
}

SearchCounts Nearest::forEachAlongRay(const RayQuery& ray, const std::function<bool(const RayHit&)>& visit) const {
  RayQuery some = ray;
  return internal::visitInRounds<RayHit>(
      some.most, [&](std::vector<RayHit>& hits) { return alongRay(some, hits); }, visit);
}

SearchCounts Nearest::alongRay(const RayQuery& ray, std::vector<RayHit>& hits) const {
  hits.clear();
  const double length = ray.direction.norm();
  if (!ray.origin_W.allFinite() || !(length > 0) || !std::isfinite(length))
    throw UsageError("a ray needs a finite origin and a finite direction that is not 0");
  if (ray.origin_W.cwiseAbs().maxCoeff() > kMaxCoordinate_um)
    throw UsageError("a ray's origin must lie within 1e150 um");
  if (!(ray.radius_um >= 0) || !(ray.slope >= 0) || !std::isfinite(ray.radius_um) || !std::isfinite(ray.slope) ||
      !(ray.length_um >= 0))
    throw UsageError("a ray's radius, slope and length must be 0 or more");
  const RayRegion region(ray, ray.direction / length);

  std::vector<std::pair<double, TileId>> order;  // by the distance along the ray of a first possible hit
  SearchCounts counts;
  for (const auto& [tile, box] : set_->tilesMeeting(region, counts.tiles_read))
    order.emplace_back(tile == set_->long_tile() ? 0.0 : region.entry(box), tile);
  std::sort(order.begin(), order.end());

  std::vector<internal::Unsure<RayHit>> ghosts;
  const auto settle = [&] {
    std::sort(hits.begin(), hits.end());
    keepFirst(hits, ray.of_cells);
    if (hits.size() > ray.most) hits.erase(hits.begin() + static_cast<std::ptrdiff_t>(ray.most), hits.end());
  };
  const auto isBeyond = [&](double along) {
    return hits.size() == ray.most && (hits.empty() || along > hits.back().along_um);
  };
  std::vector<TileId> tiles;
  for (const auto& hit : order) tiles.push_back(hit.second);
  constexpr std::size_t kFirstRound = 4;
  internal::TileRounds rounds(set_->store, set_->cache,
                              ray.most == SIZE_MAX ? internal::TileRounds::kMost : kFirstRound);
  for (const auto& [entry, tile_id] : order) {
    if (isBeyond(entry)) break;
    rounds.before(counts.tiles_searched++, tiles);
    set_->forEachIn(region, tile_id, counts.tiles_read, [&](const Tile& tile, std::uint32_t s, bool is_sure) {
      const ClosestApproach c = closestApproach(tile.position_W(tile.child(s)), tile.position_W(tile.parent(s)),
                                                region.origin_W, region.direction);
      const double distance = std::sqrt(c.squared_distance);
      if (!(c.along <= ray.length_um && distance <= ray.radius_um + ray.slope * c.along)) return;
      const RayHit hit{c.along, distance, c.p_W, tile.segmentId(s), c.t, tile.id()};
      if (is_sure)
        hits.push_back(hit);
      else
        ghosts.push_back({hit, set_->middleOf(tile, s)});
    });
    settle();
  }
  std::sort(ghosts.begin(), ghosts.end());
  set_->readOwnersAhead(ghosts);
  for (const auto& ghost : ghosts) {
    if (isBeyond(ghost.found.along_um)) break;
    if (!set_->wants(ghost.found.segment, ghost.middle, counts.tiles_read)) continue;
    hits.push_back(ghost.found);
    settle();
  }
  return counts;
}

}  // namespace filiform
