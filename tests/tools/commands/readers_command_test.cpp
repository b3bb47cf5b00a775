// Inputs other than SWC, by the program as a process.
#include "tests/support/gzip_bytes.h"
#include "tests/support/process.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

const std::string kCell = "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n";
const std::string kAscCell = "((CellBody) (3 0 0 0) (-3 0 0 0) (0 3 0 0))\n((Axon) (0 3 0 1) (0 9 0 1))\n";
const std::string kJsonCell =
    R"({"neurons": [{"idString": "AA1", "axon": [{"sampleNumber": 1, "x": 1, "y": 2, "z": 3, "parentNumber": -1},
 {"sampleNumber": 2, "x": 4, "y": 2, "z": 3, "parentNumber": 1}]}, {"idString": "AA2", "soma": {"x": 1, "y": 1, "z": 1}}]})";

test::ZipMember readersMember(const std::string& name, const std::string& content) {
  test::ZipMember member;
  member.name = name;
  member.content = content;
  return member;
}

TEST(ReadersCommand, EveryKindOfInputGoesIntoOneSet) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("one.asc"), kAscCell);
  test::writeBytes(folder.file("brain.json"), kJsonCell);
  test::writeBytes(folder.file("two.swc.gz"), test::gzipped(kCell));
  test::writeBytes(folder.file("lab.tar.gz"), test::gzipped(test::buildTar({{"deep/three.swc", kCell}})));
  const Outcome made = runFiliform({"ingest", folder.path(), "-o", folder.file("set.fil")});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("SOMA_LINK 1: "), std::string::npos) << made.out;
  const Outcome cells = runFiliform({"cells", folder.file("set.fil"), "--tsv"});
  for (const char* name : {"\tAA1\tbrain.json/AA1\t", "\tAA2\tbrain.json/AA2\t", "\tone\tone.asc\t",
                           "\ttwo\ttwo.swc.gz\t", "\tthree\tlab.tar.gz/deep/three.swc\t"})
    EXPECT_NE(cells.out.find(name), std::string::npos) << name << '\n' << cells.out;
}

TEST(ReadersCommand, OneVersionOfANeuroMorphoPairGoesIn) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("Lab.zip"), test::buildZip({readersMember("CNG version/n.CNG.swc", kCell),
                                                           readersMember("Source-Version/n.asc", kAscCell)}));
  const Outcome one = runFiliform({"check", folder.file("Lab.zip")});
  EXPECT_EQ(one.exit_code, 0);
  EXPECT_NE(one.out.find("2 inputs: 1 accepted, 0 with warnings, 1 skipped, 0 refused; 2 samples"), std::string::npos)
      << one.out;
  EXPECT_NE(one.out.find("OTHER_VERSION 1: the same neuron is there in another version; this one left out"),
            std::string::npos)
      << one.out;
  EXPECT_EQ(one.out.find("skipped Lab.zip"), std::string::npos) << one.out;
  const Outcome source = runFiliform({"check", "--tsv", "--version", "source", folder.file("Lab.zip")});
  EXPECT_NE(
      source.out.find("Lab.zip\taccept\t3\t2\tCNG version/n.CNG.swc\tOTHER_VERSION:1,SOMA_CONTOUR:1,SOMA_LINK:1\n"),
      std::string::npos)
      << source.out;
  EXPECT_EQ(runFiliform({"check", "--version", "CNG!", folder.file("Lab.zip")}).exit_code, 2);
}

