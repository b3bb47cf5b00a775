#include "index/ingest/ingest.h"

#include "index/errors.h"
#include "index/ingest/memory_tiles.h"
#include "index/query/cell_graph.h"
#include "index/verify/verify.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/scenes/tile_invariants.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <array>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <map>
#include <sys/file.h>
#include <sys/resource.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;

IngestResult ingestCells(const std::vector<Cell>& cells, const std::string& path, IngestOptions options = {}) {
  CellList stream(cells);
  return ingest(stream, path, options);
}

std::map<std::string, std::string> contents(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder).string()] = test::readBytes(entry.path().string());
  return files;
}

// Returns some cells, then fails as for a file that has disappeared.
class FailingStream final : public CellStream {
 public:
  explicit FailingStream(int good) : good_(good) {}
  bool next(Cell& cell) override {
    if (good_-- == 0) throw IoError("gone.swc", "cannot be read");
    cell = test::randomNeuron(static_cast<std::uint64_t>(good_));
    return true;
  }

 private:
  int good_;
};

TEST(Ingest, WhatIsReadBackKeepsEveryPromise) {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(31, 8, 250, 150)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const TempFolder folder;
    const IngestResult result = ingestCells(named.cells, folder / "a.fil", {.capacity = 32});
    const auto set = TileSet::open(folder / "a.fil");
    if (result.counts.samples < 1500)
      test::expectTilesHold(*set, named.cells);  // larger sets: compared with tiles in memory, below
    EXPECT_EQ(set->revision(), result.revision);
    EXPECT_EQ(set->counts(), result.counts);
    EXPECT_EQ(set->bytes(), result.bytes);
    std::uint64_t stored = 0, decoded = 0;
    for (TileId t = 0; t < set->tile_count(); ++t)
      stored += set->entry(t).stored, decoded += set->entry(t).decoded_bytes;
    EXPECT_EQ(result.counts.stored_segments, stored);
    EXPECT_EQ(result.counts.decoded_bytes, decoded);
    EXPECT_EQ(result.counts.cells, named.cells.size());
    CellList stream(named.cells);
    const auto memory = buildTilesInMemory(stream, {.capacity = 32});
    test::expectSameTiles(*set, *memory);
    EXPECT_EQ(set->landmarks().points, memory->landmarks().points);
    EXPECT_EQ(set->landmarks().segments, memory->landmarks().segments);
    EXPECT_EQ(set->landmarks().t, memory->landmarks().t);
    EXPECT_EQ(set->landmarks().covering_radius_um, memory->landmarks().covering_radius_um);
  }
}

// A lattice of squares: a third of its links close loops, and tiles of 8 cut it everywhere.
TEST(Ingest, LoopsComeBackAsTheyWere) {
  constexpr int kSide = 12;
  Cell lattice;
  lattice.source = "lattice.edges";
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int x = i % kSide, y = i / kSide;
    lattice.sample_ids.push_back(i);
    lattice.positions_um.emplace_back(3 * x, 3 * y, x * y % 5);
    lattice.radii_um.push_back(0.5f + 0.01f * static_cast<float>(i));
    lattice.types.push_back(3);
    const auto rank = static_cast<std::uint32_t>(i);
    if (x > 0) edges.push_back({rank, rank - 1});
    if (y > 0) edges.push_back({rank, rank - kSide});
  }
  connect(lattice, edges);
  ASSERT_EQ(lattice.links.size(), edges.size());
  const TempFolder folder;
  ingestCells({lattice}, folder / "a.fil", {.capacity = 8});
  const VerifyReport report = verify(folder / "a.fil", {.deep = true});
  EXPECT_TRUE(report.sound()) << report.problems.front();
  const auto set = TileSet::open(folder / "a.fil");
  EXPECT_GT(set->tile_count(), 20u);
  const CellGraph back = readCell(*set, 0, true);
  EXPECT_EQ(back.links, lattice.links);
  EXPECT_EQ(back.radii_um, lattice.radii_um);
  for (std::uint32_t i = 0; i < lattice.samples(); ++i)
    EXPECT_LE((back.position_W(i) - lattice.positions_um[i]).cwiseAbs().maxCoeff(), 0.001);
}

TEST(Ingest, MoreTilesThanAPageHolds) {
  const std::vector<Cell> cells{test::isolatedNodes(32, 6000, 500)};
  const TempFolder folder;
  ingestCells(cells, folder / "a.fil", {.capacity = 1});
  CellList stream(cells);
  const auto memory = buildTilesInMemory(stream, {.capacity = 1});
  ASSERT_GT(memory->tile_count(), 4096u);
  test::expectSameTiles(*TileSet::open(folder / "a.fil"), *memory);
}

