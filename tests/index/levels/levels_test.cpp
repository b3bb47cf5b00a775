#include "index/levels/levels.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/levels/internal/level_files.h"
#include "index/levels/internal/level_writer.h"
#include "index/verify/verify.h"
#include "tests/support/scenes/far_folder.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::TempFolder;

std::string made(const TempFolder& folder, const std::string& name, std::vector<Cell> cells, IngestOptions options,
                 bool levels = true) {
  options.levels = levels;
  CellList stream(std::move(cells));
  ingest(stream, folder / name, options);
  return folder / name;
}

TEST(Levels, EveryWorstCaseHoldsItsBoundAndItsAccount) {
  const TempFolder folder;
  for (const test::NamedCells& input : test::worstCases()) {
    SCOPED_TRACE(input.name);
    const std::string path = made(folder, input.name, input.cells, {.capacity = 40});
    const auto set = TileSet::open(path);
    const auto levels = Levels::open(*set);
    ASSERT_NE(levels, nullptr);
    EXPECT_EQ(checkLevels(*set, *levels), std::vector<std::string>{});
    EXPECT_TRUE(verify(path, {.deep = true}).sound());
    if (set->tile_count() > 3) {
      EXPECT_GT(levels->size(), 0u);
    }
  }
}

// Samples within a soma's radius lie in blocks that do not hold its ball.
TEST(Levels, ABlockBesideASomaKeepsTheCell) {
  const TempFolder folder;
  std::vector<Cell> cells;
  for (int i = 0; i < 40; ++i) {
    Cell cell = test::randomNeuron(40 + static_cast<std::uint64_t>(i), {});
    const Vector3d root_W = cell.positions_um.front();
    for (std::size_t s = 0; s < cell.samples(); ++s)
      if ((cell.positions_um[s] - root_W).norm() < 15) cell.types[s] = 1;
    cell.radii_um.front() = 15;
    cells.push_back(std::move(cell));
  }
  const std::string path = made(folder, "somata.fil", cells, {.capacity = 4});
  const auto set = TileSet::open(path);
  const auto levels = Levels::open(*set);
  ASSERT_GT(levels->size(), 3u);
  EXPECT_EQ(checkLevels(*set, *levels), std::vector<std::string>{});
}

class LevelsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TempFolder>();
    path_ = made(*folder_, "a.fil", test::randomColumn(31, 12, 500, 300), {.capacity = 8});
    set_ = TileSet::open(path_);
    levels_ = Levels::open(*set_);
  }
  static void TearDownTestSuite() {
    levels_.reset();
    set_.reset();
    folder_.reset();
  }
  LevelView from(const Vector3d& eye_W, double pixels) const {
    LevelView view;
    view.eye_W = eye_W;
    view.pixels_per_rad = pixels;
    return view;
  }
  static std::uint64_t sum(const LevelChoice& choice) {
    std::uint64_t segments = 0;
    for (const LevelPart& part : choice.parts) segments += part.segments;
    return segments;
  }

  static inline std::unique_ptr<TempFolder> folder_;
  static inline std::string path_;
  static inline std::unique_ptr<TileSet> set_;
  static inline std::unique_ptr<Levels> levels_;
};

bool isSame(const LevelPart& a, const LevelPart& b) {
  return a.level == b.level && a.tile == b.tile && a.segments == b.segments && a.error_px == b.error_px;
}

