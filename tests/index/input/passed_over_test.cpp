#include "index/errors.h"
#include "index/formats/unread_formats.h"
#include "index/hdf5/hdf5_writer.h"
#include "index/ingest/input_provenance.h"
#include "index/input/input.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"
#include "tests/support/zip_builder.h"

#include <filesystem>
#include <sstream>
#include <sys/stat.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;

const std::string kTwoSamples = "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n";
const std::string kOneNeuron =
    R"({"idString": "AA1", "axon": [{"sampleNumber": 1, "x": 1, "y": 2, "z": 3, "radius": 1, "parentNumber": -1}]})";

std::vector<std::string> sourcesRead(Input& input) {
  std::vector<std::string> sources;
  for (Cell cell; input.next(cell);) sources.push_back(cell.source);
  return sources;
}

std::string rowsChecked(const Input& input) {
  std::ostringstream table;
  writeCheckTable(table, input.reports());
  return table.str().substr(table.str().find('\n') + 1);
}

// A dendrite of two points below a soma of one.
void writeMorphology(const std::string& path, const std::string& group = "") {
  Hdf5Writer out(path);
  const std::vector<double> points = {0, 0, 0, 10, 0, 6, 0, 2, 0, 9, 0, 2};
  const std::vector<std::int64_t> structure = {0, 1, -1, 1, 3, 0};
  out.reals(group + "points", "f64", 4, points);
  out.integers(group + "structure", "i32", 3, structure);
  out.finish();
}

TEST(PassedOver, EveryFileOfAFolderIsCountedByItsEnding) {
  const test::TempFolder folder;
  for (const char* name : {"a.swc", "notes.txt", "in/README", "in/x.TXT", "p.png", "._a.swc", "__MACOSX/b.swc", "m.hoc",
                           ".DS_Store", "v.2023 old"})
    test::writeBelow(folder, name, kTwoSamples);
  fs::create_symlink("gone.txt", folder.file("broken.txt"));
  Input input({folder.path()});
  EXPECT_EQ(sourcesRead(input), std::vector<std::string>{"a.swc"});
  const InputTotals all = totals(input.reports());
  EXPECT_EQ(all.inputs(), 1u);
  EXPECT_EQ(all.passed_over, (std::map<std::string, std::uint64_t>{
                                 {".hoc", 1}, {".png", 1}, {".swc", 1}, {".txt", 3}, {"._*", 1}, {"no ending", 3}}));
  EXPECT_EQ(input.reports().size(), 11u);
  EXPECT_EQ(summary(input.reports()),
            "1 input: 1 accepted, 0 with warnings, 0 refused; 2 samples, 1 segment kept\n"
            "  passed over: 3 .txt, 3 no ending, 1 ._*, 1 .hoc (NEURON), 1 .png, 1 .swc\n");
  EXPECT_FALSE(anyRefused(input.reports()));
  const Provenance provenance = provenanceOf(input.reports());
  EXPECT_EQ(provenance.passed_over, all.passed_over);
  EXPECT_EQ(provenance.sources.size(), 1u);
}

TEST(PassedOver, TheReasonNamesTheFormat) {
  const test::TempFolder folder;
  for (const char* name : {"a.swc", "m.hoc", "n.nml.gz", "o.OBJ", "x.png", "package.json"})
    test::writeBelow(folder, name, kTwoSamples);
  Input input({folder.path()});
  sourcesRead(input);
  std::string said;
  forEachInput(input.reports(), [&](const std::string& name, const InputReport&, const InputOutcome& outcome) {
    said += name + ' ' + std::string(filiform::name(outcome.fate)) + ' ' + outcome.reason + '\n';
  });
  EXPECT_EQ(
      said,
      "a.swc accepted \nm.hoc passed NEURON (.hoc), which filiform does not read\n"
      "n.nml.gz passed packed; only .swc.gz, .asc.gz and .tar.gz are read\n"
      "o.OBJ passed a graph, which is read only if the file is named\n"
      "package.json passed holds no cell that filiform reads\nx.png passed no format of neurons that filiform reads\n");
}

