#include "solver/internal/star_cache.h"

#include <bit>

namespace filiform::internal {

StarCache::StarCache(std::uint32_t stars) : stars_(std::bit_ceil(stars)), mask_(stars_.size() - 1) {}

bool StarCache::fill(const GraphView& graph, NodeId id, const Tile& tile, std::uint32_t node,
                     Star& star) const noexcept {
  const GraphView::HomeNode home = graph.home(tile, node);
  if (!home.present()) return false;
  const Tile& at = *home.tile;
  Ray* next = star.rays.data();
  const auto decode = [&](std::uint32_t segment, const Tile::Link& link) {
    Ray& ray = *next++;
    ray.segment = segment;
    ray.rank = link.id.segment;
    ray.from_child = link.child == home.node;
    ray.far = ray.from_child ? link.parent : link.child;
    ray.far_rank = ray.from_child ? link.parent_id.sample : link.child_id.sample;
    ray.far_W = at.position_W(ray.far);
  };
  const std::uint32_t degree = at.visitIncident(home.node, kMostRays, decode);
  if (degree > kMostRays) return false;
  star.id = id;
  star.epoch = epoch_;
  star.tile = home.tile;
  star.home = home.home;
  star.node = home.node;
  star.degree = degree;
  star.p_W = at.position_W(home.node);
  star.plain = true;
  for (std::uint32_t i = 0; i < degree; ++i) {
    star.plain = star.plain && star.rays[i].far_W != star.p_W;
    for (std::uint32_t other = 0; other < i; ++other)
      star.plain = star.plain && star.rays[other].far != star.rays[i].far;
  }
  return true;
}

}  // namespace filiform::internal