TEST(Ingest, SameCellsGiveTheSameBytesWhateverTheThreadsAndTheMemory) {
  std::vector<test::NamedCells> all = test::worstCases();
  all.push_back({"column", test::randomColumn(33, 6, 300, 120)});
  for (const test::NamedCells& named : all) {
    SCOPED_TRACE(named.name);
    const TempFolder folder;
    const IngestResult first = ingestCells(named.cells, folder / "a.fil", {.capacity = 20, .threads = 1});
    for (const unsigned threads : {1u, 3u})
      for (const std::uint64_t chunk : {0u, 20u, 150u}) {
        if (test::kSanitized && (chunk == 150 || (threads == 1 && chunk == 0))) continue;
        const std::string path = folder / "b.fil/";
        const IngestResult again = ingestCells(
            named.cells, path, {.capacity = 20, .threads = threads, .chunk_segments = chunk, .force = true});
        EXPECT_EQ(again.revision, first.revision) << threads << " threads, chunks of " << chunk;
        EXPECT_EQ(again.spool_bytes > 0, chunk != 0 && first.counts.segments + first.counts.isolated > 0);
      }
    EXPECT_EQ(contents(folder / "a.fil"), contents(folder / "b.fil"));
  }
}

// Fails if a byte of the format changes: then change the format version and FORMAT.md too.
TEST(Ingest, GoldenRevision) {
  Cell cell;
  cell.source = "golden.swc";
  cell.digest = 7;
  for (std::uint32_t i = 0; i < 100; ++i)
    test::addSample(cell, Vector3d(i * 0.5, (i * i % 17) * 0.25, i % 3),
                    i == 0 || i == 50 ? kNoParent : i - 1 - i % 2 * (i > 60), 0.25f * static_cast<float>(i % 5),
                    static_cast<std::uint16_t>(i / 40));
  cell.header = "# golden\n# lines";
  cell.odd_radii = {{1, 0.25000000001}, {2, 0.5000000001}, {7, 0.49999999999}};
  const TempFolder folder;
  const IngestResult result = ingestCells({cell}, folder / "a.fil", {.capacity = 16});
  EXPECT_EQ(result.revision, "r-4ecd7bd306c990d7");
}

TEST(Ingest, AnExistingSetIsRefusedWithoutForce) {
  const TempFolder folder;
  ingestCells({test::randomNeuron(1)}, folder / "a.fil");
  const auto before = contents(folder / "a.fil");
  EXPECT_THROW(ingestCells({test::randomNeuron(2)}, folder / "a.fil"), InputError);
  EXPECT_EQ(contents(folder / "a.fil"), before);
}

TEST(Ingest, ForceReplacesTheRevisionAndReadersKeepTheirs) {
  const TempFolder folder;
  const std::vector<Cell> first{test::randomNeuron(1)}, second{test::randomNeuron(2)};
  const IngestResult one = ingestCells(first, folder / "a.fil");
  const auto reader = TileSet::open(folder / "a.fil");
  const IngestResult two = ingestCells(second, folder / "a.fil", {.force = true});
  EXPECT_NE(one.revision, two.revision);
  EXPECT_FALSE(fs::exists(folder / ("a.fil/" + one.revision)));
  test::expectTilesHold(*reader, first);
  test::expectTilesHold(*TileSet::open(folder / "a.fil"), second);
}

TEST(Ingest, ForceWithTheSameCellsLeavesTheSetAlone) {
  const TempFolder folder;
  ingestCells({test::randomNeuron(1)}, folder / "a.fil");
  const auto before = contents(folder / "a.fil");
  EXPECT_TRUE(ingestCells({test::randomNeuron(1)}, folder / "a.fil", {.force = true}).unchanged);
  EXPECT_EQ(contents(folder / "a.fil"), before);
}

TEST(Ingest, ForceMendsADamagedSet) {
  const TempFolder folder;
  const IngestResult result = ingestCells({test::randomNeuron(1)}, folder / "a.fil");
  const auto before = contents(folder / "a.fil");
  const std::string pack = folder / ("a.fil/" + result.revision + "/tiles-00000.pack");
  std::string bytes = test::readBytes(pack);
  bytes[100] ^= 1;
  test::writeBytes(pack, bytes);
  EXPECT_FALSE(ingestCells({test::randomNeuron(1)}, folder / "a.fil", {.force = true}).unchanged);
  EXPECT_EQ(contents(folder / "a.fil"), before);
  test::writeBytes(folder / "a.fil/CURRENT", "rubbish");
  EXPECT_FALSE(ingestCells({test::randomNeuron(1)}, folder / "a.fil", {.force = true}).unchanged);
  EXPECT_EQ(contents(folder / "a.fil"), before);
}

