// Three-point and contour somata are drawn as one sphere. Their samples are neither branches nor tips. Everything else
// is drawn as in the file.
#include "index/ingest/ingest.h"
#include "index/levels/levels.h"
#include "index/query/cell_graph.h"
#include "index/set/tile_set.h"
#include "solver/travel/places/cell_walk.h"
#include "solver/travel/places/place_finder.h"
#include "tests/support/golden.h"
#include "tests/support/process.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"
#include "viewer/scene/neurite_batches.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::runFiliform;

// r = 10; a dendrite to the right that forks, an axon to the left: from x = -70 to 60.
const char* const kThreePointText =
    "1 1 0 0 0 10 -1\n2 1 0 -10 0 10 1\n3 1 0 10 0 10 1\n4 3 10 0 0 1 1\n5 3 40 5 0 1 4\n6 3 60 25 0 1 5\n"
    "7 3 60 -15 0 1 5\n8 2 -10 0 0 0.5 1\n9 2 -40 -5 0 0.5 8\n10 2 -70 0 0 0.5 9\n";

// The same neurites on an outline of 12 samples of radius 0 (ids 11 to 21 follow the root).
std::string contourText() {
  std::string text = "1 1 10 0 0 0 -1\n";
  for (int i = 1; i < 12; ++i) {
    const double angle = 2 * std::numbers::pi * i / 12;
    text += std::to_string(10 + i) + " 1 " + std::to_string(10 * std::cos(angle)) + " " +
            std::to_string(10 * std::sin(angle)) + " 0 0 " + std::to_string(i == 1 ? 1 : 9 + i) + "\n";
  }
  return text + "5 3 40 5 0 1 1\n6 3 60 25 0 1 5\n7 3 60 -15 0 1 5\n9 2 -40 -5 0 0.5 16\n10 2 -70 0 0 0.5 9\n";
}

struct Extent {
  int across = 0;  // pixels from the first lit column to the last
  int high = 0;    // lit pixels of the fullest column
};

Extent extentOf(const Picture& picture) {
  const auto at = [&](int x, int y) { return &picture.rgb[3 * (static_cast<std::size_t>(y) * picture.width + x)]; };
  const std::uint8_t* const ground = at(0, 0);
  Extent extent;
  int first = picture.width, last = -1;
  for (int x = 0; x < picture.width; ++x) {
    int lit = 0;
    for (int y = 0; y < picture.height; ++y) {
      const std::uint8_t* const p = at(x, y);
      lit += std::abs(p[0] - ground[0]) + std::abs(p[1] - ground[1]) + std::abs(p[2] - ground[2]) > 60 ? 1 : 0;
    }
    if (lit == 0) continue;
    first = std::min(first, x);
    last = x;
    extent.high = std::max(extent.high, lit);
  }
  extent.across = last - first;
  return extent;
}

class DrawnSoma : public ::testing::Test {
 protected:
  DrawnSoma() {
    test::writeBytes(folder_ / "three.swc", kThreePointText);
    test::writeBytes(folder_ / "contour.swc", contourText());
  }
  Extent rendered(const std::string& scene, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"render",  folder_ / scene, "-o", folder_ / "p.png", "--orthographic", "--size",
                                       "600x400", "--error",       "0"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const test::Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return extentOf(test::readPng(folder_ / "p.png"));
  }
  void expectTwoRadii(const Extent& extent) {
    ASSERT_GT(extent.across, 300);
    EXPECT_NEAR(extent.high, extent.across * 20.0 / 131, 4) << "of " << extent.across;
  }
  test::TempFolder folder_;
};

TEST_F(DrawnSoma, IsAsWideAsItsSphere) {
  for (const std::string name : {"three", "contour"}) {
    SCOPED_TRACE(name);
    expectTwoRadii(rendered(name + ".swc"));
    for (const char* capacity : {"2", "2048"}) {
      const std::string set = name + capacity + ".fil";
      ASSERT_EQ(
          runFiliform({"ingest", folder_ / (name + ".swc"), "-o", folder_ / set, "--capacity", capacity}).exit_code, 0);
      expectTwoRadii(rendered(set));
      expectTwoRadii(rendered(set, {"--highlight", name}));
      expectTwoRadii(rendered(set, {"--camera", "back"}));
    }
  }
}

TEST_F(DrawnSoma, OneThatIsOffIsDrawnAsItsSamplesAre) {
  std::string text = kThreePointText;
  text.replace(text.find("3 1 0 10 0"), 10, "3 1 0 11 0");
  test::writeBytes(folder_ / "off.swc", text);
  const Extent extent = rendered("off.swc");
  EXPECT_NEAR(extent.high, extent.across * 41.0 / 131, 4);
}