TEST_F(LevelsTest, TheDirectoryIsReadWhereFinerTilesAreAskedFor) {
  const std::string path =
      made(*folder_, "pages.fil", test::randomColumn(31, 12, 500, 300), {.capacity = 8, .page_tiles = 16});
  auto source = std::make_unique<test::FarFolder>(path);
  const test::FarFolder& far = *source;
  const auto set = TileSet::open(std::move(source));
  const auto levels = Levels::open(*set);
  EXPECT_FALSE(levels->below(Levels::kRoots).empty());
  EXPECT_EQ(far.directory_reads, 0);
  LevelView view = from({0, 0, 500}, 1000);
  view.planes.push_back({Vector3d(1, 0, 0), 40});
  EXPECT_TRUE(levels->choose(from({0, 0, 1e7}, 1000), UINT64_MAX, 1, UnreadTiles::leave).unread.empty()) << "far away";
  const std::uint32_t few = levels->entry(0).segments;
  EXPECT_TRUE(levels->choose(from({0, 0, 500}, 1000), few, 0, UnreadTiles::leave).unread.empty()) << "too many";
  LevelChoice choice = levels->choose(view, UINT64_MAX, 0, UnreadTiles::leave);
  EXPECT_EQ(far.directory_reads, 0);
  ASSERT_FALSE(choice.unread.empty());
  while (!choice.unread.empty()) {
    EXPECT_GT(choice.error_px, 0);
    for (const LevelId level : choice.unread) {
      EXPECT_FALSE(levels->knowsBelow(level));
      levels->below(level);
      EXPECT_TRUE(levels->knowsBelow(level));
    }
    choice = levels->choose(view, UINT64_MAX, 0, UnreadTiles::leave);
  }
  const int reads = far.directory_reads;
  const LevelChoice all = levels->choose(view, UINT64_MAX, 0);
  EXPECT_EQ(far.directory_reads, reads);
  EXPECT_TRUE(std::equal(choice.parts.begin(), choice.parts.end(), all.parts.begin(), all.parts.end(), isSame));
}

// Whatever the budget and the view, reading what is named leads to the choice that reads by itself.
TEST_F(LevelsTest, WhatIsLeftUnreadIsNamedUntilTheChoiceIsThatOfAllTiles) {
  const std::string path =
      made(*folder_, "budgets.fil", test::randomColumn(31, 12, 500, 300), {.capacity = 8, .page_tiles = 16});
  for (const std::uint64_t most : {1000u, 4000u, 10000u, 30000u, 1000000u})
    for (const double plane : {-1e9, 0.0, 40.0, 90.0}) {
      const auto set = TileSet::open(path);
      const auto levels = Levels::open(*set);
      LevelView view = from({60, 0, 100}, 1000);
      view.planes.push_back({Vector3d(1, 0, 0), plane});
      LevelChoice choice = levels->choose(view, most, 1, UnreadTiles::leave);
      for (int round = 0; !choice.unread.empty() && round < 100; ++round) {
        for (const LevelId level : choice.unread) levels->below(level);
        choice = levels->choose(view, most, 1, UnreadTiles::leave);
      }
      const LevelChoice all = levels->choose(view, most, 1);
      EXPECT_EQ(choice.limited, all.limited) << most << ' ' << plane;
      EXPECT_TRUE(std::equal(choice.parts.begin(), choice.parts.end(), all.parts.begin(), all.parts.end(), isSame))
          << most << ' ' << plane;
    }
}

TEST_F(LevelsTest, AboveIsTheInverseOfBelow) {
  std::vector<LevelId> all{Levels::kRoots};
  for (LevelId level = 0; level < levels_->size(); ++level) all.push_back(level);
  std::size_t tiles = 0;
  for (const LevelId level : all)
    for (const LevelPart& part : levels_->below(level)) {
      EXPECT_EQ(levels_->above(part), level);
      tiles += part.level ? 0 : 1;
    }
  EXPECT_EQ(tiles, set_->tile_count() - (set_->long_tile() != kNoTile));
}