TEST(Ingest, AFailureLeavesNoTrace) {
  const TempFolder folder;
  FailingStream failing(3);
  EXPECT_THROW(ingest(failing, folder / "a.fil"), IoError);
  EXPECT_FALSE(fs::exists(folder / "a.fil"));
  ingestCells({test::randomNeuron(1)}, folder / "b.fil");
  const auto before = contents(folder / "b.fil");
  FailingStream again(3);
  EXPECT_THROW(ingest(again, folder / "b.fil", {.force = true}), IoError);
  EXPECT_EQ(contents(folder / "b.fil"), before);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "b.fil"), fs::directory_iterator()), 2);
}

TEST(Ingest, AFullDiskLeavesNoTrace) {
  const TempFolder folder;
  const std::vector<Cell> cells = test::randomColumn(34, 5, 500, 100);
  struct rlimit before {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (rlim_t limit : {0, 10, 5000}) {
    struct rlimit small = before;
    small.rlim_cur = limit;
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    EXPECT_THROW(ingestCells(cells, folder / "a.fil"), IoError);
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_FALSE(fs::exists(folder / "a.fil"));
  }
  std::signal(SIGXFSZ, handler);
}

TEST(Ingest, CancellingLeavesNoTrace) {
  const std::vector<Cell> cells = test::randomColumn(35, 5, 500, 100);
  // Set in each phase in turn.
  for (const std::string at :
       {"reading", "cutting", "writing tiles", "choosing landmarks", "writing cells", "publishing"}) {
    SCOPED_TRACE(at);
    const TempFolder folder;
    std::atomic<bool> cancel{false};
    bool reached = false;
    IngestOptions options{.capacity = 4, .cancel = &cancel};
    options.progress = [&](const char* phase, std::uint64_t, std::uint64_t) {
      if (phase == at) cancel = reached = true;
    };
    if (at == "publishing") {
      options.progress = nullptr;
      options.provenance = [&] {
        cancel = reached = true;
        return Provenance{};
      };
    }
    EXPECT_THROW(ingestCells(cells, folder / "a.fil", options), Interrupted);
    EXPECT_TRUE(reached);
    EXPECT_FALSE(fs::exists(folder / "a.fil"));
  }
}

TEST(Ingest, WhatACrashLeftIsCleared) {
  const TempFolder folder;
  fs::create_directories(folder / "a.fil/new.tmp-123");
  fs::create_directories(folder / "a.fil/r-0123456789abcdef");
  test::writeBytes(folder / "a.fil/new.tmp-123/tiles-00000.pack", "half");
  test::writeBytes(folder / "a.fil/CURRENT.tmp-123", "half");
  ingestCells({test::randomNeuron(1)}, folder / "a.fil");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "a.fil"), fs::directory_iterator()), 2);
}

TEST(Ingest, OtherFoldersAreLeftAlone) {
  const TempFolder folder;
  test::writeBytes(folder / "thesis.txt", "precious");
  EXPECT_THROW(ingestCells({test::randomNeuron(1)}, folder.path(), {.force = true}), InputError);
  EXPECT_THROW(ingestCells({test::randomNeuron(1)}, folder / "thesis.txt", {.force = true}), InputError);
  EXPECT_EQ(contents(folder.path()).size(), 1u);
  EXPECT_THROW(ingestCells({test::randomNeuron(1)}, folder / "no/such/folder"), IoError);
}

TEST(Ingest, OnlyNamesThatItGivesAreRemoved) {
  const TempFolder folder;
  ingestCells({test::randomNeuron(1)}, folder / "a.fil");
  for (const char* const name :
       {"holiday.tmp-2024", "new.tmp-", "new.tmp-1x", "newer.tmp-1", "r-0123456789abcde.tmp-1", "CURRENT.tmp-1.jpg"}) {
    SCOPED_TRACE(name);
    const std::string photo = folder / (std::string("a.fil/") + name + "/photo.txt");
    fs::create_directories(fs::path(photo).parent_path());
    test::writeBytes(photo, "precious");
    EXPECT_THROW(ingestCells({test::randomNeuron(2)}, folder / "a.fil", {.force = true}), InputError);
    EXPECT_EQ(test::readBytes(photo), "precious");
    fs::remove_all(fs::path(photo).parent_path());
  }
  for (const char* const name : {"new.tmp-1", "add.tmp-22", "r-0123456789abcdef.tmp-3", "r-0123456789abcdef"})
    fs::create_directories(folder / (std::string("a.fil/") + name));
  test::writeBytes(folder / "a.fil/CURRENT.tmp-4", "half");
  ingestCells({test::randomNeuron(2)}, folder / "a.fil", {.force = true});
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "a.fil"), fs::directory_iterator()), 2)
      << "CURRENT, revision";
}

