// SegmentLooks gives the types and radii that the cells state.
#include "index/measure/segment_looks.h"

#include "index/query/nearest.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

double radiusOf(const Cell& cell, std::uint32_t child, double t) {
  const std::uint32_t parent = cell.parents[child] == kNoParent ? child : cell.parents[child];
  if (t == 0) return cell.radii_um[child];
  if (t == 1) return cell.radii_um[parent];
  return cell.radii_um[child] + t * (double{cell.radii_um[parent]} - cell.radii_um[child]);
}

void expectLook(const SegmentLook& look, const Cell& cell, std::uint32_t child, double t) {
  EXPECT_EQ(look.type, cell.types[child]);
  const double radius_um = radiusOf(cell, child, t);
  EXPECT_TRUE(look.radius_um == radius_um || (std::isnan(look.radius_um) && std::isnan(radius_um)))
      << look.radius_um << " for " << radius_um;
}

TEST(SegmentLooks, AreThoseOfTheSamples) {
  std::vector<test::NamedCells> scenes = test::worstCases();
  scenes.push_back({"column", test::randomColumn(31, 12, 400, 150)});
  std::mt19937_64 random(32);  // the seed of radii, types and points
  for (test::NamedCells& named : scenes) {
    SCOPED_TRACE(named.name);
    for (Cell& cell : named.cells)
      for (std::uint32_t i = 0; i < cell.types.size(); ++i) {
        cell.types[i] = static_cast<std::uint16_t>(random() % 9);
        cell.radii_um[i] = random() % 8 == 0 ? kUnknownRadius : static_cast<float>(random() % 64) / 16;
      }
    const auto store = test::storeOf(named.cells, 10);
    const Nearest nearest(*store, {.budget_bytes = 20'000}), axons(*store, {.filter = {.types = {2}}});
    SegmentLooks looks(nearest.tiles(), 20'000);
    std::normal_distribution<double> near(0, 80);
    std::vector<Vector3d> points;
    for (int i = 0; i < 30; ++i) points.emplace_back(near(random), near(random), near(random));
    const auto check = [&](const auto& found, const std::vector<SegmentLook>& of) {
      ASSERT_EQ(of.size(), found.size());
      for (std::size_t i = 0; i < found.size(); ++i)
        expectLook(of[i], named.cells[found[i].segment.cell], found[i].segment.segment, found[i].t);
    };
    const auto found = nearest.findAll(points, {.k = 5});
    const std::vector<SegmentLook> all = looks.of(found);
    std::size_t at = 0;
    for (const auto& some : found)
      for (const NearestResult& r : some) expectLook(all.at(at++), named.cells[r.segment.cell], r.segment.segment, r.t);
    EXPECT_EQ(at, all.size());
    const auto near_axons = axons.find(points[0], {.k = 9});
    check(near_axons, looks.of(near_axons));
    const auto hits = nearest.alongRay({.origin_W = points[1], .direction = {1, 2, 3}, .radius_um = 50});
    check(hits, looks.of(hits));
  }
}

TEST(SegmentLooks, ApproximateResultsHaveNone) {
  const auto store = test::storeOf(test::randomColumn(33, 3, 100, 50));
  const Nearest nearest(*store);
  const auto found = nearest.find({1, 2, 3}, {.k = 2, .approximate = true});
  for (const SegmentLook& look : SegmentLooks(nearest.tiles(), 0).of(found)) {
    EXPECT_FALSE(look.type);
    EXPECT_TRUE(std::isnan(look.radius_um));
  }
  EXPECT_EQ(nearest.bytes(), 0u);
}

}  // namespace
}  // namespace filiform
