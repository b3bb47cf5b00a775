// Measures of small cells whose values follow by hand, and of random cells against slow sums.
#include "index/measure/cell_measures.h"

#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"

#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using std::numbers::pi;
using test::addSample;

CellTree treeInSet(const Cell& cell) { return treeOf(readCell(*test::storeOf({cell}, 3), 0, true)); }
double valueOf(const Measures& m, const std::string& name, const SomaShape* soma = nullptr) {
  const Feature* feature = findFeature(name);
  EXPECT_NE(feature, nullptr) << name;
  return feature == nullptr ? 0 : feature->value(m, soma);
}
void expectValues(const Measures& m, const std::map<std::string, double>& wanted) {
  for (const auto& [name, value] : wanted) EXPECT_NEAR(valueOf(m, name), value, 1e-12 * std::abs(value)) << name;
}

Cell emptyCell() {
  Cell cell;
  cell.source = "cell.swc";
  return cell;
}

// A stem of 10 um along x from the soma's sample on, then a fork: 3 um up, and 4 um down with a corner of 5 um on.
Cell forkWithSoma() {
  Cell cell = emptyCell();
  const auto soma = addSample(cell, {0, 0, 0}, kNoParent, 5, 1);
  const auto stem = addSample(cell, {6, 0, 0}, soma, 2, 3);
  const auto fork = addSample(cell, {16, 0, 0}, stem, 2, 3);
  addSample(cell, {16, 3, 0}, fork, 1, 3);
  const auto corner = addSample(cell, {16, -4, 0}, fork, 1, 3);
  addSample(cell, {21, -4, 0}, corner, 0.5f, 3);
  return cell;
}

TEST(CellMeasures, OfAFork) {
  const CellMeasures cell = measuresOf(treeInSet(forkWithSoma()), {.per = MeasurePer::kBranch});
  expectValues(cell.all, {{"neurites", 1},
                          {"sections", 3},
                          {"segments", 4},
                          {"bifurcations", 1},
                          {"forks", 1},
                          {"tips", 2},
                          {"loops", 0},
                          {"length", 10 + 3 + 9},
                          {"soma_link_length", 6},
                          {"section_length_max", 10},
                          {"section_length_mean", 22.0 / 3},
                          {"tip_path_max", 19},
                          {"tip_path_mean", 16},
                          {"tip_radial_max", std::sqrt(21.0 * 21 + 16)},
                          {"branch_order_max", 1},
                          {"strahler_max", 2},
                          {"asymmetry_mean", 0},
                          {"remote_angle_mean", pi / 2 + std::atan2(4, 5)},
                          {"local_angle_mean", pi},
                          {"tortuosity_mean", (1 + 1 + 9 / std::sqrt(41.0)) / 3},
                          {"taper_mean", (0 + 2.0 / 3 + 3.0 / 9) / 3},
                          {"sibling_ratio_mean", 1},
                          {"diameter_power_mean", 2 * std::sqrt(8.0)},
                          {"width", 15},
                          {"height", 7},
                          {"depth", 0},
                          {"x0", 6},
                          {"y1", 3}});
  double area_um2 = pi * 4 * 10 + pi * 3 * std::sqrt(1 + 9.0) + pi * 3 * std::sqrt(1 + 16.0);
  area_um2 += pi * 1.5 * std::sqrt(0.25 + 25);
  EXPECT_NEAR(cell.all.area_um2, area_um2, 1e-10);
  EXPECT_NEAR(cell.all.volume_um3, pi * (40 + 7 + 7 * 4 / 3.0 + 5 * 1.75 / 3), 1e-10);
  EXPECT_NEAR(valueOf(cell.all, "soma_area", &cell.soma), 100 * pi, 1e-10);
  ASSERT_EQ(cell.parts.size(), 3u);
  EXPECT_EQ(cell.parts[2].parent, 0u);
  EXPECT_EQ(cell.parts[2].measures.length_um, 9);
  EXPECT_EQ(cell.parts[2].rank, 5u);
}

