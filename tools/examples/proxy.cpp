// Runs the proxy solver on one cell. A probe moves in a straight line from the first sample to the last sample; the
// proxy slides along the neurites.
//
//   proxy CELL.swc
#include <filiform/index/ingest/memory_tiles.h>
#include <filiform/index/input/input.h>
#include <filiform/index/query/nearest.h>
#include <filiform/solver/graph/graph_view.h>
#include <filiform/solver/proxy/proxy_solver.h>

#include <exception>
#include <iostream>
#include <memory>
#include <utility>
#include <vector>

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "usage: proxy CELL.swc\n";
    return 2;
  }
  try {
    filiform::Input input({arguments[1]});
    std::vector<filiform::Cell> cells(1);
    if (!input.next(cells[0])) throw std::runtime_error("no cell in the file");
    const filiform::Vector3d from_W = cells[0].positions_um.front(), to_W = cells[0].positions_um.back();
    filiform::CellList list(std::move(cells));
    const std::unique_ptr<filiform::TileStore> store = filiform::buildTilesInMemory(list);

    filiform::TileTable table(store->tile_count());  // for a large set, Residency fills the table
    std::vector<std::shared_ptr<const filiform::Tile>> tiles;
    for (filiform::TileId id = 0; id < store->tile_count(); ++id) table.add(*tiles.emplace_back(store->load(id)));
    const filiform::GraphView graph(table, store->leaves(), store->grid());

    const filiform::NearestResult start = filiform::Nearest(*store).find(from_W).at(0);
    const auto solver = filiform::makeProxySolver(filiform::SolverMethod::climb, filiform::SolverParameters());
    solver->setPlace(graph.placeAt(start.tile, start.segment, start.t));
    filiform::SolverStep step;
    for (int tick = 0; tick <= 2000; ++tick) {  // the solver neither locks nor allocates
      filiform::ProbeState probe;
      probe.h_W = from_W + (to_W - from_W) * (tick / 2000.0);
      solver->advance(graph, probe, step);
      if (tick % 400 == 0)
        std::cout << tick << " ms: proxy at " << solver->place().p_W.transpose() << ", "
                  << (probe.h_W - solver->place().p_W).norm() << " um from the probe, " << step.visited
                  << " segments visited\n";
    }
  } catch (const std::exception& error) {
    std::cerr << "proxy: " << error.what() << '\n';
    return 1;
  }
}
