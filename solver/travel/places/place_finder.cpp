#include "solver/travel/places/place_finder.h"

#include "index/errors.h"
#include "index/set/tiles_ahead.h"
#include "index/text.h"
#include "index/tile/tile_engine.h"
#include "solver/graph/graph_view.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <utility>

namespace filiform {

namespace {

constexpr int kMostReadings = 64;

// The tiles that one search has loaded, and the graph on them.
class Reading {
 public:
  explicit Reading(const TileStore& store)
      : store_(store), table_(store.tile_count()), graph(table_, store.leaves(), store.grid()) {}

  const Tile& load(TileId tile) {
    if (const Tile* const known = table_.find(tile)) return *known;
    return add(store_.load(tile));
  }
  const Tile& add(std::shared_ptr<const Tile> tile) {
    tiles_.push_back(std::move(tile));
    table_.add(*tiles_.back());
    return *tiles_.back();
  }

 private:
  const TileStore& store_;
  std::vector<std::shared_ptr<const Tile>> tiles_;
  TileTable table_;

 public:
  GraphView graph;
};

}  // namespace

struct PlaceFinder::Impl {
  Impl(const TileStore& scene, const NearestOptions& options) : store(scene), nearest(scene, options), somata(scene) {}

  ProxyPlace at(TileId tile, SegmentId segment, double t) const {
    Reading reading(store);
    reading.load(tile);
    return reading.graph.placeAt(tile, segment, t);
  }

  // The place of a sample that this tile has: in its home, on its segment with the lowest id.
  ProxyPlace atNode(std::shared_ptr<const Tile> found, std::uint32_t node) const {
    const NodeId sample = found->nodeId(node);
    const TileId home = store.home(found->gridPoint(node));
    Reading reading(store);
    reading.add(std::move(found));
    if (home != kNoTile) {
      const Tile& tile = reading.load(home);
      // Segments lie in the order of their ids.
      for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
        const Tile::Link link = tile.link(s);
        if (link.child_id == sample || link.parent_id == sample)
          return reading.graph.placeAt(home, tile.segmentId(s), link.child_id == sample ? 0 : 1);
      }
    }
    throw InputError("a sample lies in no tile: verify the set");
  }

  const TileStore& store;
  Nearest nearest;
  std::mutex mutex;  // of `somata`
  SomaFinder somata;
};

PlaceFinder::PlaceFinder(const TileStore& store, const NearestOptions& options)
    : impl_(std::make_unique<Impl>(store, options)) {}
PlaceFinder::~PlaceFinder() = default;

std::optional<PlaceFinder::Picked> PlaceFinder::along(const RayQuery& ray,
                                                      const std::function<bool(std::uint32_t cell)>& sees) const {
  RayQuery first = ray;
  first.of_cells = sees != nullptr;
  // More and more cells, until one of them is seen.
  for (first.most = 1;; first.most *= 16) {
    const std::vector<RayHit> hits = impl_->nearest.alongRay(first);
    for (const RayHit& hit : hits)
      if (!sees || sees(hit.segment.cell))
        return Picked{impl_->at(hit.tile, hit.segment, hit.t), hit.along_um, hit.distance_um};
    if (hits.size() < first.most) return std::nullopt;
  }
}

std::optional<PlaceFinder::Picked> PlaceFinder::nearest(const Vector3d& p_W) const {
  const std::vector<NearestResult> found = impl_->nearest.find(p_W);
  if (found.empty()) return std::nullopt;
  return Picked{impl_->at(found[0].tile, found[0].segment, found[0].t), 0, found[0].distance_um};
}