TEST_F(LevelsTest, LeavesWithinARangeOfKeysAreThoseThatBeginThere) {
  const std::string path =
      made(*folder_, "small_pages.fil", test::randomColumn(31, 12, 500, 300), {.capacity = 8, .page_tiles = 4});
  std::mt19937_64 random(5);
  std::vector<MortonKey> lows;
  for (TileId t = 0; t < set_->tile_count(); ++t)
    if (t != set_->long_tile()) lows.push_back(set_->entry(t).key.low);
  for (int round = 0; round < 100; ++round) {
    const auto set = TileSet::open(path);  // knows no page
    std::vector<MortonKey> ends;
    for (int i = 0; i < 6; ++i) {
      const MortonKey near = lows[random() % lows.size()];
      ends.push_back(near + static_cast<MortonKey>(random() % 3) - (near > 0 ? 1 : 0));
    }
    std::sort(ends.begin(), ends.end());
    if (round % 3 == 0) ends.front() = 0;
    if (round % 5 == 0) ends.back() = (MortonKey{1} << kMortonBits) - 1;
    const std::vector<std::pair<MortonKey, MortonKey>> ranges{
        {ends[0], ends[1]}, {ends[2], ends[3]}, {ends[4], ends[5]}};
    const auto found = set->leavesWithin(ranges);
    ASSERT_EQ(found.size(), ranges.size());
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      const auto first = std::lower_bound(lows.begin(), lows.end(), ranges[i].first),
                 end = std::upper_bound(lows.begin(), lows.end(), ranges[i].second);
      EXPECT_EQ(found[i].first, static_cast<TileId>(first - lows.begin()));
      EXPECT_EQ(found[i].second, static_cast<TileId>(end - lows.begin()));
    }
  }
}

TEST_F(LevelsTest, EveryTileLiesBelowTheRootsOnce) {
  ASSERT_GT(levels_->size(), 3u);
  std::map<TileId, int> tiles;
  std::map<LevelId, int> seen;
  std::vector<LevelPart> open(levels_->below(Levels::kRoots).begin(), levels_->below(Levels::kRoots).end());
  while (!open.empty()) {
    const LevelPart part = open.back();
    open.pop_back();
    if (!part.level) {
      ++tiles[part.tile];
      continue;
    }
    ++seen[part.tile];
    EXPECT_EQ(part.segments, levels_->entry(part.tile).segments);
    std::uint64_t segments = 0;
    for (const LevelPart& finer : levels_->below(part.tile)) {
      const BlockKey& key = finer.level ? levels_->entry(finer.tile).key : set_->entry(finer.tile).key;
      EXPECT_TRUE(levels_->entry(part.tile).key.contains(key.low) &&
                  levels_->entry(part.tile).key.contains(key.high()));
      if (finer.level) {
        EXPECT_LE(levels_->entry(finer.tile).error_um, levels_->entry(part.tile).error_um);
        segments += levels_->entry(finer.tile).represented + levels_->entry(finer.tile).hidden;
      } else {
        segments += set_->entry(finer.tile).owned;
      }
      open.push_back(finer);
    }
    EXPECT_GE(levels_->below(part.tile).size(), 1u);
    EXPECT_EQ(segments, levels_->entry(part.tile).represented + levels_->entry(part.tile).hidden);
  }
  EXPECT_EQ(tiles.size(), set_->tile_count() - (set_->long_tile() != kNoTile));
  EXPECT_EQ(seen.size(), levels_->size());
  for (const auto& [tile, times] : tiles) EXPECT_EQ(times, 1);
  for (const auto& [level, times] : seen) EXPECT_EQ(times, 1);
}

TEST_F(LevelsTest, BytesDoNotDependOnThreads) {
  for (const unsigned threads : {1u, 5u}) {
    const std::string other = made(*folder_, "threads" + std::to_string(threads), test::randomColumn(31, 12, 500, 300),
                                   {.capacity = 8, .threads = threads});
    EXPECT_EQ(TileSet::open(other)->revision(), set_->revision());
  }
}

