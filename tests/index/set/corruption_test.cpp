// For any damage to the bytes of a tile set, the result is correct or an error that names the file; never a crash.
#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/levels/levels.h"
#include "index/query/cell_graph.h"
#include "index/query/nearest.h"
#include "index/verify/verify.h"
#include "tests/support/campaign.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <filesystem>
#include <random>
#include <sstream>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;

// Every result that a set can give, as text.
std::string everything(const std::string& path) {
  const auto set = TileSet::open(path);
  std::ostringstream out;
  for (std::uint32_t c = 0; c < set->cell_count(); ++c) {
    writeSwc(out, readCell(*set, c, true));
    out << set->cell(c).bounds.lo.transpose() << set->cell(c).bounds.hi.transpose()
        << set->findCell(set->cell(c).name).value_or(99);
  }
  for (TileId t = 0; t < set->tile_count(); ++t) {
    const auto tile = set->load(t);
    const TileEntry& e = set->entry(t);
    out << static_cast<std::uint64_t>(e.key.low) << ' ' << e.key.depth << e.content.lo.transpose()
        << e.content.hi.transpose();
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) out << tile->segmentId(s).key() << tile->owned(s) << ' ';
    for (float radius : set->loadAppearance(t).radii_um) out << radius << ' ';
  }
  const Landmarks& landmarks = set->landmarks();
  out << landmarks.covering_radius_um;
  for (std::size_t i = 0; i < landmarks.points.size(); ++i)
    out << landmarks.points[i].transpose() << ' ' << landmarks.segments[i].key() << ' ' << landmarks.t[i] << ' ';
  const auto levels = Levels::open(*set);
  for (LevelId l = 0; levels != nullptr && l < levels->size(); ++l) {
    const auto tile = levels->load(l);
    const LevelEntry& e = levels->entry(l);
    out << static_cast<std::uint64_t>(e.key.low) << ' ' << e.key.depth << e.content.lo.transpose()
        << e.content.hi.transpose() << e.error_um << ' ' << e.represented << ' ' << e.hidden << ' ' << e.hidden_um
        << ' ' << e.pixel_um << ' ' << e.coarser << ' ' << e.exponent;
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s)
      out << tile->segmentId(s).key() << tile->gridPoint(tile->child(s)).transpose();
    for (float radius : levels->loadAppearance(l).radii_um) out << radius << ' ';
  }
  const Nearest nearest(*set);
  for (const double x_um : {-30.0, 0.0, 55.0})
    for (const NearestResult& r : nearest.find(Vector3d(x_um, 1, 2))) out << r.segment.key() << r.p_W.transpose();
  out << set->manifest() << set->readProvenance();
  return out.str();
}

class Corruption : public ::testing::Test {
 protected:
  Corruption() {
    std::vector<Cell> cells = test::randomColumn(81, 3, 60, 40);
    const std::uint32_t last = static_cast<std::uint32_t>(cells[0].samples()) - 1;
    test::addSample(cells[0], Vector3d(1, 2, 3), last);
    CellList stream(cells);
    ingest(stream, path_, {.capacity = 20, .levels = true});
    for (const auto& entry : fs::recursive_directory_iterator(path_))
      if (entry.is_regular_file()) files_.push_back(entry.path().string());
    std::sort(files_.begin(), files_.end());
    good_ = everything(path_);
  }

  void expectFoundOrHarmless(const std::string& file) {
    const bool is_current = file.ends_with("CURRENT");
    std::string name = fs::path(file).filename().string();
    try {
      EXPECT_EQ(everything(path_), good_);
      ++harmless_;
    } catch (const CorruptTile& error) {
      EXPECT_NE(name.find(".pack"), std::string::npos) << error.what();
      EXPECT_NE(error.file().find(name), std::string::npos) << error.what();
      EXPECT_LE(error.offset(), fs::file_size(file) + 1) << error.what();
    } catch (const CorruptSet& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    } catch (const IoError& error) {
      EXPECT_TRUE(is_current) << error.what();
    }
    try {
      const VerifyReport report = verify(path_);
      EXPECT_FALSE(report.sound());
      if (!report.sound()) {
        EXPECT_NE(report.problems.front().find(name), std::string::npos) << report.problems.front();
      }
    } catch (const IoError& error) {
      EXPECT_TRUE(is_current) << error.what();
    }
  }

  test::TempFolder folder_;
  std::string path_ = folder_ / "a.fil";
  std::vector<std::string> files_;
  std::string good_;
  std::uint64_t harmless_ = 0;  // damages that change no result, only verify()
};