TEST(PassedOver, EntriesOfAnArchiveAreCountedAndNoLoss) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.zip"),
                   test::buildZip({test::zipMember("a.swc", kTwoSamples), test::zipMember("doc/", ""),
                                   test::zipMember("doc/b.txt", "x"), test::zipMember("../c.png", "x"),
                                   test::zipMember("__MACOSX/._a.swc", "x")}));
  Input input({folder.file("a.zip")});
  EXPECT_EQ(sourcesRead(input), std::vector<std::string>{"a.zip/a.swc"});
  EXPECT_EQ(rowsChecked(input), "a.zip\taccept\t2\t1\t-\t-\n");
  EXPECT_EQ(totals(input.reports()).passed_over,
            (std::map<std::string, std::uint64_t>{{".png", 1}, {".txt", 1}, {"._*", 1}}));
}

TEST(PassedOver, AFolderOfNothingElseIsRefusedWithWhatItHolds) {
  const test::TempFolder folder;
  test::writeBelow(folder, "m.hoc", "x");
  test::writeBelow(folder, "n.txt", "x");
  try {
    Input input({folder.path()});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("; passed over: 1 .hoc (NEURON), 1 .txt"), std::string::npos)
        << error.what();
  }
}

TEST(PassedOver, AFileOfAnUnreadFormatIsRefusedByName) {
  const test::TempFolder folder;
  for (const char* name : {"m.hoc", "m.mtr", "m.AM", "m.neu"}) {
    test::writeBytes(folder.file(name), kTwoSamples);
    Input input({folder.file(name)});
    EXPECT_TRUE(sourcesRead(input).empty());
    const std::string said = refusalReason(input.reports().at(0).report);
    EXPECT_NE(said.find(" is not read; convert the file to SWC"), std::string::npos) << said;
    EXPECT_NE(said.find(unreadFormat(name)), std::string::npos) << said;
  }
}

TEST(PassedOver, H5MorphologiesOfFoldersAreRead) {
  const test::TempFolder folder;
  fs::create_directory(folder.file("in"));
  writeMorphology(folder.file("in/m.h5"));
  writeMorphology(folder.file("merged.h5"), "cell/");
  {
    Hdf5Writer other(folder.file("nodes.h5"));
    const std::vector<double> x = {1};
    other.reals("x", "f64", 1, x);
    other.finish();
  }
  test::writeBelow(folder, "c.swc", kTwoSamples);
  Input input({folder.path()});
  EXPECT_EQ(sourcesRead(input), (std::vector<std::string>{"c.swc", "in/m.h5", "merged.h5/cell"}));
  EXPECT_EQ(
      rowsChecked(input),
      "c.swc\taccept\t2\t1\t-\t-\nin/m.h5\taccept\t3\t2\t-\tSOMA_LINK:1\nmerged.h5\taccept\t3\t2\t-\tSOMA_LINK:1\n"
      "nodes.h5\tpassed\t0\t0\t-\t-\n");
}

TEST(PassedOver, H5AndMouseLightOfArchivesAreRead) {
  const test::TempFolder folder;
  writeMorphology(folder.file("m.h5"));
  writeMorphology(folder.file("merged.h5"), "cell/");
  test::writeBytes(
      folder.file("a.zip"),
      test::buildZip({test::zipMember("in/m.h5", test::readBytes(folder.file("m.h5"))),
                      test::zipMember("merged.h5", test::readBytes(folder.file("merged.h5"))),
                      test::zipMember("AA1.json", kOneNeuron), test::zipMember("other.json", "{\"a\": 1}"),
                      test::zipMember("text.h5", "x"), test::zipMember("cut.json", kOneNeuron.substr(0, 60)),
                      test::zipMember("c.swc", kTwoSamples)}));
  Input input({folder.file("a.zip")});
  EXPECT_EQ(sourcesRead(input),
            (std::vector<std::string>{"a.zip/AA1.json/AA1", "a.zip/c.swc", "a.zip/in/m.h5", "a.zip/merged.h5/cell"}));
  EXPECT_EQ(rowsChecked(input), "a.zip\twarn\t9\t5\tcut.json\tE_FORMAT:1,SOMA_LINK:2\n");
  EXPECT_EQ(totals(input.reports()).passed_over, (std::map<std::string, std::uint64_t>{{".h5", 1}, {".json", 1}}));
  const std::string said = summary(input.reports());
  EXPECT_NE(said.find("skipped a.zip/cut.json: line 1: ends inside a list or an object"), std::string::npos) << said;
}

