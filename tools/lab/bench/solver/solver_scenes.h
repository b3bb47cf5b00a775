// The cells and the walks of a hand on which the solvers are timed. Thread rule: functions without state; one thread a
// scene.
#pragma once

#include "index/ingest/memory_tiles.h"
#include "solver/graph/graph_view.h"
#include "solver/proxy/parameters.h"
#include "tools/lab/bench/bench.h"
#include "tools/lab/reference/literal_solver.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace filiform::tools {

// The same cells twice: as tiles, all resident, and as one flat graph.
struct SolverScene {
  SolverScene(std::string scene_name, std::vector<Cell> cells);  // throws what ingest throws

  std::string name;
  std::unique_ptr<TileStore> store;
  std::vector<std::shared_ptr<const Tile>> tiles;
  std::unique_ptr<TileTable> table;
  std::unique_ptr<GraphView> view;
  std::vector<StoredSegment> owned;  // every segment once
  std::vector<TileId> owners;        // of `owned`
  std::unique_ptr<WholeGraph> whole;
  SolverParameters parameters;  // of the first cell

  std::size_t anyOwned(std::mt19937_64& random) const;  // index of a segment with two different ends
  ProxyPlace placeOn(std::size_t at) const { return view->placeAt(owners[at], owned[at].id, 0.5); }
};

// The position of a hand at each tick.
struct Walk {
  std::string name;
  std::size_t start;  // in SolverScene::owned
  double zoom_um;     // across 12 cm of the device
  std::vector<Vector3d> probes_W;

  double scale_um_m() const { return zoom_um / 0.12; }
};

Vector3d inCube(std::mt19937_64& random);  // uniform in the cube of side 2 around the origin

// Returns a scene of synthetic neurons, and one of real cells if the options name a folder. Throws what
// morphologyLibrary throws.
std::vector<SolverScene> cellScenes(const BenchOptions& options);
// Adds the scenes with the longest ticks: a hub, a comb and one long neurite.
void addExtremeScenes(std::vector<SolverScene>& scenes, const BenchOptions& options);
// Returns a hand along the neurites at three speeds, the first of which is 50 mm/s; and a hand that jumps anywhere each
// tick.
std::vector<Walk> handWalks(const SolverScene& scene, const BenchOptions& options);

}  // namespace filiform::tools
