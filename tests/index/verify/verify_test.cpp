#include "index/verify/verify.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/ingest/memory_tiles.h"
#include "tests/support/scenes/faulty_set.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <stdexcept>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::Faults;

std::string firstProblem(const VerifyReport& report) { return report.problems.empty() ? "" : report.problems.front(); }

TEST(Verify, WhatIngestWritesIsSound) {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(71, 8, 300, 120)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const test::TempFolder folder;
    CellList stream(named.cells);
    const IngestResult result = ingest(stream, folder / "a.fil", {.capacity = 40});
    const VerifyReport report = verify(folder / "a.fil", {.deep = true});
    EXPECT_TRUE(report.sound()) << firstProblem(report);
    EXPECT_EQ(report.tiles, result.counts.tiles);
  }
}

class FaultySet : public ::testing::Test {
 protected:
  FaultySet() {
    CellList stream(test::randomColumn(72, 5, 300, 80));
    store_ = buildTilesInMemory(stream, {.capacity = 60});
  }
  // The bytes are valid, the content is not: only the deep check can tell.
  void expectFound(const Faults& faults, const std::string& what) {
    const test::TempFolder folder;
    test::writeFaultySet(*store_, folder / "a.fil", faults);
    const VerifyReport shallow = verify(folder / "a.fil");
    EXPECT_TRUE(shallow.sound()) << firstProblem(shallow);
    const VerifyReport deep = verify(folder / "a.fil", {.deep = true});
    ASSERT_FALSE(deep.sound());
    EXPECT_NE(firstProblem(deep).find(what), std::string::npos) << firstProblem(deep);
  }
  // Owned counts must still match in total, or the directory contradicts the manifest.
  static std::size_t ghost(const std::vector<StoredSegment>& segments) {
    for (std::size_t i = 0; i < segments.size(); ++i)
      if (!segments[i].owned) return i;
    throw std::logic_error("this tile has no ghost: take another one for the test");
  }
  std::unique_ptr<TileStore> store_;
};

TEST_F(FaultySet, WithoutFaultsIsSound) {
  const test::TempFolder folder;
  test::writeFaultySet(*store_, folder / "a.fil", {});
  const VerifyReport report = verify(folder / "a.fil", {.deep = true});
  EXPECT_TRUE(report.sound()) << firstProblem(report);
}

TEST_F(FaultySet, MissingGhost) {
  Faults faults;
  faults.segments = [](TileId t, auto& segments) {
    if (t == 3) segments.erase(segments.begin() + static_cast<std::ptrdiff_t>(ghost(segments)));
  };
  expectFound(faults, "tile 3: does not hold");
}

TEST_F(FaultySet, NeedlessGhost) {
  Faults faults;
  faults.segments = [&](TileId t, auto& segments) {
    if (t != 0) return;
    const auto far = store_->load(store_->tile_count() - 1);
    for (std::uint32_t s = 0; s < far->segment_count(); ++s) {
      const StoredSegment copy{far->segmentId(s),
                               far->nodeId(far->child(s)).sample,
                               far->nodeId(far->parent(s)).sample,
                               far->gridPoint(far->child(s)),
                               far->gridPoint(far->parent(s)),
                               false};
      if (store_->load(0)->findSegment(copy.id)) continue;
      segments.push_back(copy);
      return;
    }
  };
  expectFound(faults, "tile 0: does not hold");
}

TEST_F(FaultySet, OwnedByTheWrongTile) {
  // One tile loses an owned segment; another tile, which holds it as a ghost, becomes its owner.
  SegmentId moved{};
  for (TileId t = 1; t < store_->tile_count() && moved == SegmentId{}; ++t)
    for (std::uint32_t s = 0; s < store_->load(t)->segment_count(); ++s)
      if (!store_->load(t)->owned(s)) moved = store_->load(t)->segmentId(s);
  bool taken = false;
  Faults faults;
  faults.segments = [&](TileId, auto& segments) {
    for (StoredSegment& s : segments) {
      if (s.id != moved) continue;
      if (!s.owned && taken) continue;
      taken |= !s.owned;
      s.owned = !s.owned;
    }
  };
  expectFound(faults, "does not hold");
}

TEST_F(FaultySet, OwnedTwiceAndNever) {
  Faults faults;  // a tile disowns one of its segments and owns a ghost instead
  faults.segments = [](TileId t, auto& segments) {
    if (t != 2) return;
    StoredSegment& stolen = segments[ghost(segments)];
    for (StoredSegment& s : segments)
      if (s.owned) {
        s.owned = false;
        break;
      }
    stolen.owned = true;
  };
  expectFound(faults, "own");
}

TEST_F(FaultySet, SampleInTwoPlaces) {
  Faults faults;
  faults.segments = [](TileId t, auto& segments) {
    if (t == 3) segments[ghost(segments)].child += GridPoint(0, 0, 1);
  };
  expectFound(faults, "two places");
}

TEST_F(FaultySet, WrongBox) {
  Faults faults;
  faults.entry = [](TileId t, TileEntry& entry) {
    if (t == 4) entry.content.hi.x() -= 1;
  };
  expectFound(faults, "tile 4: the directory's box");
}

TEST_F(FaultySet, WrongListOfTiles) {
  Faults faults;
  faults.detail = [](std::uint32_t c, CellDetail& detail) {
    if (c == 2) detail.tiles.pop_back();
  };
  expectFound(faults, "cell 2: its list of tiles");
}

TEST_F(FaultySet, OddRadiusOfAnotherFloat) {
  Faults faults;
  faults.detail = [](std::uint32_t c, CellDetail& detail) {
    if (c == 2) detail.odd_radii = {{3, std::int64_t{1} << 40}};
  };
  expectFound(faults, "the radius of sample 3");
}

TEST_F(FaultySet, WrongBounds) {
  Faults faults;
  faults.records = [](std::vector<CellRecord>& records) { records[1].bounds.lo.y() += 1; };
  expectFound(faults, "cell 1: its bounds");
}

TEST_F(FaultySet, CoveringRadiusTooSmall) {
  Faults faults;
  faults.landmarks = [](Landmarks& landmarks) {
    landmarks.points.resize(10);
    landmarks.segments.resize(10);
    landmarks.t.resize(10);
  };
  expectFound(faults, "farther from every landmark");
  faults.landmarks = [](Landmarks& landmarks) { landmarks.points[5] += GridPoint(40, 40, 40); };
  expectFound(faults, "landmark 5");
}

TEST(Verify, SaysThatThereIsNoSet) {
  const test::TempFolder folder;
  EXPECT_THROW(verify(folder / "none"), IoError);
}

TEST(Verify, CanBeStopped) {
  const test::TempFolder folder;
  CellList stream({test::randomNeuron(1)});
  ingest(stream, folder / "a.fil");
  const std::atomic<bool> cancel{true};
  EXPECT_THROW(verify(folder / "a.fil", {.cancel = &cancel}), Interrupted);
}

}  // namespace
}  // namespace filiform
