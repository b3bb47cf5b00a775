#include "index/query/soma_finder.h"

#include "index/query/cell_graph.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <numbers>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A soma of three samples of 10 um, or an outline of 16 samples, with two winding neurites.
Cell cellWithSoma(bool contour, const Vector3d& centre) {
  Cell cell;
  cell.source = contour ? "contour.swc" : "three.swc";
  if (contour) {
    for (std::uint32_t i = 0; i < 16; ++i) {
      const double angle = 2 * std::numbers::pi * i / 16;
      test::addSample(cell, centre + Vector3d(10 * std::cos(angle), 10 * std::sin(angle), 0),
                      i == 0 ? kNoParent : i - 1, 0.1F, 1);
    }
  } else {
    test::addSample(cell, centre, kNoParent, 10, 1);
    test::addSample(cell, centre - Vector3d(0, 10, 0), 0, 10, 1);
    test::addSample(cell, centre + Vector3d(0, 10, 0), 0, 10, 1);
  }
  for (const std::uint32_t from : {0U, contour ? 5U : 0U}) {
    std::uint32_t parent = from;
    for (int i = 1; i <= 60; ++i)
      parent = test::addSample(cell, cell.positions_um[from] + Vector3d(2.0 * i, std::sin(0.3 * i), from + 0.5 * i),
                               parent, 0.5F, 3);
  }
  return cell;
}

TEST(SomaFinder, FindsOnTilesWhatTheCellHas) {
  std::vector<Cell> cells = {cellWithSoma(false, {5, 5, 5}), cellWithSoma(true, {3, -40, 9}), test::randomNeuron(3),
                             test::hub(20, 30)};
  for (const std::uint32_t capacity : {2U, 7U, 1000U}) {
    const auto store = test::storeOf(cells, capacity);
    SomaFinder finder(*store);
    for (std::uint32_t id = 0; id < store->cell_count(); ++id) {
      SCOPED_TRACE(store->cell(id).source);
      for (const bool with_appearance : {false, true}) {
        const CellGraph graph = readCell(*store, id, with_appearance);
        const bool has_soma = graph.source == "three.swc" || graph.source == "contour.swc";
        ASSERT_EQ(graph.somata.somata.size(), has_soma ? 1U : 0U);
        for (std::uint32_t rank = 0; rank < graph.samples(); ++rank) {
          const auto found = finder.of({id, rank}, graph.positions[rank]);
          const Soma* const expected = has_soma ? &graph.somata.somata[0] : nullptr;
          const bool member = expected != nullptr &&
                              (rank == 0 || std::count(expected->samples.begin(), expected->samples.end(), rank) > 0);
          ASSERT_EQ(found != nullptr, member) << rank;
          if (!found) continue;
          EXPECT_EQ(found->form, expected->form);
          EXPECT_EQ(found->root, 0U);
          EXPECT_EQ(found->samples, expected->samples);
          EXPECT_EQ(found->dead_ends, expected->dead_ends);
          EXPECT_NEAR((found->centre_um - expected->centre_um).norm(), 0, 1e-9);
          EXPECT_NEAR(found->radius_um, 10, 0.01);
        }
      }
    }
  }
}

TEST(SomaFinder, TheGridMakesNoSmallSomaOff) {
  Cell cell = cellWithSoma(false, {0.001, 0.0007, 0.0013});
  for (Vector3d& p : cell.positions_um) p *= 0.01;
  for (float& radius : cell.radii_um) radius *= 0.01F;
  const auto store = test::storeOf({cell}, 1000);
  EXPECT_EQ(readCell(*store, 0, true).somata.somata.size(), 1U);
}

}  // namespace
}  // namespace filiform
