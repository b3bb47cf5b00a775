#include "solver/travel/places/confusion.h"

#include "solver/graph/graph_view.h"
#include "solver/travel/routes/internal/draw.h"
#include "solver/workspace/workspace.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <utility>

namespace filiform {
namespace {

constexpr std::size_t kMostNearby = 1024;  // segments; a search that reaches more gives up
constexpr std::size_t kMostTiles = 64;     // tiles kept from place to place
constexpr double kReach = 4;               // reach along the neurites, as a multiple of the offset's length
constexpr int kPerDecade = 24, kDecades = 5;

double normal(std::mt19937_64& random) {
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(random() >> 11) * 0x1p-53;
  return sum;
}

// The neurites around one place. Loads tiles as the search needs them.
class Neighbourhood {
 public:
  explicit Neighbourhood(const TileStore& store)
      : store_(store), table_(store.tile_count()), graph_(table_, store.leaves(), store.grid()) {}

  // Whether the search reaches `wanted` from the place within an arc length of `reach_um`.
  bool holds(SegmentId from, double t, const Vector3d& p_W, SegmentId wanted, double reach_um) {
    if (from == wanted) return true;
    if (held_.size() > kMostTiles) {
      for (const auto& [id, held] : held_) table_.retire(id);
      held_.clear();
    }
    const TileId tile = store_.home(store_.grid().snap(p_W));
    GraphView::SegmentRef segment = tile == kNoTile ? GraphView::SegmentRef{} : find(tile, from);
    if (!segment && store_.long_tile() != kNoTile) segment = find(store_.long_tile(), from);
    if (!segment) return false;
    const double length_um = (segment.tile->position_W(segment.tile->child(segment.segment)) -
                              segment.tile->position_W(segment.tile->parent(segment.segment)))
                                 .norm();
    std::set<SegmentId> seen{from};
    std::vector<std::pair<double, std::pair<const Tile*, std::uint32_t>>> front;  // arc so far, node
    front.push_back({t * length_um, {segment.tile, segment.tile->child(segment.segment)}});
    front.push_back({(1 - t) * length_um, {segment.tile, segment.tile->parent(segment.segment)}});
    // Shortest arc length first, so each segment is reached on its shortest path, also in loops.
    while (!front.empty() && seen.size() < kMostNearby) {
      const auto nearest =
          std::min_element(front.begin(), front.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
      const auto [arc_um, at] = *nearest;
      front.erase(nearest);
      if (arc_um > reach_um) continue;
      GraphView::HomeNode node = graph_.home(*at.first, at.second);
      if (node.frontier()) {
        load(node.home);
        node = graph_.nodeIn(node.home, at.first->nodeId(at.second));
      }
      if (!node.present()) continue;
      for (const std::uint32_t next : node.tile->incident(node.node)) {
        const SegmentId id = node.tile->segmentId(next);
        if (!seen.insert(id).second) continue;
        if (id == wanted) return true;
        const std::uint32_t child = node.tile->child(next), parent = node.tile->parent(next);
        const std::uint32_t other = child == node.node ? parent : child;
        front.push_back(
            {arc_um + (node.tile->position_W(child) - node.tile->position_W(parent)).norm(), {node.tile, other}});
      }
    }
    return false;
  }

 private:
  const Tile& load(TileId id) {
    auto& held = held_[id];
    if (!held) {
      held = store_.load(id);
      table_.add(*held);
    }
    return *held;
  }
  GraphView::SegmentRef find(TileId tile, SegmentId id) {
    load(tile);
    return graph_.segment(tile, id);
  }

  const TileStore& store_;
  TileTable table_;
  GraphView graph_;
  std::map<TileId, std::shared_ptr<const Tile>> held_;
};

}  // namespace

Confusion::Confusion(const TileStore& store, const Nearest& nearest, const ConfusionOptions& options)
    : store_(store), nearest_(nearest), options_(options) {
  const Landmarks& landmarks = store.landmarks();
  if (landmarks.points.empty()) return;
  std::mt19937_64 random(options.seed);
  for (std::size_t i = 0; i < options.places; ++i) {
    const std::size_t landmark = internal::drawBelow(random, landmarks.points.size());
    Place place{landmarks.segments[landmark],
                static_cast<double>(landmarks.t[landmark]),
                store.grid().toWorld(landmarks.points[landmark]),
                {}};
    for (int axis = 0; axis < 3; ++axis) place.tremor[axis] = normal(random);
    places_.push_back(place);
  }
}

double Confusion::at(double zoom_um) const {
  if (places_.empty()) return 0;
  const double tremor_um = options_.tremor_rms_m * zoom_um / Workspace::kZoomSpan_m;
  Neighbourhood about(store_);
  std::size_t confused_places = 0;
  for (const Place& place : places_) {
    const Vector3d off_W = tremor_um * place.tremor;
    const std::vector<NearestResult> found = nearest_.find(place.p_W + off_W);
    confused_places +=
        !found.empty() && !about.holds(place.segment, place.t, place.p_W, found[0].segment, kReach * off_W.norm());
  }
  return static_cast<double>(confused_places) / static_cast<double>(places_.size());
}

double Confusion::largestZoom() const {
  const auto zoomOf = [](int step) { return std::pow(10.0, static_cast<double>(step) / kPerDecade); };
  int fine = -1, coarse = kPerDecade * kDecades + 1;  // fine: few enough places are confused; coarse: too many
  while (coarse - fine > 1) {
    const int middle = fine + (coarse - fine) / 2;
    (at(zoomOf(middle)) <= options_.most_confused ? fine : coarse) = middle;
  }
  return fine < 0 ? 0 : zoomOf(fine);
}

}  // namespace filiform
