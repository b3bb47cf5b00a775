// Subsets of a set: `export` and `ingest SET` with --cell, --where, --box and --type.
#include "index/attributes/cell_attributes.h"
#include "index/query/cell_graph.h"
#include "index/set/tile_set.h"
#include "tests/support/run_here.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_entries.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::runHere;
using test::writeBytes;

class SubsetCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    // A soma, an axon of two samples, a dendrite that is cut by an axon sample.
    test::writeBelow(
        folder_, "in/a.swc",
        "# header of a\n1 1 0 0 0 5 -1\n2 2 10 0 0 1 1\n3 2 20 0 0 1 2\n4 3 0 10 0 1 1\n5 2 0 20 0 1 4\n6 3 "
        "0 30 0 1 5\n");
    test::writeBelow(folder_, "in/b.swc", "1 1 100 0 0 5 -1\n2 3 110 0 0 1 1\n");
    test::writeBelow(folder_, "in/c.swc", "1 1 100 50 0 5 -1\n2 2 110 50 0 1 1\n3 2 200 50 0 1 2\n");
    writeBytes(folder_ / "types.csv", "cell,mtype\na,L4_SP\nb,L5_TPC\nc,L5_TPC\n");
    ASSERT_EQ(runHere({"ingest", folder_ / "in", "-o", set_, "--attributes", folder_ / "types.csv", "--key", "cell"})
                  .exit_code,
              0);
  }
  Outcome exported(std::vector<std::string> words) const {
    words.insert(words.begin(), {"export", set_});
    return runHere(std::move(words));
  }
  std::vector<std::string> exportedNames(std::vector<std::string> words) const {
    words.insert(words.end(), {"-o", zip_});
    fs::remove(zip_);
    const Outcome outcome = exported(std::move(words));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    std::vector<std::string> names;
    for (const auto& [name, bytes] : test::entriesOf(zip_)) names.push_back(name);
    return names;
  }
  void expectRefused(std::vector<std::string> words, const std::vector<std::string>& parts) const {
    for (const char* const command : {"export", "ingest"}) {
      std::vector<std::string> all{command, set_, "-o", *command == 'e' ? zip_ : part_};
      all.insert(all.end(), words.begin(), words.end());
      const Outcome outcome = runHere(all);
      EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
      EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
      for (const std::string& part : parts) EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
    }
    EXPECT_FALSE(fs::exists(zip_));
    EXPECT_FALSE(fs::exists(part_));
  }
  test::TempFolder folder_;
  std::string set_ = folder_ / "set.fil", zip_ = folder_ / "part.zip", part_ = folder_ / "part.fil";
};

using Names = std::vector<std::string>;

TEST_F(SubsetCommand, ExportChoosesCells) {
  EXPECT_EQ(exportedNames({}), (Names{"a.swc", "b.swc", "c.swc"}));
  EXPECT_EQ(exportedNames({"--where", "mtype=L5_*"}), (Names{"b.swc", "c.swc"}));
  EXPECT_EQ(exportedNames({"--where", "measure:length>15", "--where", "mtype=L5_TPC"}), Names{"c.swc"});
  EXPECT_EQ(exportedNames({"--cell", "a", "--cell", "c", "--cell", "a"}), (Names{"a.swc", "c.swc"}));
  EXPECT_EQ(exportedNames({"--cell", "a", "--cell", "c", "--where", "mtype=L5_TPC"}), Names{"c.swc"});
  // The box meets the middle of a segment of `c`, whose ends are outside.
  EXPECT_EQ(exportedNames({"--box", "160", "49", "-1", "150", "51", "1"}), Names{"c.swc"});
  EXPECT_EQ(exportedNames({"--box", "0", "30", "0", "0", "30", "0"}), Names{"a.swc"}) << "its border counts";
  EXPECT_EQ(exportedNames({"--box", "-1", "-1", "-1", "105", "60", "1"}), (Names{"a.swc", "b.swc", "c.swc"}));
  EXPECT_EQ(exportedNames({"--where", "mtype=L5_TPC", "--type", "axon"}), Names{"c.swc"}) << "b has no axon";
}

TEST_F(SubsetCommand, ExportWritesSamplesOfATypeAndCutsAtOthers) {
  const std::string out = folder_ / "a.swc";
  ASSERT_EQ(exported({"--cell", "a", "--type", "axon", "-o", out}).exit_code, 0);
  const std::string text = test::readBytes(out);
  EXPECT_NE(text.find("# header of a\n"), std::string::npos);
  EXPECT_EQ(text.substr(text.find("\n2 ") + 1), "2 2 10 0 0 1 -1\n3 2 20 0 0 1 2\n5 2 0 20 0 1 -1\n");
  ASSERT_EQ(exported({"--cell", "a", "--type", "dendrite", "--type", "soma", "-o", out}).exit_code, 0);
  EXPECT_NE(test::readBytes(out).find("1 1 0 0 0 5 -1\n4 3 0 10 0 1 1\n6 3 0 30 0 1 -1\n"), std::string::npos);
  // Edges, and skeletons of the same samples.
  ASSERT_EQ(exported({"--cell", "a", "--type", "axon", "-o", folder_ / "a.edges"}).exit_code, 0);
  EXPECT_EQ(exported({"--type", "axon", "-o", folder_ / "a.precomputed"}).exit_code, 0);
  ASSERT_EQ(runHere({"ingest", folder_ / "a.precomputed", "-o", part_}).exit_code, 0);
  EXPECT_EQ(TileSet::open(part_)->counts().samples, 5u);
}