// In the memory that a refusal names, threads wait for one another, and the bytes stay. What suffices for one thread
// suffices for several.
TEST_F(LevelsTest, MemoryIsBoundedOrNamedAndChangesNoByte) {
  std::vector<BlockKey> leaves;
  for (TileId t = 0; t < set_->tile_count(); ++t)
    if (t != set_->long_tile()) leaves.push_back(set_->entry(t).key);
  std::vector<std::uint32_t> segments;
  for (TileId t = 0; t < leaves.size(); ++t) segments.push_back(set_->entry(t).owned);
  LevelInput input{Grid(), leaves, segments, {}, {}, {}, {}};
  input.neurites = [&](TileId t) { return neuritesOf(*set_->load(t), set_->loadAppearance(t)); };
  input.points = [&](TileId t) { return 2 * set_->entry(t).owned; };
  std::uint64_t named = 1;
  const auto write = [&](std::uint64_t memory, unsigned threads) {
    LevelOptions options{.least_segments = 256, .threads = threads};
    options.memory = memory;
    options.memoryFor = [&](std::uint64_t bytes) {
      named = bytes;
      return bytes;
    };
    const TempFolder folder;
    return writeLevels(input, options, folder.path());
  };
  const std::vector<SetFile> ample = write(UINT64_MAX, 3);
  int refusals = 0;
  for (bool done = false; !done && refusals < 1000;) {
    try {
      write(named, 1);
      done = true;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find("--memory"), std::string::npos);
      ++refusals;
    }
  }
  EXPECT_GT(refusals, 0);
  EXPECT_LT(named, std::uint64_t{16} << 20);
  for (const unsigned threads : {1u, 3u, 8u}) {
    const std::vector<SetFile> tight = write(named, threads);
    ASSERT_EQ(tight.size(), ample.size());
    for (std::size_t i = 0; i < tight.size(); ++i) EXPECT_EQ(tight[i].digest, ample[i].digest) << threads;
  }
}

TEST_F(LevelsTest, SetWithoutLevelsHasNone) {
  const std::string bare = made(*folder_, "bare", test::randomColumn(31, 12, 500, 300), {.capacity = 8}, false);
  const auto set = TileSet::open(bare);
  EXPECT_EQ(Levels::open(*set), nullptr);
  EXPECT_TRUE(verify(bare, {.deep = true}).sound());
  EXPECT_LT(set->bytes(), set_->bytes());
}

TEST_F(LevelsTest, TilesHoldFewerSegmentsThanTheirParts) {
  for (LevelId l = 0; l < levels_->size(); ++l) {
    std::uint64_t below = 0;
    for (const LevelPart& part : levels_->below(l)) below += part.segments;
    EXPECT_LE(levels_->entry(l).segments, below + 12) << "level tile " << l;  // and a ball of each cell
    const auto tile = levels_->load(l);
    EXPECT_EQ(tile->segment_count(), levels_->entry(l).segments);
    EXPECT_EQ(tile->owned_count(), tile->segment_count());
    EXPECT_EQ(levels_->loadAppearance(l).radii_um.size(), tile->segment_count());
  }
}

TEST_F(LevelsTest, ChoiceKeepsToTheBudgetAndSaysWhatItIs) {
  const LevelView view = from({0, 0, 500}, 1000);
  double before = 1e300;
  std::uint64_t full = 0;
  for (TileId t = 0; t < set_->tile_count(); ++t) full += set_->entry(t).owned;
  for (const std::uint64_t most : {std::uint64_t{100}, std::uint64_t{1000}, std::uint64_t{4000}, full, 10 * full}) {
    const LevelChoice choice = levels_->choose(view, most, 0);
    EXPECT_EQ(choice.segments, sum(choice));
    if (most >= levels_->entry(0).segments) {
      EXPECT_LE(choice.segments, most);
    }
    EXPECT_LE(choice.error_px, before);
    before = choice.error_px;
    EXPECT_EQ(choice.limited, choice.error_px > 0);
    for (std::size_t i = 1; i < choice.parts.size(); ++i)
      EXPECT_GE(choice.parts[i - 1].error_px, choice.parts[i].error_px);
    // Each place once: no part lies inside another.
    for (const LevelPart& a : choice.parts)
      for (const LevelPart& b : choice.parts) {
        if (&a == &b || !a.level) continue;
        const BlockKey& key = b.level ? levels_->entry(b.tile).key : set_->entry(b.tile).key;
        EXPECT_FALSE(levels_->entry(a.tile).key.contains(key.low) && key.depth >= levels_->entry(a.tile).key.depth);
      }
  }
  const LevelChoice all = levels_->choose(view, 10 * full, 0);
  EXPECT_EQ(all.error_px, 0);
  EXPECT_EQ(all.hidden, 0u);
  EXPECT_EQ(all.segments, full);
}