// Files that someone put into the folder while a set was made there, which then failed.
TEST(Ingest, AFailureLeavesTheFilesOfOthersInAFolderThatItMade) {
  const TempFolder folder;
  IngestOptions options;
  options.progress = [&](const char*, std::uint64_t, std::uint64_t) {
    test::writeBytes(folder / "a.fil/thesis.txt", "precious");
    throw Interrupted("interrupted");
  };
  EXPECT_THROW(ingestCells({test::randomNeuron(1)}, folder / "a.fil", options), Interrupted);
  EXPECT_EQ(test::readBytes(folder / "a.fil/thesis.txt"), "precious");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "a.fil"), fs::directory_iterator()), 1);
}

TEST(Ingest, RefusesAPlaceInsideASetAndTheNameOfAnInput) {
  const TempFolder folder;
  ingestCells({test::randomNeuron(1)}, folder / "a.fil");
  const std::string revision = test::readBytes(folder / "a.fil/CURRENT").substr(0, 18);
  fs::create_directory_symlink(folder / "a.fil", folder / "link");
  for (const std::string& inner : {folder / "a.fil/inner.fil", folder / "a.fil/" + revision + "/inner.fil/",
                                   folder / "link/inner.fil", folder / "a.fil/x/../inner.fil"}) {
    EXPECT_THROW(ingestCells({test::randomNeuron(1)}, inner), InputError) << inner;
    EXPECT_FALSE(fs::exists(inner)) << inner;
  }
  for (const char* const name :
       {"cell.swc", "CELL.SWC", "cells.zip", "a.tar.gz", "b.asc/", "c.h5", "d.edges", "e.json"}) {
    EXPECT_THROW(ingestCells({test::randomNeuron(1)}, folder / name), InputError) << name;
    EXPECT_FALSE(fs::exists(folder / name)) << name;
  }
  // Another program's CURRENT makes no set.
  fs::create_directory(folder / "database");
  test::writeBytes(folder / "database/CURRENT", "MANIFEST-000001\n");
  ingestCells({test::randomNeuron(1)}, folder / "database/b.fil");
}

TEST(Ingest, OneAtATime) {
  const TempFolder folder;
  fs::create_directory(folder / "a.fil");
  const int other = ::open((folder / "a.fil").c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(::flock(other, LOCK_EX), 0);
  EXPECT_THROW(ingestCells({test::randomNeuron(1)}, folder / "a.fil"), InputError);
  EXPECT_TRUE(fs::is_empty(folder / "a.fil"));
  ::close(other);
  ingestCells({test::randomNeuron(1)}, folder / "a.fil");
}

TEST(Ingest, TheSetSaysWhereItCameFrom) {
  const TempFolder folder;
  IngestOptions options;
  options.provenance = [] {
    Provenance p;
    p.sources.push_back({"a\xff\"\n.swc", 123, 0xabcdef, 1});
    p.refused.push_back({"b.swc", "E_EMPTY", "no samples"});
    p.codes["W_ID_RESTART"] = 5;
    return p;
  };
  const std::vector<Cell> cells{test::randomNeuron(1)};
  const IngestResult result = ingestCells(cells, folder / "a.fil", options);
  const auto set = TileSet::open(folder / "a.fil");
  const auto manifest = nlohmann::json::parse(set->manifest()), origin = nlohmann::json::parse(set->readProvenance());
  EXPECT_EQ(origin.at("sources").at(0).at("name"), "a\\xFF\"\n.swc");
  EXPECT_EQ(origin.at("sources").at(0).at("xxh3"), "0000000000abcdef");
  EXPECT_EQ(origin.at("refused").at(0).at("code"), "E_EMPTY");
  EXPECT_EQ(set->refused(), 1u);
  EXPECT_EQ(manifest.at("provenance").at("sources"), 1);
  EXPECT_EQ(manifest.at("provenance").at("codes").at("W_ID_RESTART"), 5);
  EXPECT_EQ(manifest.at("counts").at("samples"), cells[0].samples());
  EXPECT_EQ(manifest.at("quantum_um"), std::ldexp(1.0, -9));
}

TEST(Ingest, RefusesNonsense) {
  const TempFolder folder;
  EXPECT_THROW(ingestCells({}, folder / "a.fil", {.capacity = 0}), UsageError);
  EXPECT_THROW(ingestCells({}, folder / "a.fil", {.quantum_exponent = 11}), UsageError);
  EXPECT_THROW(ingestCells({}, folder / "a.fil", {.memory = kMinIngestMemory - 1}), UsageError);
  EXPECT_FALSE(fs::exists(folder / "a.fil"));
}

}  // namespace
}  // namespace filiform