std::optional<PlaceFinder::Picked> PlaceFinder::anyNear(const Vector3d& p_W) const {
  const Grid grid = impl_->store.grid();
  if (!(p_W.cwiseAbs().maxCoeff() < Grid::kMaxCoordinate_um)) return nearest(p_W);  // refuses it
  const TileId home = impl_->store.home(grid.snap(p_W));
  if (home == kNoTile) return nearest(p_W);
  Reading reading(impl_->store);
  const Tile& tile = reading.load(home);
  Candidates candidates(1, 0, INFINITY);
  for (std::uint32_t s = 0; s < tile.segment_count(); ++s)
    candidates.offer(tile, s, tile.position_W(tile.child(s)), tile.position_W(tile.parent(s)), p_W);
  const std::span<const Candidate> best = candidates.sorted();
  if (best.empty()) return nearest(p_W);
  return Picked{reading.graph.placeAt(home, best[0].segment, best[0].t), 0, std::sqrt(best[0].squared_distance)};
}

ProxyPlace PlaceFinder::atSample(const CellWalk& walk, std::uint32_t cell, std::uint32_t node) const {
  const CellWalk::Spot spot = walk.at(node);
  const TileId home = impl_->store.home(walk.graph().positions[node]);
  // The home holds every segment at the node.
  ProxyPlace place = impl_->at(home, {cell, spot.segment}, spot.t);
  if (!place.valid()) throw InputError("a sample lies in no tile: verify the set");
  return place;
}

ProxyPlace PlaceFinder::at(const CellWalk& walk, std::uint32_t cell, const CellPlace& place) const {
  if (place.t == 0 || place.t == 1) return atSample(walk, cell, place.t == 0 ? place.child : place.parent);
  // The home of the child holds the segment.
  return impl_->at(impl_->store.home(walk.graph().positions[place.child]), {cell, place.segment}, place.t);
}

std::shared_ptr<const CellWalk> PlaceFinder::walk(std::uint32_t cell, const std::atomic<bool>* stop) const {
  return std::make_shared<const CellWalk>(readCell(impl_->store, cell, true, stop));
}

// Reads the cell's tiles until one has the root's sample: most of a large cell lies elsewhere.
ProxyPlace PlaceFinder::soma(std::uint32_t cell) const {
  const CellDetail detail = impl_->store.loadCellDetail(cell);
  const auto soma = std::find_if(detail.roots.begin(), detail.roots.end(),
                                 [](const CellDetail::Root& root) { return root.type == kSomaType; });
  const auto root = soma != detail.roots.end() ? soma : detail.roots.begin();
  if (root != detail.roots.end()) {
    const NodeId sample{cell, root->rank};
    TilesAhead ahead(impl_->store, detail.tiles, false, TilesAhead::Reads::awaited);
    for (std::size_t i = 0; i < detail.tiles.size(); ++i) {
      const std::shared_ptr<const Tile> tile = ahead.next().tile;
      for (std::uint32_t node = 0; node < tile->node_count(); ++node)
        if (tile->nodeId(node) == sample) return impl_->atNode(tile, node);
    }
  }
  throw InputError("the cell's root lies in no tile: verify the set");
}

ProxyPlace PlaceFinder::find(const CellQuery& query) const {
  if (query.p_W) {
    const std::optional<Picked> found = nearest(*query.p_W);
    if (!found) throw UsageError("the scene has no segments");
    return found->place;
  }
  const std::vector<std::uint32_t> cells = findCells(impl_->store, query.name, 1);
  if (cells.empty()) {
    std::string what = "no cell has a name with '";
    what += escaped(query.name, 60);
    throw UsageError(what += "' in it");
  }
  if (!query.place) return soma(cells[0]);
  const std::shared_ptr<const CellWalk> read = walk(cells[0]);
  return at(*read, cells[0], placesOf(read->paths(), *query.place).front());
}

std::optional<Junction> PlaceFinder::junction(const ProxyPlace& place, const Vector3d& heading_W, double reach_um,
                                              double length_um) const {
  if (!place.valid()) return std::nullopt;
  const std::lock_guard lock(impl_->mutex);
  Reading reading(impl_->store);
  reading.load(place.tile);
  for (int round = 0;; ++round) {
    JunctionSearch search =
        findJunction(reading.graph, place, heading_W, reach_um, length_um, kMostJunctionSegments, &impl_->somata);
    if (search.absent.empty() || round == kMostReadings) return std::move(search.junction);
    reading.load(search.absent.front());
  }
}

}  // namespace filiform