TEST(CellMeasures, OfThreeStemsByType) {
  Cell cell = emptyCell();
  const auto soma = addSample(cell, {0, 0, 0}, kNoParent, 5, 1);
  addSample(cell, {-5, 0, 0}, soma, 5, 1);
  addSample(cell, {5, 0, 0}, soma, 5, 1);
  for (const std::uint16_t type : {std::uint16_t{2}, std::uint16_t{3}, std::uint16_t{3}}) {
    const Vector3d way = type == 2 ? Vector3d(0, -1, 0) : Vector3d(0, 0, cell.samples() > 5 ? -1 : 1);
    addSample(cell, 30 * way, addSample(cell, 7 * way, soma, 1, type), 1, type);
  }
  const CellMeasures m = measuresOf(treeInSet(cell), {.per = MeasurePer::kType, .sholl_um = 10});
  EXPECT_EQ(m.soma.form, SomaShape::Form::kThreePoint);
  EXPECT_NEAR(m.soma.area_um2, 100 * pi, 1e-10);
  EXPECT_NEAR(m.soma.radius_um, 5, 1e-12);
  EXPECT_EQ(m.all.neurites, 3u);
  ASSERT_EQ(m.parts.size(), 2u);
  EXPECT_EQ(m.parts[0].type, 2);
  EXPECT_EQ(m.parts[0].measures.length_um, 23);
  EXPECT_EQ(m.parts[1].measures.neurites, 2u);
  EXPECT_EQ(m.parts[1].measures.length_um, 46);
  EXPECT_EQ(m.all.sholl, (std::vector<std::uint64_t>{0, 3, 3}));  // spheres of 5, 15 and 25 um
}

