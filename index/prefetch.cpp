#include "index/prefetch.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <unordered_set>

namespace filiform {
namespace {

constexpr double kMinReach_um = 1.0;

// A node to walk on from, seen in `tile`, which need not be its home.
struct Step {
  double cost_s, arc_um;
  NodeId node;
  const Tile* tile;
  std::uint32_t index;

  bool operator<(const Step& other) const {  // as in a max-heap: "comes later"
    return cost_s != other.cost_s ? cost_s > other.cost_s : node > other.node;
  }
};

}  // namespace

Prefetch::Prefetch(const TileStore& store, const Directory& directory, PrefetchPolicy policy, double lookahead_s)
    : store_(store), directory_(directory), policy_(policy), lookahead_s_(lookahead_s) {}

void Prefetch::claim(const ReaderFocus& focus, const TileTable& loaded, std::uint64_t budget_bytes,
                     std::vector<TileClaim>& structure, std::vector<TileClaim>& workspace) const {
  if (policy_ == PrefetchPolicy::none || !focus.p_W.allFinite() || !std::isfinite(focus.radius_um)) return;
  if (policy_ == PrefetchPolicy::structure) claimStructure(focus, loaded, structure);
  claimWorkspace(focus, budget_bytes, workspace);
}

void Prefetch::claimStructure(const ReaderFocus& focus, const TileTable& loaded, std::vector<TileClaim>& claims) const {
  const Tile* tile = loaded.find(focus.active_tile);
  if (tile == nullptr) return;
  const std::optional<std::uint32_t> start = tile->findNode(focus.active_node);
  if (!start) return;

  const double speed = focus.v_W.allFinite() ? focus.v_W.norm() : 0.0;
  const Vector3d heading = speed > 0 ? Vector3d(focus.v_W / speed) : Vector3d(Vector3d::Zero());
  const double lookahead_s = lookahead_s_ > 0 ? lookahead_s_ : 1e-3;
  // At rest, or slowly, the hand may start at once in any direction: look at least as far as the workspace reaches.
  const double reach_um = std::max({speed * lookahead_s, focus.radius_um, kMinReach_um});
  const double pace_um_s = reach_um / lookahead_s;

  std::map<TileId, double> cost;
  std::unordered_set<std::uint64_t> seen;
  std::priority_queue<Step> queue;
  const double first_um = (tile->position_W(*start) - focus.p_W).norm();
  queue.push({first_um / pace_um_s, 0.0, focus.active_node, tile, *start});
  std::size_t budget = kMaxWalkedSegments;
  while (!queue.empty() && budget > 0) {
    Step at = queue.top();
    queue.pop();
    if (!seen.insert(at.node.key()).second) continue;
    if (!at.tile->isHome(at.index)) {
      const TileId home = store_.leaves().home(at.tile->gridPoint(at.index));
      if (home == kNoTile) continue;
      cost.try_emplace(home, at.cost_s);
      at.tile = loaded.find(home);
      if (at.tile == nullptr) continue;
      const std::optional<std::uint32_t> index = at.tile->findNode(at.node);
      if (!index) continue;
      at.index = *index;
    } else {
      cost.try_emplace(at.tile->id(), at.cost_s);
    }
    const Vector3d from_W = at.tile->position_W(at.index);
    for (const std::uint32_t s : at.tile->incident(at.index)) {
      if (budget-- == 1) break;
      const std::uint32_t other = at.tile->child(s) == at.index ? at.tile->parent(s) : at.tile->child(s);
      const NodeId id = at.tile->nodeId(other);
      if (seen.contains(id.key())) continue;
      const Vector3d way = at.tile->position_W(other) - from_W;
      const double length = way.norm();
      if (seen.size() > 1 && at.arc_um + length > reach_um) continue;  // the first node's neighbours always count
      const double ahead = length > 0 ? way.dot(heading) / length : 0.0;
      const double weight = 1.5 - 0.5 * ahead;  // 1 straight ahead, 2 straight back
      queue.push({at.cost_s + length * weight / pace_um_s, at.arc_um + length, id, at.tile, other});
    }
  }
  const std::size_t first = claims.size();
  for (const auto& [id, seconds] : cost) claims.push_back({id, seconds});
  std::sort(
      claims.begin() + static_cast<std::ptrdiff_t>(first), claims.end(),
      [](const TileClaim& a, const TileClaim& b) { return a.cost != b.cost ? a.cost < b.cost : a.tile < b.tile; });
}

void Prefetch::claimWorkspace(const ReaderFocus& focus, std::uint64_t budget_bytes,
                              std::vector<TileClaim>& claims) const {
  if (!(focus.radius_um > 0)) return;
  Directory::Walk walk = directory_.walk(focus.p_W);
  std::uint64_t bytes = 0;
  for (std::size_t n = 0; n < kMaxWorkspaceTiles; ++n) {
    const std::optional<Directory::Hit> hit = walk.next();
    if (!hit || hit->squared_distance > focus.radius_um * focus.radius_um) return;
    bytes += store_.entry(hit->tile).decoded_bytes;
    if (bytes > budget_bytes) return;
    claims.push_back({hit->tile, std::sqrt(hit->squared_distance)});
  }
}

}  // namespace filiform