TEST_F(DrawnSoma, SamplesCountsNearestAndExportStay) {
  ASSERT_EQ(runFiliform({"ingest", folder_ / "three.swc", "-o", folder_ / "t.fil", "--capacity", "3"}).exit_code, 0);
  const auto info = nlohmann::json::parse(runFiliform({"info", folder_ / "t.fil", "--json"}).out);
  EXPECT_EQ(info.at("samples"), 10);
  EXPECT_EQ(info.at("segments"), 9);
  const auto nearest = nlohmann::json::parse(runFiliform({"nearest", folder_ / "t.fil", "0", "15", "0", "--json"}).out);
  EXPECT_EQ(nearest.at(0).at("distance"), 5);
  EXPECT_EQ(nearest.at(0).at("sample"), 3);
  ASSERT_EQ(runFiliform({"export", folder_ / "t.fil", "--cell", "three", "-o", folder_ / "back.swc"}).exit_code, 0);
  const std::string back = test::readBytes(folder_ / "back.swc");
  EXPECT_TRUE(back.ends_with(kThreePointText)) << back;
}

Cell cellOf(bool contour) {
  Cell cell;
  if (contour) {
    for (std::uint32_t i = 0; i < 12; ++i) {
      const double angle = 2 * std::numbers::pi * i / 12;
      test::addSample(cell, {10 * std::cos(angle), 10 * std::sin(angle), 0}, i == 0 ? kNoParent : i - 1, 0, 1);
    }
  } else {
    test::addSample(cell, {0, 0, 0}, kNoParent, 10, 1);
    test::addSample(cell, {0, -10, 0}, 0, 10, 1);
    test::addSample(cell, {0, 10, 0}, 0, 10, 1);
  }
  // A dendrite that forks, an axon: six samples.
  const auto stem = test::addSample(cell, {40, 5, 0}, 0, 1, 3);
  test::addSample(cell, {60, 25, 0}, stem, 1, 3);
  test::addSample(cell, {60, -15, 0}, stem, 1, 3);
  const auto axon = test::addSample(cell, {-40, -5, 0}, contour ? 6 : 0, 0.5F, 2);
  test::addSample(cell, {-70, 0, 0}, axon, 0.5F, 2);
  return cell;
}

TEST(SomaBatches, HoldOneSphereAndNoSegmentWithinIt) {
  for (const bool contour : {false, true})
    for (const std::uint32_t capacity : {1U, 2U, 100U}) {
      const auto store = test::storeOf({cellOf(contour)}, capacity);
      SomaFinder finder(*store);
      RootTable roots;
      addRoots(*store, 0, roots);
      std::size_t others = 0, balls = 0;
      for (TileId id = 0; id < store->tile_count(); ++id) {
        const auto tile = store->load(id);
        const TileAppearance appearance = store->loadAppearance(id);
        const SomaTable somata = somataIn(*tile, appearance, roots, finder);
        const NeuriteBatch batch = makeBatch(*tile, appearance, {.roots = &roots, .somata = &somata});
        EXPECT_EQ(batch.implausible_radii, 0U);
        for (const DrawnSegment& s : batch.segments) {
          if (!std::equal(s.a_um, s.a_um + 3, s.b_um)) {
            ++others;
            EXPECT_LE(std::max(s.a_radius_um, s.b_radius_um), 1);
            continue;
          }
          ++balls;
          const Vector3d centre_W = batch.origin_W + Vector3d(s.a_um[0], s.a_um[1], s.a_um[2]);
          EXPECT_NEAR(centre_W.norm(), 0, 0.01);
          EXPECT_NEAR(s.a_radius_um, 10, 0.01);
          EXPECT_TRUE((centre_W.array() + 10 <= batch.hi_W.array() + 1e-3).all());
          EXPECT_TRUE((centre_W.array() - 10 >= batch.lo_W.array() - 1e-3).all());
        }
      }
      EXPECT_EQ(others, 5U) << contour << capacity;
      EXPECT_GE(balls, 1U);
      EXPECT_TRUE(capacity < 100 || balls == 1U) << balls;
    }
}

class LevelsOfSomata : public ::testing::TestWithParam<bool> {};  // true: contour somata
INSTANTIATE_TEST_SUITE_P(Forms, LevelsOfSomata, ::testing::Bool());