TEST(PassedOver, FilesOfArchivesAreNotWrittenToADisk) {
  const test::TempFolder folder;
  writeMorphology(folder.file("m.h5"));
  test::writeBytes(folder.file("a.zip"), test::buildZip({test::zipMember("m.h5", test::readBytes(folder.file("m.h5"))),
                                                         test::zipMember("AA1.json", kOneNeuron)}));
  const test::Variable no_disk("TMPDIR", folder.file("missing"));
  Input input({folder.file("a.zip")});
  EXPECT_EQ(sourcesRead(input), (std::vector<std::string>{"a.zip/AA1.json/AA1", "a.zip/m.h5"}));
}

TEST(PassedOver, AFileOfAnArchiveBeyondItsShareOfTheMemoryIsRefused) {
  const test::TempFolder folder;
  const std::string blanks(std::size_t{2} << 20, ' ');
  test::writeBytes(folder.file("a.zip"), test::buildZip({test::zipMember("AA1.json", kOneNeuron),
                                                         test::zipMember("large.json", kOneNeuron + blanks),
                                                         test::zipMember("other.json", "{}" + blanks)}));
  InputOptions options;
  options.memory = std::uint64_t{16} << 20;
  Input input({folder.file("a.zip")}, options);
  EXPECT_EQ(sourcesRead(input), std::vector<std::string>{"a.zip/AA1.json/AA1"});
  EXPECT_EQ(totals(input.reports()).passed_over, (std::map<std::string, std::uint64_t>{{".json", 1}}));
  const std::string said = summary(input.reports());
  EXPECT_NE(said.find("skipped a.zip/large.json: 2097259 bytes, but such a file of an archive is read in memory, up to "
                      "2097152 bytes; unpack the archive (E_UNREADABLE)"),
            std::string::npos)
      << said;
}

TEST(PassedOver, APipeNamedLikeATableIsRefusedAndNotOpened) {
  const test::TempFolder folder;
  test::writeBelow(folder, "a.swc", kTwoSamples);
  ASSERT_EQ(::mkfifo(folder.file("pipe.csv").c_str(), 0600), 0);
  Input input({folder.path()});
  EXPECT_EQ(sourcesRead(input), std::vector<std::string>{"a.swc"});
  EXPECT_EQ(rowsChecked(input), "a.swc\taccept\t2\t1\t-\t-\npipe.csv\trefuse\t0\t0\t-\tE_UNREADABLE:1\n");
}

TEST(PassedOver, LinksOfArchivesAreCountedWhateverTheirName) {
  const auto link = [](const std::string& name) {
    test::ZipMember member = test::zipMember(name, "/etc");
    member.attributes = test::kSymbolicLinkAttributes;
    return member;
  };
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.zip"),
                   test::buildZip({test::zipMember("a.swc", kTwoSamples), link("cells"), link("more/"), link("x.txt"),
                                   link("l.swc"), link("__MACOSX/m")}));
  Input input({folder.file("a.zip")});
  sourcesRead(input);
  EXPECT_EQ(rowsChecked(input), "a.zip\twarn\t2\t1\tcells,more/,x.txt,l.swc,__MACOSX/m\tW_ZIP_LINK:5\n");
}

TEST(PassedOver, AnArchiveInWhichNoEntryHoldsASampleHoldsNoNeuron) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.zip"),
                   test::buildZip({test::zipMember("a.swc", ""), test::zipMember("b.swc", "# none\n"),
                                   test::zipMember("c.txt", "x")}));
  Input input({folder.file("a.zip")});
  EXPECT_TRUE(sourcesRead(input).empty());
  EXPECT_EQ(rowsChecked(input), "a.zip\trefuse\t0\t0\ta.swc,b.swc\tE_NO_SAMPLES:2,E_ZIP_NO_SWC:1\n");
}

}  // namespace
}  // namespace filiform