// A square of 4 um a side: its last link closes the loop. No soma, so distances begin at the first sample.
TEST(CellMeasures, OfALoop) {
  Cell cell = emptyCell();
  for (const Vector3d& p : {Vector3d(0, 0, 0), {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {-3, 4, 0}}) addSample(cell, p);
  connect(cell, {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {3, 4}});
  ASSERT_TRUE(cell.isGraph());
  const CellMeasures m = measuresOf(treeInSet(cell), {.sholl_um = 1});
  expectValues(m.all, {{"neurites", 1}, {"loops", 1}, {"segments", 5}, {"length", 19}, {"tips", 2}, {"forks", 1}});
  EXPECT_TRUE(m.all.sholl.empty());
  EXPECT_EQ(m.soma.form, SomaShape::Form::kNone);
  EXPECT_DOUBLE_EQ(valueOf(m.all, "tip_radial_max"), std::sqrt(32.0));
  EXPECT_TRUE(std::isnan(valueOf(m.all, "soma_x", &m.soma)));
  EXPECT_EQ(measuresOf(treeOf(cell)).all.length_um, 19);
}

TEST(CellMeasures, OfAForestWithoutSoma) {
  Cell cell = emptyCell();
  addSample(cell, {90, 0, 0});  // alone: no neurite
  for (int tree = 0; tree < 2; ++tree) {
    const auto root = addSample(cell, {10.0 * tree, 0, 0});
    addSample(cell, {10.0 * tree, 3, 4}, root);
  }
  const CellMeasures m = measuresOf(treeInSet(cell), {.per = MeasurePer::kNeurite});
  expectValues(m.all, {{"neurites", 2}, {"sections", 2}, {"length", 10}, {"tip_radial_max", 5}, {"strahler_max", 1}});
  ASSERT_EQ(m.parts.size(), 2u);
  EXPECT_EQ(m.parts[1].rank, 3u);
  EXPECT_TRUE(std::isnan(valueOf(m.all, "local_angle_mean")));
}

TEST(CellMeasures, ZeroLengthsAndUnknownRadiiCountAsZero) {
  Cell cell = emptyCell();
  const auto soma = addSample(cell, {0, 0, 0}, kNoParent, kUnknownRadius, 1);
  const auto first = addSample(cell, {1, 0, 0}, soma, 1);
  const auto same = addSample(cell, {1, 0, 0}, first, 1);
  const auto unknown = addSample(cell, {4, 0, 0}, same, kUnknownRadius);
  addSample(cell, {4, 0, 0}, unknown, 1);  // a tip on the fork: a section of one point
  addSample(cell, {8, 0, 0}, unknown, kUnknownRadius);
  const CellMeasures m = measuresOf(treeInSet(cell));
  expectValues(m.all, {{"sections", 3},
                       {"segments", 3},
                       {"zero_segments", 1},
                       {"unknown_radii", 2},
                       {"length", 7},
                       {"volume", pi},
                       {"tortuosity_mean", 1},
                       {"local_angle_mean", 0},
                       {"tip_path_mean", 5}});
  EXPECT_EQ(m.soma.radius_um, 0);
}

TEST(CellMeasures, OfNothing) {
  const CellMeasures m = measuresOf(treeOf(emptyCell()), {.per = MeasurePer::kType, .sholl_um = 1});
  EXPECT_EQ(m.all.cells, 1u);
  EXPECT_EQ(m.all.length_um, 0);
  EXPECT_TRUE(std::isnan(valueOf(m.all, "width")));
  EXPECT_TRUE(m.parts.empty());
}

// A chord dips into the sphere of 10 um between two samples, and a sample lies on that of 20 um.
TEST(CellMeasures, ShollCountsCrossingsOnSegments) {
  Cell cell = emptyCell();
  const auto soma = addSample(cell, {0, 0, 0}, kNoParent, 0, 1);
  const auto a = addSample(cell, {-15, 9, 0}, soma);
  const auto b = addSample(cell, {15, 9, 0}, a);
  addSample(cell, {25, 0, 0}, addSample(cell, {20, 0, 0}, b));
  const CellMeasures m = measuresOf(treeInSet(cell), {.sholl_um = 10});
  EXPECT_EQ(m.all.sholl, (std::vector<std::uint64_t>{0, 2, 1}));
  EXPECT_EQ(m.all.sholl_by_ends, (std::vector<std::uint64_t>{0, 0, 2}));
  EXPECT_THROW(measuresOf(treeInSet(cell), {.sholl_um = 1e-6}), UsageError);
}

// Against points every 1/64 of each segment: a crossing is a change of side.
TEST(CellMeasures, ShollIsThatOfManyPoints) {
  constexpr std::uint64_t kSeed = 7;
  SCOPED_TRACE(kSeed);
  Cell cell = test::randomNeuron(kSeed, {.samples = 400, .step_um = 20});
  cell.types[0] = 1;
  const CellTree tree = treeInSet(cell);
  const CellMeasures m = measuresOf(tree, {.sholl_um = 25});
  std::vector<std::uint64_t> wanted(m.all.sholl.size());
  for (const CellTree::Section& section : tree.sections)
    for (std::uint32_t i = section.first + 1; i < section.first + section.count; ++i)
      for (std::size_t bin = 0; bin < wanted.size(); ++bin) {
        const double r = tree.soma.radius_um + 25 * static_cast<double>(bin);
        bool inside = (tree.points_um[i - 1] - tree.soma.centre_um).norm() < r;
        constexpr int kParts = 512;
        for (int part = 1; part <= kParts; ++part) {
          const Vector3d p =
              tree.points_um[i - 1] + (tree.points_um[i] - tree.points_um[i - 1]) * (part / double{kParts});
          const bool now = (p - tree.soma.centre_um).norm() < r;
          wanted[bin] += now != inside;
          inside = now;
        }
      }
  EXPECT_EQ(m.all.sholl, wanted);
}

TEST(CellMeasures, PartsAddUpToTheCell) {
  constexpr std::uint64_t kSeed = 11;
  SCOPED_TRACE(kSeed);
  Cell cell = test::randomNeuron(kSeed, {.samples = 3000, .branching = 0.1, .extra_root = 0.01});
  for (std::size_t i = 0; i < cell.samples(); ++i)
    if (cell.parents[i] == kNoParent) cell.types[i] = static_cast<std::uint16_t>(i % 5);
  const CellTree tree = treeInSet(cell);
  for (const MeasurePer per : {MeasurePer::kType, MeasurePer::kNeurite, MeasurePer::kBranch}) {
    const CellMeasures m = measuresOf(tree, {.per = per});
    Measures sum;
    for (const MeasuredPart& part : m.parts) sum.add(part.measures);
    EXPECT_EQ(sum.segments, m.all.segments);
    EXPECT_EQ(sum.sections, m.all.sections);
    EXPECT_EQ(sum.tips, m.all.tips);
    EXPECT_NEAR(sum.length_um, m.all.length_um, 1e-8);
    EXPECT_EQ(sum.hi_um, m.all.hi_um);
    EXPECT_EQ(sum.tip_path_um.most, m.all.tip_path_um.most);
  }
  // Tips = neurites + the sum over forks of children - 1.
  std::uint64_t tips = tree.neurites.size();
  for (const CellTree::Section& section : tree.sections) tips += section.children > 1 ? section.children - 1 : 0;
  EXPECT_EQ(measuresOf(tree).all.tips, tips);
}

TEST(CellMeasures, FeaturesHaveNamesOfTheirOwn) {
  for (const Feature& feature : features()) {
    EXPECT_EQ(findFeature(feature.name), &feature);
    EXPECT_EQ(findFeature(titleOf(feature)), &feature);
  }
  EXPECT_EQ(findFeature("lenght"), nullptr);
}

}  // namespace
}  // namespace filiform