TEST_P(LevelsOfSomata, ShowSpheres) {
  const test::TempFolder folder;
  std::vector<Cell> cells;
  std::vector<Vector3d> centres_W;
  for (int i = 0; i < 12; ++i) {
    Cell cell = cellOf(GetParam());
    cell.source = "cell" + std::to_string(i) + ".swc";
    const Vector3d centre_W(150.0 * i, 13.7 + 40.0 * (i % 3), 7.0 * i);
    for (Vector3d& p : cell.positions_um) p += centre_W;
    centres_W.push_back(centre_W);
    // A long winding axon, so that there is something to simplify.
    for (std::uint32_t k = 1; k <= 300; ++k)
      test::addSample(cell, cell.positions_um[0] + Vector3d(0.3 * k, std::sin(0.2 * k), 20 + 1.0 * k),
                      k == 1 ? 0 : static_cast<std::uint32_t>(cell.samples() - 1), 0.3F, 2);
    cells.push_back(std::move(cell));
  }
  CellList stream(cells);
  IngestOptions options;
  options.capacity = 128;
  options.levels = true;
  ingest(stream, folder / "a.fil", options);
  const auto set = TileSet::open(folder / "a.fil");
  const auto levels = Levels::open(*set);
  std::size_t balls = 0, others = 0;
  for (LevelId id = 0; id < levels->size(); ++id) {
    if (levels->entry(id).error_um > 10) continue;  // the soma may be simplified away
    const auto tile = levels->load(id);
    const TileAppearance appearance = levels->loadAppearance(id);
    const NeuriteBatch batch = makeBatch(*tile, appearance);
    for (const DrawnSegment& s : batch.segments) {
      const Vector3d a_W = batch.origin_W + Vector3d(s.a_um[0], s.a_um[1], s.a_um[2]);
      const Vector3d b_W = batch.origin_W + Vector3d(s.b_um[0], s.b_um[1], s.b_um[2]);
      for (const Vector3d& centre_W : centres_W) {
        if ((a_W - centre_W).norm() > 10.1 || (b_W - centre_W).norm() > 10.1) continue;
        const bool is_sphere = (a_W - centre_W).norm() < 0.5 && a_W == b_W && std::abs(s.a_radius_um - 10) < 0.5;
        ++(is_sphere ? balls : others);
      }
    }
  }
  EXPECT_GE(balls, 12U);
  EXPECT_EQ(others, 0U);
}

TEST(SomaWalks, SomaSamplesAreNeitherTipsNorBranches) {
  for (const bool contour : {false, true}) {
    const auto store = test::storeOf({cellOf(contour)}, 2);
    const CellWalk walk(readCell(*store, 0, true));
    const std::uint32_t stem = contour ? 12 : 3, soma_samples = stem;
    std::vector<std::uint32_t> tips = walk.paths().tips(walk.at(stem), 10);
    std::sort(tips.begin(), tips.end());
    EXPECT_EQ(tips, (std::vector<std::uint32_t>{stem + 1, stem + 2, stem + 4}));
    EXPECT_EQ(walk.paths().farthestTip(walk.at(stem)), stem + 4);
    for (std::uint32_t turn = 0; turn < 8; ++turn) {
      const auto next = walk.nextBranch(walk.at(0), turn);
      ASSERT_TRUE(next);
      EXPECT_TRUE(*next == stem || *next == stem + 4) << *next;
    }
    // From a sample inside the soma a walk leads out again.
    for (std::uint32_t rank = 1; rank < soma_samples; ++rank) {
      const CellWalk::Spot spot = walk.at(rank);
      EXPECT_EQ(walk.root(spot), 0U);
      EXPECT_TRUE(walk.parent(spot));
      EXPECT_TRUE(walk.paths().length_um(spot, walk.at(stem)));
      EXPECT_TRUE(walk.paths().length_um(walk.at(stem), spot));
      walk.otherBranch(spot);
      EXPECT_TRUE(walk.previousBranch(spot));
    }
  }
}

TEST(SomaForks, CountTheNeuritesOnly) {
  Cell cell = cellOf(false);
  const auto third = test::addSample(cell, {0, 0, 30}, 0, 1, 3);
  for (const std::uint32_t capacity : {1U, 100U}) {
    const auto store = test::storeOf({cell}, capacity);
    const PlaceFinder finder(*store);
    const auto walk = finder.walk(0);
    for (const std::uint32_t from : {0U, 2U, third}) {
      const auto junction = finder.junction(finder.atSample(*walk, 0, from), Vector3d::Zero(), 45, 8);
      ASSERT_TRUE(junction) << from;
      EXPECT_EQ(junction->node.sample, 0U) << from;
      EXPECT_EQ(junction->branches.size(), 3U) << from;
    }
  }
}

TEST(SomaForks, TwoNeuritesAtASomaAreNoFork) {
  const auto store = test::storeOf({cellOf(false)}, 2);
  const PlaceFinder finder(*store);
  const auto walk = finder.walk(0);
  for (const std::uint32_t from : {0U, 1U, 2U, 6U}) {
    const auto junction = finder.junction(finder.atSample(*walk, 0, from), Vector3d::Zero(), 200, 8);
    ASSERT_TRUE(junction) << from;
    EXPECT_EQ(junction->node.sample, 3U) << from;
    EXPECT_EQ(junction->branches.size(), 3U) << from;
  }
}

}  // namespace
}  // namespace filiform
