#include "viewer/gl/internal/batch_loader.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "tests/support/campaign.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <random>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

namespace fs = std::filesystem;

bool sameBatch(const NeuriteBatch& a, const NeuriteBatch& b) {
  return a.origin_W == b.origin_W && a.segments.size() == b.segments.size() &&
         (a.segments.empty() ||
          std::memcmp(a.segments.data(), b.segments.data(), a.segments.size() * sizeof(DrawnSegment)) == 0);
}

class DamagedBatches : public ::testing::Test {
 protected:
  DamagedBatches() {
    CellList stream(test::randomColumn(84, 2, 14, 20));
    ingest(stream, path_, {.capacity = 8, .levels = true});
    for (const auto& entry : fs::recursive_directory_iterator(path_))
      if (entry.is_regular_file()) files_.push_back(entry.path().string());
    std::sort(files_.begin(), files_.end());
    load([this](const LoadedTile& tile) {
      ASSERT_FALSE(tile.error);
      good_[tile.job.key] = tile.batch;
    });
  }

  // Opens the set, and lets the loader make batches of all its tiles, levels and cells.
  void load(const std::function<void(const LoadedTile&)>& see) const {
    const auto set = TileSet::open(path_);
    const auto levels = Levels::open(*set);
    std::vector<TileJob> jobs;
    for (TileId t = 0; t < set->tile_count(); ++t) jobs.push_back({.key = t, .tile = t});
    for (LevelId l = 0; l < levels->size(); ++l)
      jobs.push_back({.key = static_cast<std::uint32_t>(jobs.size()), .level = true, .tile = l});
    for (std::uint32_t c = 0; c < set->cell_count(); ++c)
      jobs.push_back({.key = static_cast<std::uint32_t>(jobs.size()), .whole_cell = c});
    BatchLoader loader(*set, levels.get());
    loader.want(jobs);
    LoadedTile tile;
    while (!loader.isIdle()) {
      loader.wait(1);
      while (loader.take(tile)) see(tile);
    }
  }

  // Each batch equals that of the intact set, or is an error that names the damaged file.
  void expectFoundOrHarmless(const std::string& file) {
    const std::string name = fs::path(file).filename().string();
    const auto expectNamed = [&](const char* what) {
      ++found_;
      EXPECT_TRUE(file.ends_with("CURRENT") || std::string(what).find(name) != std::string::npos) << what;
    };
    try {
      load([&](const LoadedTile& tile) {
        if (!tile.error) {
          EXPECT_TRUE(sameBatch(tile.batch, good_.at(tile.job.key))) << "another picture, and no error";
          return;
        }
        try {
          std::rethrow_exception(tile.error);
        } catch (const Error& error) {
          expectNamed(error.what());
        }
      });
    } catch (const Error& error) {
      expectNamed(error.what());
    }
  }

  test::TempFolder folder_;
  std::string path_ = folder_ / "a.fil";
  std::vector<std::string> files_;
  std::map<std::uint32_t, NeuriteBatch> good_;
  std::uint64_t found_ = 0;
};

TEST_F(DamagedBatches, AreNeverDrawn) {
  std::mt19937_64 random(85);
  std::uint64_t tried = 0;
  for (const std::string& file : files_) {
    const std::string bytes = test::readBytes(file);
    const std::size_t step = test::wholeCampaign() ? 1 : std::max<std::size_t>(1, bytes.size() / 12);
    for (std::size_t at = 0; at < bytes.size() && !HasFailure(); at += step, ++tried) {
      SCOPED_TRACE(file + " byte " + std::to_string(at));
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
      test::writeBytes(file, damaged);
      expectFoundOrHarmless(file);
      test::writeBytes(file, bytes.substr(0, at));
      expectFoundOrHarmless(file);
    }
    test::writeBytes(file, bytes);
  }
  EXPECT_GT(found_, tried);
  test::tell(std::to_string(tried) +
             " bytes flipped and as many cuts before the viewer's loader: never another picture");
}

}  // namespace
}  // namespace filiform::internal
