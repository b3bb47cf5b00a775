// Cells and walks of a hand on which the solvers are timed. Functions without state; a scene is for one thread.
#pragma once

#include "index/build/memory_tiles.h"
#include "solver/graph/graph_view.h"
#include "solver/proxy/parameters.h"
#include "tools/lab/bench/bench.h"
#include "tools/lab/bench/literal_solver.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace filiform::tools {

// Cells as tiles, all resident, and as one flat graph.
struct SolverScene {
  SolverScene(std::string scene_name, std::vector<Cell> cells);  // throws what ingest throws

  std::string name;
  std::unique_ptr<TileStore> store;
  std::vector<std::shared_ptr<const Tile>> tiles;
  std::unique_ptr<TileTable> table;
  std::unique_ptr<GraphView> view;
  std::vector<StoredSegment> owned;
  std::vector<TileId> owners;  // of `owned`
  std::unique_ptr<WholeGraph> whole;
  SolverParameters parameters;  // of the first cell

  std::size_t anyOwned(std::mt19937_64& random) const;  // of two different ends
  ProxyPlace placeOn(std::size_t at) const { return view->placeAt(owners[at], owned[at].id, 0.5); }
};

// Where the hand is, tick by tick.
struct Walk {
  std::string name;
  std::size_t start;  // in SolverScene::owned
  double zoom_um;     // across 12 cm of the device
  std::vector<Vector3d> probes_W;

  double scale_um_m() const { return zoom_um / 0.12; }
};

Vector3d inCube(std::mt19937_64& random);  // of side 2, around the origin

// Synthetic neurons, and real cells where the options name a folder.
std::vector<SolverScene> cellScenes(const BenchOptions& options);
// Adds those that make one tick as long as it can be: a hub, a comb, a thread.
void addExtremeScenes(std::vector<SolverScene>& scenes, const BenchOptions& options);
// A hand along the neurites at three speeds, the first an ordinary one; and one that jumps anywhere each tick.
std::vector<Walk> handWalks(const SolverScene& scene, const BenchOptions& options);

}  // namespace filiform::tools
