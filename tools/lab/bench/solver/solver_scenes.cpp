#include "tools/lab/bench/solver/solver_scenes.h"

#include "tools/lab/bench/index/dense_cells.h"
#include "tools/lab/bench/index/extreme_cells.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace filiform::tools {

namespace {

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

std::string at(double zoom_um) { return std::to_string(std::lround(zoom_um)) + " um across 12 cm"; }

// Returns a hand that follows the neurites at a constant speed, takes a random branch at each node, and deviates
// smoothly by about `off_um`.
Walk alongNeurites(const SolverScene& scene, double um_a_tick, double zoom_um, double off_um, std::size_t ticks,
                   std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const WholeGraph& whole = *scene.whole;
  std::string speed = std::to_string(um_a_tick);
  speed.erase(speed.find_last_not_of('0') + 1);
  Walk walk{"hand, " + speed + " um a tick, " + at(zoom_um), scene.anyOwned(random), zoom_um, {}};
  std::uint32_t segment = whole.segment(scene.owned[walk.start].id);
  std::uint32_t from = whole.segments()[segment].child;
  double along = 0;
  Vector3d off_W = Vector3d::Zero(), drift_W = Vector3d::Zero();
  while (walk.probes_W.size() < ticks) {
    const WholeGraph::Segment& s = whole.segments()[segment];
    const std::uint32_t to = s.child == from ? s.parent : s.child;
    const Vector3d from_W = whole.nodes()[from].p_W, to_W = whole.nodes()[to].p_W;
    const double length = (to_W - from_W).norm();
    while (along < length && walk.probes_W.size() < ticks) {
      drift_W += 0.02 * inCube(random) - 0.01 * drift_W - 1e-4 * off_W / off_um;
      off_W = 0.999 * off_W + 0.01 * off_um * drift_W;
      walk.probes_W.push_back(from_W + (along / length) * (to_W - from_W) + off_W);
      along += um_a_tick;
    }
    along -= length;
    const std::vector<std::uint32_t>& incident = whole.nodes()[to].incident;
    std::uint32_t next = segment;  // back where it ends
    if (incident.size() > 1) do
        next = incident[random() % incident.size()];
      while (next == segment);
    segment = next;
    from = to;
  }
  return walk;
}

Walk jumps(const SolverScene& scene, double zoom_um, std::size_t ticks, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Walk walk{"jumps anywhere, each tick, " + at(zoom_um), scene.anyOwned(random), zoom_um, {}};
  while (walk.probes_W.size() < ticks)
    walk.probes_W.push_back(scene.whole->nodes()[random() % scene.whole->nodes().size()].p_W + 5.0 * inCube(random));
  return walk;
}

Cell longNeurite(std::uint32_t samples) {
  Cell cell = emptyCell("neurite.swc");
  addSample(cell, Vector3d::Zero(), kNoParent);
  for (std::uint32_t i = 1; i < samples; ++i) addSample(cell, Vector3d(0.5 * i, i % 7 * 0.1, 0), i - 1);
  return cell;
}

}  // namespace

SolverScene::SolverScene(std::string scene_name, std::vector<Cell> cells) : name(std::move(scene_name)) {
  CellList stream(std::move(cells));
  store = buildTilesInMemory(stream);
  table = std::make_unique<TileTable>(store->tile_count());
  for (TileId id = 0; id < store->tile_count(); ++id) {
    tiles.push_back(store->load(id));
    const Tile& tile = *tiles.back();
    table->add(tile);
    for (std::uint32_t s = 0; s < tile.segment_count(); ++s) {
      if (!tile.owned(s)) continue;
      const std::uint32_t child = tile.child(s), parent = tile.parent(s);
      owned.push_back({tile.segmentId(s), tile.nodeId(child).sample, tile.nodeId(parent).sample, tile.gridPoint(child),
                       tile.gridPoint(parent), true});
      owners.push_back(id);
    }
  }
  view = std::make_unique<GraphView>(*table, store->leaves(), store->grid());
  whole = std::make_unique<WholeGraph>(owned, store->grid());
  parameters = automaticParameters(*store, 0);
}

std::size_t SolverScene::anyOwned(std::mt19937_64& random) const {
  for (;;) {
    const std::size_t at = random() % owned.size();
    if (owned[at].child != owned[at].parent) return at;
  }
}

Vector3d inCube(std::mt19937_64& random) {
  const double x = uniform(random), y = uniform(random), z = uniform(random);
  return 2.0 * Vector3d(x, y, z) - Vector3d::Ones();
}

std::vector<SolverScene> cellScenes(const BenchOptions& options) {
  const std::size_t cells = options.quick ? 1 : 8;
  std::vector<SolverScene> scenes;
  scenes.emplace_back("synthetic column", morphologyLibrary({}, cells, options.seed));
  if (!options.corpus.empty())
    scenes.emplace_back("real cells", morphologyLibrary(options.corpus, cells, options.seed));
  return scenes;
}

void addExtremeScenes(std::vector<SolverScene>& scenes, const BenchOptions& options) {
  scenes.emplace_back("hub of 10 000", std::vector<Cell>{hubCell(10000, options.seed)});
  scenes.emplace_back("comb of 200 000", std::vector<Cell>{combCell(options.quick ? 2000 : 200000)});
  scenes.emplace_back("neurite of 1 000 000", std::vector<Cell>{longNeurite(options.quick ? 2000 : 1000000)});
}

std::vector<Walk> handWalks(const SolverScene& scene, const BenchOptions& options) {
  const std::size_t ticks = options.quick ? 5000 : 20000;
  std::vector<Walk> walks;
  walks.push_back(alongNeurites(scene, 0.125, 300, 1.0, ticks, options.seed));
  walks.push_back(alongNeurites(scene, 1.25, 300, 1.0, ticks / 2, options.seed));
  walks.push_back(alongNeurites(scene, 12.5, 1000, 1.0, ticks / 5, options.seed));
  walks.push_back(jumps(scene, 1000, std::max<std::size_t>(ticks / 10, 1000), options.seed));
  return walks;
}

}  // namespace filiform::tools