// Few cells lie far from a pile: the levels of their whole extent must be parted like those of the pile.
TEST_F(LevelsTest, APileWithFarCellsUsesItsBudgets) {
  const TempFolder folder;
  std::vector<Cell> cells;
  for (std::uint64_t i = 0; i < 80; ++i) {
    Cell cell = test::randomNeuron(i, {});
    if (i % 20 == 0)
      for (Vector3d& p_W : cell.positions_um) p_W = 20 * p_W + Vector3d(3e4, -2e4, 1e4);
    cells.push_back(std::move(cell));
  }
  const std::string path = made(folder, "pile", std::move(cells), {.capacity = 8});
  const auto set = TileSet::open(path);
  const auto levels = Levels::open(*set);
  EXPECT_EQ(checkLevels(*set, *levels), std::vector<std::string>{});
  std::uint64_t full = 0;
  for (TileId t = 0; t < set->tile_count(); ++t) full += set->entry(t).owned;
  for (const LevelView& view : {from({0, 0, 1e5}, 1000), from({0, 0, 300}, 1000)})
    for (std::uint64_t most = 4 * levels->entry(0).segments; most < full; most *= 2) {
      const LevelChoice choice = levels->choose(view, most);
      EXPECT_LE(choice.segments, most);
      EXPECT_TRUE(!choice.limited || 10 * choice.segments >= 7 * most)
          << choice.segments << " of " << most << ", " << choice.error_px << " px";
    }
}

TEST_F(LevelsTest, ChoiceIsCoarseWhereNothingFinerWouldBeSeen) {
  const LevelChoice far = levels_->choose(from({0, 0, 1e7}, 1000), UINT64_MAX);
  EXPECT_EQ(far.parts.size(), levels_->below(Levels::kRoots).size());
  EXPECT_LE(far.error_px, 1);
  const LevelChoice near = levels_->choose(from({0, 0, 0}, 1000), UINT64_MAX);
  EXPECT_GT(near.segments, far.segments);
  EXPECT_LE(near.error_px, 1);
  LevelView map = from({0, 0, 1e7}, 4);  // pixels a um
  map.orthographic = true;
  EXPECT_GT(levels_->choose(map, UINT64_MAX).segments, far.segments);
}

TEST_F(LevelsTest, ChoiceLeavesOutWhatIsNotInView) {
  LevelView view = from({0, 0, 0}, 1e9);
  view.planes.push_back({Vector3d(1, 0, 0), 40});  // x >= 40
  view.planes.push_back({Vector3d(0, -1, 0), 0});  // y <= 0
  const LevelChoice choice = levels_->choose(view, UINT64_MAX, 0);
  std::set<TileId> chosen;
  for (const LevelPart& part : choice.parts) chosen.insert(part.tile);
  for (TileId t = 0; t < set_->tile_count(); ++t) {
    const GridBox& box = set_->entry(t).content;
    const bool seen = set_->grid().toWorld(box.hi).x() >= 40 && set_->grid().toWorld(box.lo).y() <= 0;
    EXPECT_EQ(chosen.contains(t), seen || t == set_->long_tile()) << "tile " << t;
  }
}