TEST_F(SubsetCommand, OneFileTakesOneCell) {
  EXPECT_EQ(exported({"--where", "mtype=L4*", "-o", folder_ / "a.swc"}).exit_code, 0);
  const Outcome two = exported({"--where", "mtype=L5*", "-o", folder_ / "two.swc"});
  EXPECT_EQ(two.exit_code, 2);
  EXPECT_NE(two.err.find("is one file, but 2 cells are chosen"), std::string::npos) << two.err;
  EXPECT_FALSE(fs::exists(folder_ / "two.swc"));
  EXPECT_EQ(exported({"--all", "--where", "mtype=L5*", "-o", zip_}).exit_code, 2);
}

TEST_F(SubsetCommand, IngestMakesASetOfTheChosenCells) {
  ASSERT_EQ(runHere({"ingest", set_, "--where", "mtype=L5*", "-o", part_}).exit_code, 0);
  const auto part = TileSet::open(part_);
  ASSERT_EQ(part->cell_count(), 2u);
  EXPECT_EQ(part->cell(0).name, "b");
  EXPECT_EQ(part->cell(0).source, "b.swc");
  EXPECT_EQ(textOf(CellAttributes(*part).of(1).front().value), "L5_TPC");
  // The set of the files alone has the same bytes.
  const std::string alone = folder_ / "alone.fil";
  ASSERT_EQ(runHere({"ingest", folder_ / "in/b.swc", folder_ / "in/c.swc", "-o", alone, "--attributes",
                     folder_ / "types.csv", "--key", "cell"})
                .exit_code,
            0);
  EXPECT_EQ(TileSet::open(alone)->manifest(), part->manifest());
  // So do those of an archive of the exported cells, apart from names of sources.
  exportedNames({"--where", "mtype=L5*"});
  const std::string back = folder_ / "back.fil";
  ASSERT_EQ(runHere({"ingest", zip_, "-o", back}).exit_code, 0);
  const Outcome of_part = runHere({"nearest", part_, "105", "20", "0", "--k", "9", "--tsv"});
  EXPECT_EQ(of_part.exit_code, 0) << of_part.err;
  EXPECT_EQ(runHere({"nearest", back, "105", "20", "0", "--k", "9", "--tsv"}).out, of_part.out);
  EXPECT_EQ(runHere({"compare", part_, back}).out, "cells: 2 same, 0 moved, 0 changed, 0 added, 0 removed\n");
}

TEST_F(SubsetCommand, IngestTakesTypesOtherTilesAndAnotherSet) {
  ASSERT_EQ(runHere({"ingest", set_, "--type", "axon", "-o", part_, "--capacity", "2"}).exit_code, 0);
  EXPECT_EQ(TileSet::open(part_)->capacity(), 2u);
  EXPECT_EQ(TileSet::open(part_)->counts().samples, 5u);
  EXPECT_EQ(TileSet::open(part_)->counts().roots, 3u);
  const std::string more = folder_ / "more.fil";
  ASSERT_EQ(runHere({"ingest", set_, "--cell", "a", "-o", more}).exit_code, 0);
  ASSERT_EQ(runHere({"ingest", "--add", set_, "--cell", "b", "-o", more}).exit_code, 0);
  EXPECT_EQ(TileSet::open(more)->cell_count(), 2u);
  const Outcome twin = runHere({"ingest", "--add", set_, "--cell", "b", "-o", more});
  EXPECT_EQ(twin.exit_code, 1);
  EXPECT_NE(twin.err.find("already has a cell named"), std::string::npos) << twin.err;
}

TEST_F(SubsetCommand, AnEmptyChoiceGetsOneLineAndNoOutput) {
  expectRefused({"--where", "mtype=L5_TCP"}, {"--where", "no cell meets it", "did you mean 'L5_TPC'?"});
  expectRefused({"--where", "measure:length>99999"}, {"measure:length>99999", "no cell meets it"});
  expectRefused({"--where", "mtype=L4_SP", "--where", "measure:length<15"}, {"no cell meets all conditions"});
  expectRefused({"--where", "mtyp=L4_SP"}, {"mtype"});
  expectRefused({"--cell", "aa"}, {"--cell", "aa"});
  expectRefused({"--cell", "a", "--where", "mtype=L5_TPC"}, {"no cell of --cell meets the conditions"});
  expectRefused({"--box", "900", "0", "0", "901", "1", "1"}, {"--box", "extends over 0 0 0 200 50 0 um"});
  expectRefused({"--box", "0", "0", "0", "nan", "1", "1"}, {"--box", "nan"});
  expectRefused({"--box", "0", "0", "0", "1e300", "1", "1"}, {"--box", "1e+300"});
  expectRefused({"--type", "apical"}, {"--type", "apical", "no chosen cell has a sample"});
  expectRefused({"--type", "axn"}, {"--type", "did you mean 'axon'?"});
}

TEST_F(SubsetCommand, OptionsForFilesAreNotForSets) {
  const auto refused = [&](std::vector<std::string> words, const std::string& part) {
    words.insert(words.begin(), "ingest");
    words.insert(words.end(), {"-o", part_});
    const Outcome outcome = runHere(words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(part_));
  };
  refused({set_, "--unit", "nm"}, "--unit is for files of neurons");
  refused({set_, "--sync"}, "--sync is for files of neurons");
  refused({set_, "--no-soma-links"}, "--no-soma-links is for files of neurons");
  refused({set_, folder_ / "in"}, "give it alone");
  refused({folder_ / "in", "--cell", "a"}, "choose from a tile set");
  refused({folder_ / "in", "--type", "axon"}, "choose from a tile set");
  const Outcome same = runHere({"ingest", set_, "-o", set_, "--force"});
  EXPECT_EQ(same.exit_code, 2);
  EXPECT_NE(same.err.find("the same tile set"), std::string::npos) << same.err;
}

}  // namespace
}  // namespace filiform
