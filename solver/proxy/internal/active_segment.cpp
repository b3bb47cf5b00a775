#include "solver/proxy/internal/active_segment.h"

namespace filiform::internal {

bool ActiveSegment::find(const GraphView& graph, const ProxyPlace& place, SolverStep& step) noexcept {
  const Tile* stored = graph.tiles().find(place.tile);
  if (stored == nullptr) {
    ++step.frontiers;
    step.absent.add(place.tile);
    return false;
  }
  step.touched.add(place.tile);
  const bool is_there = segment < stored->segment_count() && stored->segmentId(segment) == place.segment;
  const GraphView::SegmentRef ref =
      is_there ? GraphView::SegmentRef{stored, segment} : graph.segment(place.tile, place.segment);
  if (!ref) return false;
  tile = stored;
  home = place.tile;
  id = place.segment;
  segment = ref.segment;
  const Tile::Link link = tile->link(segment);
  child = {link.child_id, tile->position_W(link.child), link.child, WorkingGraph::kNone};
  parent = {link.parent_id, tile->position_W(link.parent), link.parent, WorkingGraph::kNone};
  d_W = parent.p_W - child.p_W;
  length2 = d_W.squaredNorm();
  return true;
}

void ActiveSegment::prepare(WorkingGraph& graph, const GraphView& view, const ProxyPlace& place,
                            const Vector3d& ahead_W, std::uint32_t most) noexcept {
  SolverStep unreported;
  if (!place.valid() || !moveTo(view, place, unreported)) return;
  graph.prepare(view, {seen(child), seen(parent)}, ahead_W, most);
}

}  // namespace filiform::internal