TEST(ReadersCommand, MistakesAreToldInOneLine) {
  const test::TempFolder folder;
  const auto refused = [&](const std::string& name, const std::string& bytes, const std::string& reason) {
    test::writeBytes(folder.file(name), bytes);
    const Outcome outcome = runFiliform({"check", folder.file(name)});
    EXPECT_EQ(outcome.exit_code, 1) << name;
    EXPECT_NE(outcome.out.find("refused " + name + ": " + reason), std::string::npos) << outcome.out;
    const Outcome made = runFiliform({"ingest", folder.file(name), "-o", folder.file("no.fil")});
    EXPECT_EQ(made.exit_code, 1) << name;
    EXPECT_TRUE(made.oneLineOnStderr()) << made.err;
    EXPECT_FALSE(std::filesystem::exists(folder.file("no.fil")));
  };
  refused("open.asc", "((Axon)\n(0 0 0 1)\n", "line 1: this '(' is never closed (E_FORMAT)");
  refused("grid.asc", "ncols 3\n", "line 1: not Neurolucida: '(' must come first (E_FORMAT)");
  refused("package.json", "{\"name\": 1}",
          "line 1: not MouseLight JSON: it has no list `neurons`, `axon` or `dendrite` (E_FORMAT)");
  const std::string packed = test::gzipped(kCell);
  refused("cut.swc.gz", packed.substr(0, 20), "archive is cut short; fetch it again (E_ZIP_TRUNCATED)");
  refused("renamed.swc", packed,
          "packed or binary data, not text; give it its own ending (.gz, .tar, .tar.gz, .zip), or "
          "unpack it (E_NOT_TEXT)");
  const auto hinted = [&](const std::string& made, const std::string& hint, const std::string& content = "{}") {
    const std::string inside = folder / "hint";
    std::filesystem::create_directories((inside + made).substr(0, (inside + made).rfind('/')));
    test::writeBytes(inside + made, content);
    const Outcome outcome = runFiliform({"check", inside});
    EXPECT_EQ(outcome.exit_code, 1) << made;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find("in this folder; "), std::string::npos) << outcome.err;
    EXPECT_NE(outcome.err.find("; " + hint), std::string::npos) << outcome.err;
    std::filesystem::remove_all(inside);
  };
  hinted("/circuit_config.json", "for the circuit, name circuit_config.json");
  hinted("/skeletons/info", "for skeletons, name their folder, such as skeletons",
         R"({"@type": "neuroglancer_skeletons"})");
  hinted("/info", "its info is that of an image volume, which has no skeletons; give a folder of skeletons",
         R"({"type": "image", "scales": []})");
  hinted("/info", "its info is that of a volume with meshes, but without skeletons; give a folder of skeletons",
         R"({"@type": "neuroglancer_multiscale_volume", "type": "segmentation", "mesh": "mesh", "scales": []})");
  hinted("/info", "its info is that of meshes; give a folder of skeletons", R"({"@type": "neuroglancer_legacy_mesh"})");
  std::filesystem::create_directory(folder.file("shards"));
  test::writeBytes(folder.file("shards/0.shard"), "x");
  const Outcome shards = runFiliform({"check", folder.file("shards")});
  EXPECT_EQ(shards.exit_code, 1);
  EXPECT_TRUE(shards.oneLineOnStderr());
  EXPECT_NE(shards.err.find("holds shards of skeletons, but no info file"), std::string::npos) << shards.err;
}

TEST(ReadersCommand, AttributesOfATableGoWithTheCells) {
  const test::TempFolder folder;
  const std::string lab = folder / "lab", table = folder / "lab.csv", set = folder / "lab.fil";
  std::filesystem::create_directory(lab);
  for (const char* const name : {"/n1.CNG.swc", "/n2.CNG.swc", "/n3.swc"}) test::writeBytes(lab + name, kCell);
  test::writeBytes(table,
                   "neuron_name,species,region,depth\nn1,rat,\"cortex, layer 5\",12.5\nn2,mouse,,3\nn9,rat,x,1\n");
  const Outcome made = runFiliform({"ingest", lab, "-o", set, "--attributes", table, "--key", "neuron_name"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(made.out.find("lab.csv: attributes: 3; cells with a row: 2, without: 1; rows without a cell: 1\n"),
            std::string::npos)
      << made.out;
  const Outcome cells = runFiliform({"cells", set, "--tsv", "--where", "species=rat"});
  EXPECT_NE(cells.out.find("\tdepth\tregion\tspecies\n"), std::string::npos) << cells.out;
  EXPECT_NE(cells.out.find("\t12.5\tcortex, layer 5\trat\n"), std::string::npos) << cells.out;
  EXPECT_EQ(cells.out.find("mouse"), std::string::npos) << cells.out;

  const auto refused = [&](std::vector<std::string> arguments, int exit_code, const std::string& words) {
    arguments.insert(arguments.begin(), {"ingest", lab, "-o", folder / "no.fil"});
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "no.fil"));
  };
  refused({"--attributes", table}, 2, "--attributes and --key go together");
  refused({"--attributes", table, "--key", "name"}, 1, "lab.csv:1: has no column name (--key); it has neuron_name, s");
  refused({"--attributes", lab + "/n3.swc", "--key", "name"}, 1, "n3.swc:1: has no column name");
  refused({"--attributes", folder / "none.csv", "--key", "name"}, 3, "none.csv: cannot read the table");
  test::writeBytes(folder / "wide.csv", "neuron_name;species\nn1;rat;x\n");
  refused({"--attributes", folder / "wide.csv", "--key", "neuron_name"}, 1,
          "wide.csv:2: has 3 fields, but the header has 2");
  // A key of another column: all cells are there, and the doubt is said.
  const Outcome doubt =
      runFiliform({"ingest", lab, "-o", folder / "no.fil", "--attributes", table, "--key", "species"});
  EXPECT_EQ(doubt.exit_code, 0);
  EXPECT_TRUE(doubt.oneLineOnStderr()) << doubt.err;
  EXPECT_NE(doubt.err.find("no row belongs to a cell: the first row is for 'rat', and the first cell is 'n1'"),
            std::string::npos)
      << doubt.err;
}