// A source that returns a changed table of levels.
class Forged final : public TileSource {
 public:
  Forged(std::unique_ptr<TileSource> source, std::vector<std::uint8_t> table)
      : source_(std::move(source)), table_(std::move(table)) {}
  std::uint64_t size(const std::string& name) const override { return source_->size(name); }
  void read(const std::string& name, std::uint64_t offset, std::span<std::uint8_t> bytes) const override {
    source_->read(name, offset, bytes);
    if (name.ends_with(internal::kLevelsFile))
      std::copy_n(table_.begin() + std::ptrdiff_t(offset), bytes.size(), bytes.begin());
  }
  std::string describe(const std::string& name) const override { return source_->describe(name); }

 private:
  std::unique_ptr<TileSource> source_;
  std::vector<std::uint8_t> table_;
};

internal::LevelTable levelTableOf(const TileSet& set) {
  std::vector<std::uint8_t> bytes;
  for (const SetFile& file : set.files())
    if (file.name == internal::kLevelsFile) bytes.resize(file.bytes);
  set.read(internal::kLevelsFile, 0, bytes);
  return internal::decodeLevels(bytes);
}

TEST_F(LevelsTest, ATableWhoseNumbersMakeMuchWorkIsRefused) {
  const internal::LevelTable table = levelTableOf(*set_);
  const auto refusal = [&](auto change) -> std::string {
    internal::LevelTable forged = table;
    change(forged.entries[0]);
    const auto set = TileSet::open(std::make_unique<Forged>(openFolder(path_), internal::encodeLevels(forged)));
    try {
      Levels::open(*set);
    } catch (const CorruptSet& damage) {
      return damage.what();
    }
    return "";
  };
  const auto withPixel = [&](double pixel_um) {
    return refusal([&](LevelEntry& e) {
      e.hidden = 1;
      e.pixel_um = pixel_um;
    });
  };
  const auto expectRefusal = [](const std::string& found, const std::string& expected) {
    EXPECT_NE(found.find(expected), std::string::npos) << found;
  };
  EXPECT_EQ(withPixel(set_->grid().quantum_um() / 2048), "");
  expectRefusal(withPixel(set_->grid().quantum_um() / 2049), "pixels are too small");
  expectRefusal(withPixel(1e-300), "pixels are too small");
  EXPECT_EQ(refusal([](LevelEntry& e) { e.coarser = 64; }), "");
  expectRefusal(refusal([](LevelEntry& e) { e.coarser = 65; }), "too many tiles");
  expectRefusal(refusal([](LevelEntry& e) { e.exponent = set_->grid().exponent() - 1; }), "quantum is out of range");
}

TEST_F(LevelsTest, CheckFindsAnErrorThatIsUnderstated) {
  const std::string path = made(*folder_, "small", test::randomColumn(32, 4, 150, 100), {.capacity = 64});
  const internal::LevelTable table = levelTableOf(*TileSet::open(path));
  const auto problemsOf = [&](auto change) {
    internal::LevelTable forged = table;
    change(forged.entries[0]);
    const auto set = TileSet::open(std::make_unique<Forged>(openFolder(path), internal::encodeLevels(forged)));
    return checkLevels(*set, *Levels::open(*set));
  };
  EXPECT_TRUE(problemsOf([](LevelEntry&) {}).empty());
  EXPECT_FALSE(problemsOf([](LevelEntry& e) { e.error_um *= 0.2; }).empty());
  EXPECT_FALSE(problemsOf([](LevelEntry& e) { ++e.represented; }).empty());
  const std::vector<std::string> outside = problemsOf([](LevelEntry& e) { e.key = {e.key.low, e.key.depth + 3}; });
  EXPECT_TRUE(std::any_of(outside.begin(), outside.end(), [](const std::string& line) {
    return line.find("no level tile contains it") != std::string::npos;
  }));
}

}  // namespace
}  // namespace filiform