TEST_F(Corruption, AFlippedBitIsFound) {
  std::mt19937_64 random(82);
  ASSERT_EQ(files_.size(), 9u);
  for (const std::string& file : files_) {
    const std::string bytes = test::readBytes(file);
    const std::size_t step = std::max<std::size_t>(1, bytes.size() / 150);
    for (std::size_t at = 0; at < bytes.size(); at += at < 64 ? 1 : 1 + random() % (2 * step)) {
      SCOPED_TRACE(file + " byte " + std::to_string(at));
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
      test::writeBytes(file, damaged);
      expectFoundOrHarmless(file);
    }
    test::writeBytes(file, bytes);
  }
  EXPECT_EQ(everything(path_), good_);
}

// For each byte: every bit flipped, all zeros, all ones. For each file: truncated at every length.
TEST_F(Corruption, EveryByteAndEveryLengthIsFound) {
  if (!test::wholeCampaign()) GTEST_SKIP() << "the others take samples of it; tools/test --long does it whole";
  test::TempFolder folder;
  std::vector<Cell> cells = test::randomColumn(84, 2, 14, 20);
  CellList stream(cells);
  path_ = folder / "b.fil";
  ingest(stream, path_, {.capacity = 8, .levels = true});
  good_ = everything(path_);
  std::uint64_t bytes_flipped = 0, cuts = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path_)) {
    if (!entry.is_regular_file()) continue;
    const std::string file = entry.path().string(), bytes = test::readBytes(file);
    const std::uint64_t harmless_before = harmless_;
    for (std::size_t at = 0; at < bytes.size() && !HasFailure(); ++at) {
      SCOPED_TRACE(file + " byte " + std::to_string(at));
      for (int way = 0; way < 10; ++way) {
        std::string damaged = bytes;
        damaged[at] = static_cast<char>(way < 8 ? damaged[at] ^ (1 << way) : way == 8 ? 0 : 0xFF);
        if (damaged == bytes) continue;
        test::writeBytes(file, damaged);
        expectFoundOrHarmless(file);
        ++bytes_flipped;
      }
    }
    const bool may_be_harmless = file.ends_with(".pack") || file.ends_with("CURRENT") ||
                                 file.ends_with("directory.bin") || file.ends_with("cells.bin");
    EXPECT_TRUE(may_be_harmless || harmless_ == harmless_before) << file;
    EXPECT_LE(harmless_ - harmless_before, 160u) << file << ": more than the file's header is never looked at";
    for (std::size_t length = 0; length < bytes.size() && !HasFailure(); ++length, ++cuts) {
      SCOPED_TRACE(file + " length " + std::to_string(length));
      test::writeBytes(file, bytes.substr(0, length));
      expectFoundOrHarmless(file);
    }
    test::writeBytes(file, bytes);
  }
  EXPECT_EQ(everything(path_), good_);
  test::tell(std::to_string(bytes_flipped) + " damaged bytes and " + std::to_string(cuts) +
             " cut files: all found by verify; " + std::to_string(harmless_) + " in bytes that no answer needs");
}

TEST_F(Corruption, AShortOrLongFileIsFound) {
  std::mt19937_64 random(83);
  for (const std::string& file : files_) {
    const std::string bytes = test::readBytes(file);
    std::vector<std::size_t> lengths{0, 1, 8, 16, bytes.size() / 2, bytes.size() - 1};
    for (int i = 0; i < 15; ++i) lengths.push_back(random() % bytes.size());
    for (std::size_t length : lengths) {
      if (length >= bytes.size()) continue;
      SCOPED_TRACE(file + " length " + std::to_string(length));
      test::writeBytes(file, bytes.substr(0, length));
      expectFoundOrHarmless(file);
    }
    test::writeBytes(file, bytes + "x");
    expectFoundOrHarmless(file);
    test::writeBytes(file, bytes);
  }
}

TEST_F(Corruption, AMissingFileIsAnErrorThatNamesIt) {
  for (const std::string& file : files_) {
    const std::string bytes = test::readBytes(file);
    fs::remove(file);
    try {
      everything(path_);
      FAIL() << file;
    } catch (const IoError& error) {
      EXPECT_NE(std::string(error.what()).find(fs::path(file).filename().string()), std::string::npos) << error.what();
    }
    test::writeBytes(file, bytes);
  }
}

}  // namespace
}  // namespace filiform