// A tar archive and a packed file beside programs that end early, and beside Ctrl-C.
TEST(ReadersCommand, PackedInputsEndWithTheirPipeAndWithCtrlC) {
  const test::TempFolder folder;
  std::string long_cell = "1 1 0 0 0 5 -1\n";
  for (int i = 2; i <= 400'000; ++i)
    long_cell += std::to_string(i) + " 3 " + std::to_string(i % 977) + " " + std::to_string(i % 1009) + " " +
                 std::to_string(i % 1013) + " 1 " + std::to_string(i - 1) + "\n";
  test::writeBytes(folder / "long.swc.gz", test::gzipped(long_cell));
  test::writeBytes(folder / "lab.tar.gz", test::gzipped(test::buildTar({{"a.swc", long_cell}, {"b.swc", long_cell}})));
  for (const char* const name : {"long.swc.gz", "lab.tar.gz"}) {
    SCOPED_TRACE(name);
    const Outcome piped = test::runFiliformInShell("\"$@\" | head -c 1", {"check", folder / name, "--json"});
    EXPECT_EQ(piped.out, "{");
    EXPECT_EQ(piped.err, "");
    const std::string set = folder / "set.fil";
    const Outcome stopped = test::runFiliformInShell(
        "\"$@\" & p=$!; while ! [ -d '" + set + "' ] && kill -0 $p 2>/dev/null; do :; done; kill -INT $p; wait $p",
        {"ingest", folder / name, "-o", set});
    EXPECT_EQ(stopped.exit_code, 130) << stopped.err;
    EXPECT_FALSE(std::filesystem::exists(set));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2) << "something is left";
  }
}

TEST(ReadersCommand, SkeletonsOnAServerAreReadByTheirIds) {
  const test::TempFolder folder;
  std::filesystem::create_directory(folder.file("s"));
  test::writeBytes(folder.file("s/info"), R"({"@type": "neuroglancer_skeletons"})");
  const std::string skeleton = std::string("\2\0\0\0\1\0\0\0", 8) + std::string(12, '\0') +
                               std::string("\0\0\x7A\x44", 4) + std::string(8, '\0') +
                               std::string("\0\0\0\0\1\0\0\0", 8);
  test::writeBytes(folder.file("s/720575940600000001"), skeleton);
  test::writeBytes(folder.file("ids"), "720575940600000001\n");
  const test::HttpServer server(folder.path());
  const Outcome without = runFiliform({"check", server / "s"});
  EXPECT_EQ(without.exit_code, 1);
  EXPECT_TRUE(without.oneLineOnStderr()) << without.err;
  EXPECT_NE(without.err.find("name them with --ids FILE"), std::string::npos) << without.err;
  const Outcome made = runFiliform({"ingest", server / "s", "--ids", folder.file("ids"), "-o", folder.file("s.fil")});
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_NE(runFiliform({"cells", folder.file("s.fil"), "--tsv"}).out.find("\t720575940600000001\t"),
            std::string::npos);
  EXPECT_EQ(runFiliform({"check", server / "nothing"}).exit_code, 3);
}

}  // namespace
}  // namespace filiform
