// Inputs other than SWC, by the program as a process.
#include "tests/support/gzip_bytes.h"
#include "tests/support/http_server.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <filesystem>
#include <string>

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
  const auto hinted = [&](const std::string& made, const std::string& hint) {
    const std::string inside = folder / "hint";
    std::filesystem::create_directories((inside + made).substr(0, (inside + made).rfind('/')));
    test::writeBytes(inside + made, "{}");
    const Outcome outcome = runFiliform({"check", inside});
    EXPECT_EQ(outcome.exit_code, 1) << made;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find("in this folder; " + hint), std::string::npos) << outcome.err;
    std::filesystem::remove_all(inside);
  };
  hinted("/circuit_config.json", "for the circuit, name circuit_config.json");
  hinted("/cell.h5", "name H5 files of morphologies themselves, such as cell.h5");
  hinted("/skeletons/info", "for skeletons, name their folder, such as skeletons");
  std::filesystem::create_directory(folder.file("shards"));
  test::writeBytes(folder.file("shards/0.shard"), "x");
  const Outcome shards = runFiliform({"check", folder.file("shards")});
  EXPECT_EQ(shards.exit_code, 1);
  EXPECT_TRUE(shards.oneLineOnStderr());
  EXPECT_NE(shards.err.find("holds shards of skeletons, but no info file"), std::string::npos) << shards.err;
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
