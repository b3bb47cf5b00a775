// What a set states is compared with bytes that are there before memory follows it.
#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "index/query/cell_graph.h"
#include "index/set/forwarding_store.h"
#include "index/set/tile_set.h"
#include "index/verify/verify.h"
#include "tests/support/scenes/faulty_set.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"
#include "tests/support/what_of.h"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::unique_ptr<TileStore> smallStore() {
  CellList stream(test::randomColumn(5, 4, 200, 80));
  return buildTilesInMemory(stream, {.capacity = 50});
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(StatedSizes, ACellOfMoreSamplesThanTheSetIsRefusedWhenItsRecordIsUsed) {
  const test::TempFolder folder;
  test::writeBoastfulSet(*smallStore(), folder / "a.fil", 4'000'000'000, false);
  const auto set = TileSet::open(folder / "a.fil");
  const std::string says = "a cell has more samples or segments than the set";
  EXPECT_TRUE(contains(test::whatOf<CorruptSet>([&] { set->cell(0); }), says));
  EXPECT_TRUE(contains(test::whatOf<CorruptSet>([&] { set->loadCellDetail(1); }), says));
  EXPECT_TRUE(contains(test::whatOf<CorruptSet>([&] { set->cellTiles(1); }), says));
  EXPECT_FALSE(verify(folder / "a.fil").sound());
}

TEST(StatedSizes, CountsBeyondTheBytesAreRefusedAtOpening) {
  const auto store = smallStore();
  for (const char* const count : {"samples", "segments", "isolated", "roots", "stored_segments", "cells", "removed"}) {
    const test::TempFolder folder;
    test::writeFaultySet(*store, folder / "a.fil", {});
    TileSet::open(folder / "a.fil");
    test::changeManifest(folder / "a.fil", [&](auto& manifest) { manifest["counts"][count] = 4'000'000'000; });
    EXPECT_TRUE(contains(test::whatOf<CorruptSet>([&] { TileSet::open(folder / "a.fil"); }),
                         "counts more than its files can hold"))
        << count;
  }
}

// Within what the packs could hold.
TEST(StatedSizes, ACellWithFewerSamplesInItsTilesThanStatedIsDamage) {
  const test::TempFolder folder;
  test::writeBoastfulSet(*smallStore(), folder / "a.fil", 5000, true);
  const auto set = TileSet::open(folder / "a.fil");
  EXPECT_EQ(set->loadCellDetail(0).sample_ids.size(), 5000u);
  EXPECT_TRUE(contains(test::whatOf<CorruptSet>([&] { readCell(*set, 0, true); }), "is in no tile"));
}

// Answers as another store, but states 10^9 samples of each cell.
class Boastful final : public ForwardingStore {
 public:
  explicit Boastful(const TileStore& store) : ForwardingStore(store), record_(store.cell(0)) {
    record_.samples = 1'000'000'000;
    record_.segments = record_.samples - record_.roots;
  }
  const CellRecord& cell(std::uint32_t) const override { return record_; }
  CellDetail loadCellDetail(std::uint32_t id) const override {
    CellDetail detail = store_.loadCellDetail(id);
    detail.sample_ids = {};
    detail.sample_ids.add(1, 1'000'000'000);
    return detail;
  }

 private:
  CellRecord record_;
};

TEST(StatedSizes, MemoryForACellFollowsItsTiles) {
  const auto store = smallStore();
  EXPECT_TRUE(contains(test::whatOf<CorruptSet>([&] { readCell(Boastful(*store), 0, true); }),
                       "hold fewer samples than its record"));
}

// The first tiles hold the highest ranks, for which there is no room yet.
TEST(StatedSizes, ACellOfMoreThanAMillionSamplesIsReadWhole) {
  constexpr std::uint32_t kSamples = 1'200'000;
  std::vector<Cell> cells(1);
  for (std::uint32_t i = 0; i < kSamples; ++i)
    test::addSample(cells[0], Vector3d(0.5 * (kSamples - i), 0, 0), i == 0 ? kNoParent : i - 1);
  CellList stream(cells);
  const auto store = buildTilesInMemory(stream, {.capacity = 20000});
  const CellGraph graph = readCell(*store, 0, true);
  ASSERT_EQ(graph.samples(), kSamples);
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    ASSERT_EQ(graph.position_W(i), Vector3d(0.5 * (kSamples - i), 0, 0));
    ASSERT_EQ(graph.parents[i], i == 0 ? kNoParent : i - 1);
    ASSERT_EQ(graph.sample_ids[i], std::int64_t{i} + 1);
  }
}

TEST(StatedSizes, AnAppearanceOfMoreSegmentsThanItsGeometryIsRefused) {
  const test::TempFolder folder;
  const auto store = smallStore();
  test::Faults faults;
  faults.entry = [](TileId tile, TileEntry& entry) {
    if (tile == 0) entry.owned = entry.stored = 3'000'000'000;
  };
  test::writeFaultySet(*store, folder / "a.fil", faults);
  test::changeManifest(folder / "a.fil", [](auto& manifest) { manifest["counts"]["stored_segments"] = 1; });
  const auto set = TileSet::open(folder / "a.fil");
  EXPECT_TRUE(contains(test::whatOf<CorruptSet>([&] { set->loadAppearance(0); }), "contradicts the directory"));
}

TEST(StatedSizes, ASegmentOfACellThatDoesNotExistIsDamage) {
  const test::TempFolder folder;
  const auto store = smallStore();
  test::Faults faults;
  faults.segments = [](TileId, std::vector<StoredSegment>& segments) { segments.back().id.cell = 1'000'000; };
  test::writeFaultySet(*store, folder / "a.fil", faults);
  const auto set = TileSet::open(folder / "a.fil");
  EXPECT_TRUE(contains(test::whatOf<CorruptSet>([&] { set->load(0); }), "a cell that does not exist"));
  faults = {};
  faults.landmarks = [](Landmarks& landmarks) { landmarks.segments.back().cell = 1'000'000; };
  test::writeFaultySet(*store, folder / "b.fil", faults);
  EXPECT_TRUE(contains(test::whatOf<CorruptSet>([&] { TileSet::open(folder / "b.fil")->landmarks(); }),
                       "a cell that does not exist"));
}

}  // namespace
}  // namespace filiform
