#include "tools/lab/evaluate/trials/trial_corpus.h"

#include "solver/travel/routes/route.h"
#include "tests/lab/evaluation_cells.h"
#include "tools/lab/evaluate/trials/trial_cell.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

std::vector<Cell> someCells(int count) {
  std::vector<Cell> cells;
  for (int i = 0; i < count; ++i) {
    cells.push_back(test::randomTree(static_cast<std::uint64_t>(i) + 1, 200));
    cells.back().source = "c" + std::to_string(i);
  }
  return cells;
}

TEST(TrialCorpus, RoutesHaveTheLengthThatIsSaid) {
  RouteDraw draw;
  draw.shortest_um = 10;
  draw.longest_um = 60;
  bool cut = false, whole = false, tip_to_tip = false;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Cell cell = test::randomTree(seed, 200);
    TrialCell trial(cell);
    const CellGraph& graph = trial.graph();
    for (const DrawnRoute& drawn : drawRoutes(cell, draw)) {
      const Route route(0, graph.grid, graph.positions, graph.parents, drawn.first, drawn.last);
      EXPECT_NEAR(route.length_um(), drawn.length_um, 1e-9);
      EXPECT_GE(drawn.length_um, draw.shortest_um);
      EXPECT_LE(drawn.length_um, draw.longest_um);
      (drawn.cut ? cut : whole) = true;
      tip_to_tip = tip_to_tip || drawn.tip_to_tip;
    }
  }
  EXPECT_TRUE(cut && whole && tip_to_tip) << "the test saw every kind";
}

TEST(TrialCorpus, DoesNotDependOnTheOrderOfArrival) {
  RouteDraw draw;
  draw.shortest_um = 10;
  std::vector<Cell> cells = someCells(9);
  CellList forwards(cells);
  std::reverse(cells.begin(), cells.end());
  CellList backwards(cells);
  const TrialCorpus a = drawCorpus(forwards, 40, draw), b = drawCorpus(backwards, 40, draw);
  ASSERT_EQ(a.cells.size(), b.cells.size());
  EXPECT_EQ(a.routes, 40u);
  for (std::size_t i = 0; i < a.cells.size(); ++i) {
    EXPECT_EQ(a.cells[i].cell.source, b.cells[i].cell.source);
    EXPECT_EQ(a.cells[i].held_out, b.cells[i].held_out);
    ASSERT_EQ(a.cells[i].routes.size(), b.cells[i].routes.size());
    for (std::size_t r = 0; r < a.cells[i].routes.size(); ++r) {
      EXPECT_EQ(a.cells[i].routes[r].first, b.cells[i].routes[r].first);
      EXPECT_EQ(a.cells[i].routes[r].last, b.cells[i].routes[r].last);
      EXPECT_EQ(a.cells[i].routes[r].key, b.cells[i].routes[r].key);
    }
  }
}

TEST(TrialCorpus, HoldsTheLastThirdByDigestOut) {
  RouteDraw draw;
  draw.shortest_um = 10;
  CellList cells(someCells(9));
  const TrialCorpus corpus = drawCorpus(cells, 1000, draw);
  ASSERT_EQ(corpus.cells.size(), 9u);
  for (std::size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(corpus.cells[i].held_out, i >= 6);
    if (i > 0) {
      EXPECT_LT(corpus.cells[i - 1].cell.digest, corpus.cells[i].cell.digest);
    }
  }
}

TEST(TrialCorpus, FewRoutesAreSpreadOverTheCells) {
  RouteDraw draw;
  draw.shortest_um = 10;
  CellList cells(someCells(9));
  const TrialCorpus corpus = drawCorpus(cells, 3, draw);
  ASSERT_EQ(corpus.cells.size(), 3u);
  EXPECT_EQ(std::count_if(corpus.cells.begin(), corpus.cells.end(), [](const CorpusCell& c) { return c.held_out; }), 1);
}

TEST(TrialCorpus, SkipsCopiesLoopsAndCellsThatAreTooSmall) {
  std::vector<Cell> cells = someCells(2);
  cells.push_back(cells.front());
  cells.back().source = "copy";
  cells.push_back(test::cellOf({{0, 0, 0}, {1, 0, 0}}, {kNoParent, 0}));
  cells.push_back(test::cellOf({{0, 0, 0}, {50, 0, 0}, {0, 50, 0}}, {}));
  connect(cells.back(), {{0, 1}, {1, 2}, {2, 0}});
  RouteDraw draw;
  draw.shortest_um = 10;
  CellList stream(cells);
  const TrialCorpus corpus = drawCorpus(stream, 1000, draw);
  EXPECT_EQ(corpus.listed, 5u);
  EXPECT_EQ(corpus.duplicates, 1u);
  EXPECT_EQ(corpus.graphs, 1u);
  EXPECT_EQ(corpus.cells.size(), 2u);
  for (const CorpusCell& cell : corpus.cells)
    EXPECT_NE(cell.cell.source, "copy") << "of equal cells the first by source";
}

}  // namespace
}  // namespace filiform::tools
