#include "solver/internal/star_cache.h"

#include <bit>

namespace filiform::internal {

StarCache::StarCache(std::uint32_t stars) : stars_(std::bit_ceil(stars)), mask_(stars_.size() - 1) {}

bool StarCache::fill(const GraphView& graph, NodeId id, const Tile& tile, std::uint32_t node,
                     Star& star) const noexcept {
  const GraphView::HomeNode home = graph.home(tile, node);
  if (!home.present()) return false;
  const Tile& at = *home.tile;
  const auto incident = at.incident(home.node);
  if (incident.size() > kMostRays) return false;
  star.id = id;
  star.epoch = epoch_;
  star.tile = home.tile;
  star.home = home.home;
  star.node = home.node;
  star.degree = static_cast<std::uint32_t>(incident.size());
  star.p_W = at.position_W(home.node);
  star.plain = true;
  std::uint32_t i = 0;
  for (const std::uint32_t segment : incident) {
    Ray& ray = star.rays[i++];
    const std::uint32_t child = at.child(segment);
    ray.segment = segment;
    ray.rank = at.segmentId(segment).segment;
    ray.from_child = child == home.node;
    ray.far = ray.from_child ? at.parent(segment) : child;
    ray.far_rank = at.nodeId(ray.far).sample;
    ray.far_W = at.position_W(ray.far);
    star.plain = star.plain && ray.far_W != star.p_W;
    for (std::uint32_t other = 0; other + 1 < i; ++other) star.plain = star.plain && star.rays[other].far != ray.far;
  }
  return true;
}

}  // namespace filiform::internal
