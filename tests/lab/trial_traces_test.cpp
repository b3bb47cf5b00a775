#include "tools/lab/evaluate/trials/trial.h"
#include "tools/lab/evaluate/trials/trial_corpus.h"
#include "tools/synthetic/synthetic.h"

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

// One route of a lattice trace and one of a trace with a jittered depth, at a fine and a coarse zoom.
TEST(Trial, ClimbCompletesRoutesOfTraces) {
  SyntheticOptions options;
  options.kind = "traces";
  options.cells = 2;
  options.seed = 1;
  SyntheticCells cells(options);
  RouteDraw draw;
  draw.longest_um = 200;
  const TrialCorpus corpus = drawCorpus(cells, 2, draw);
  ASSERT_EQ(corpus.cells.size(), 2u);
  for (const CorpusCell& drawn : corpus.cells) {
    TrialCell cell(drawn.cell);
    const CellGraph& graph = cell.graph();
    for (const DrawnRoute& route : drawn.routes) {
      const Route way(0, graph.grid, graph.positions, graph.parents, route.first, route.last);
      for (const double zoom_um : {100.0, 1000.0}) {
        TrialSetup setup;
        setup.zoom_um = zoom_um;
        EXPECT_TRUE(runTrial(cell, way, setup).completed) << drawn.cell.source << " at " << zoom_um << " um";
      }
    }
  }
}

}  // namespace
}  // namespace filiform::tools
