// The memory limits of `ingest` and `check`, measured on the process; and spooled records come out unchanged.
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::runFiliform;
using test::runFiliformInShell;
using test::TempFolder;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
constexpr std::uint64_t kBeside = 32 * kMiB;  // memory that ingest may use beyond --memory

std::uint64_t ownBytes() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("VmRSS:")) return std::stoull(line.substr(6)) << 10;
  return 0;
}

// The peak of a child process is at least the memory of the test when the child started.
class Memory : public ::testing::Test {
 protected:
  void SetUp() override {
    if (test::kSanitized) GTEST_SKIP() << "sanitizers take memory of their own";
    if (ownBytes() > 64 * kMiB) GTEST_SKIP() << "this process is itself too large: run the test alone";
  }
  std::string path(const std::string& name) const { return folder_ / name; }
  void write(const std::string& name, const std::string& text) const { test::writeBytes(path(name), text); }
  // Straight branches of 100 um in all directions, and a table that places this star many times within a few um.
  void writeStar(int branches, int placements) const {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::string star = "1 1 0 0 0 1 -1\n", table = "source\tx_um\ty_um\tz_um\tqw\tqx\tqy\tqz\tname\n";
    for (int i = 0; i < branches; ++i) {
      const double x = normal(random), y = normal(random), z = normal(random), r = 100 / std::hypot(x, y, z);
      star += std::to_string(i + 2) + " 3 " + std::to_string(r * x) + " " + std::to_string(r * y) + " " +
              std::to_string(r * z) + " .5 1\n";
    }
    for (int i = 0; i < placements; ++i) {
      table += "star.swc";
      for (int axis = 0; axis < 3; ++axis) table += "\t" + std::to_string(2 * normal(random));
      table += "\t1\t0\t0\t0\t\n";
    }
    write("star.swc", star);
    write("places.tsv", table);
  }
  Outcome ingestStar(const std::string& set, const std::string& memory, const std::string& capacity) const {
    return runFiliform({"ingest", path("star.swc"), "--placements", path("places.tsv"), "-o", path(set), "--memory",
                        memory, "--capacity", capacity, "--threads", "2", "--no-levels"});
  }
  TempFolder folder_;
};

std::string revisionOf(const std::string& set) { return test::readBytes(set + "/CURRENT"); }

TEST_F(Memory, GhostsStayWithinTheMemoryOrAreRefusedBeforehand) {
  writeStar(300, 800);
  const Outcome refused = ingestStar("small.fil", "64MiB", "1000000");
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
  EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
  const std::size_t at = refused.err.find("ingest with --memory ");
  ASSERT_NE(at, std::string::npos) << refused.err;
  EXPECT_LE(refused.peak_bytes, 64 * kMiB + kBeside);
  EXPECT_FALSE(fs::exists(path("small.fil")));

  const std::string named = refused.err.substr(at + 21, refused.err.find("MiB", at) - at - 18);
  const Outcome taken = ingestStar("named.fil", named, "1000000");
  ASSERT_EQ(taken.exit_code, 0) << taken.err;
  EXPECT_LE(taken.peak_bytes, std::stoull(named) * kMiB + kBeside) << named;
  const Outcome ample = ingestStar("ample.fil", "1GiB", "1000000");
  ASSERT_EQ(ample.exit_code, 0) << ample.err;
  EXPECT_EQ(revisionOf(path("named.fil")), revisionOf(path("ample.fil")));
}

// Memory that one thread frees can be used by the other.
TEST_F(Memory, LargeTilesOfTwoThreadsStayWithinTheMemory) {
  writeStar(300, 800);
  const Outcome made = ingestStar("two.fil", "128MiB", "60000");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_LE(made.peak_bytes, 128 * kMiB + kBeside);
}

// Tiles of a few segments: what is held of each tile takes most of the memory.
TEST_F(Memory, ManySmallTilesStayWithinTheMemory) {
  ASSERT_EQ(runFiliform({"synth", path("c.zip"), "--kind", "column", "--cells", "160", "--seed", "1",
                         "--placements-out", path("c.tsv")})
                .exit_code,
            0);
  std::vector<std::string> words{"ingest",   path("c.zip"), "--placements", path("c.tsv"), "-o",        path("c.fil"),
                                 "--memory", "192MiB",      "--capacity",   "16",          "--threads", "2"};
  for (const char* const more : {"--force", "--no-levels"}) {
    words.emplace_back(more);
    const Outcome made = runFiliform(words);
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_LE(made.peak_bytes, 192 * kMiB + kBeside) << more;
  }
}

// Ids in random order need a table beside the samples.
std::string chainWithIdsInNoOrder(std::uint32_t samples) {
  std::vector<std::uint32_t> order(samples);
  for (std::uint32_t i = 0; i < samples; ++i) order[i] = i;
  std::mt19937 random(11);
  std::shuffle(order.begin(), order.end(), random);
  const auto id = [](std::uint32_t i) { return std::to_string(i * 2654435761u); };
  std::string text;
  for (const std::uint32_t i : order)
    text += id(i) + " 3 " + std::to_string(i) + " 3.3 7.3 .5 " + (i == 0 ? "-1" : id(i - 1)) + "\n";
  return text;
}

TEST_F(Memory, LargeCellsWithIdsInNoOrderStayWithinTheMemory) {
  write("a.swc", chainWithIdsInNoOrder(340000));
  fs::copy_file(path("a.swc"), path("b.swc"));
  const Outcome made = runFiliform(
      {"ingest", path("a.swc"), path("b.swc"), "-o", path("ids.fil"), "--memory", "64MiB", "--threads", "2"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_LE(made.peak_bytes, 64 * kMiB + kBeside);
}

TEST_F(Memory, ACellTooLargeIsRefusedWithWhatItTakes) {
  write("large.swc", chainWithIdsInNoOrder(420000));
  const auto ingest = [&](const std::string& memory) {
    return runFiliform({"ingest", path("large.swc"), "-o", path("large.fil"), "--memory", memory});
  };
  const Outcome refused = ingest("64MiB");
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
  EXPECT_LE(refused.peak_bytes, 64 * kMiB + kBeside);
  const std::size_t at = refused.err.find("--memory ");
  ASSERT_NE(at, std::string::npos) << refused.err;
  const std::string named = refused.err.substr(at + 9, refused.err.find("MiB", at) - at - 6);
  const Outcome made = ingest(named);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_LE(made.peak_bytes, std::stoull(named) * kMiB + kBeside) << named;
}

// Points at all scales: each opens its own chunk.
TEST_F(Memory, ManyThreadsAndChunksStayWithinTheMemory) {
  std::mt19937_64 random(3);
  std::string text;
  for (int i = 1; i <= 200000; ++i) {
    text += std::to_string(i) + " 3";
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint64_t r = random();
      text += ((r & 1) != 0 ? " -" : " ") + std::to_string((r >> 8) >> (26 + r / 2 % 29));
    }
    text += " 1 -1\n";
  }
  write("spread.swc", text);
  const Outcome made = runFiliform({"ingest", path("spread.swc"), "-o", path("spread.fil"), "--memory", "64MiB",
                                    "--threads", "64", "--capacity", "256", "--no-levels"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_LE(made.peak_bytes, 64 * kMiB + kBeside);
}

TEST_F(Memory, LevelsOfDetailStayWithinTheMemory) {
  writeStar(300, 300);
  for (const std::string memory : {"64MiB", "192MiB"}) {
    const Outcome made = runFiliform({"ingest", path("star.swc"), "--placements", path("places.tsv"), "-o",
                                      path(memory), "--memory", memory, "--threads", "64"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    EXPECT_LE(made.peak_bytes, (memory == "64MiB" ? 64 : 192) * kMiB + kBeside);
    EXPECT_TRUE(std::filesystem::exists(
        path(memory) + "/" + revisionOf(path(memory)).substr(0, revisionOf(path(memory)).find(10)) + "/levels.bin"));
  }
  EXPECT_EQ(revisionOf(path("64MiB")), revisionOf(path("192MiB")));
}

TEST_F(Memory, MillionsOfDroppedLinesAreNotHeld) {
  std::string lines;
  for (int i = 0; i < 2000000; ++i) lines += "a\n";
  write("a.swc", lines);
  const Outcome table = runFiliform({"check", path("a.swc"), "--tsv"});
  EXPECT_EQ(table.exit_code, 1);
  EXPECT_LE(table.peak_bytes, 64 * kMiB);
  EXPECT_TRUE(table.out.find("\t1,2,3,4,5,") != std::string::npos &&
              table.out.find(",1999999,2000000\t") != std::string::npos);
  EXPECT_LE(runFiliform({"ingest", path("a.swc"), "-o", path("a.fil"), "--memory", "64MiB"}).peak_bytes, 64 * kMiB);
}

constexpr std::uint64_t kDropped = 600000;
// Lines at irregular distances, so that each record takes memory: more than is held in memory.
std::string manyDropped() {
  std::mt19937 random(5);
  std::string lines = "1 1 0 0 0 1 -1\n";
  for (std::uint64_t i = 0; i < kDropped; ++i) {
    lines.append(random() % 5, '\n');
    lines += "1 1 0 0 0 1 1\n";
    if (i % 8 == 0) {  // a ninth is kept: with less than a tenth, the file would be refused
      const std::uint64_t id = i / 8 + 2;
      lines += std::to_string(id) + " 1 " + std::to_string(id) + " 0 0 1 " + std::to_string(id - 1) + "\n";
    }
  }
  return lines;
}

// The cell is correct, so it must not be left out.
TEST_F(Memory, WithoutRoomForTemporaryFilesTheRunEnds) {
  write("twice.swc", manyDropped());
  write("other.swc", "1 1 0 0 0 1 -1\n2 3 9 0 0 1 1\n");
  const Outcome outcome = runFiliformInShell("TMPDIR=" + path("missing") + " exec \"$@\"",
                                             {"ingest", path("twice.swc"), path("other.swc"), "-o", path("x.fil")});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.out;
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  EXPECT_NE(outcome.err.find("TMPDIR"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(path("x.fil")));
}

TEST_F(Memory, ReportAndProvenanceOfManyDroppedLinesAreStreamed) {
  write("twice.swc", manyDropped());
  const Outcome made = runFiliform(
      {"ingest", path("twice.swc"), "-o", path("twice.fil"), "--memory", "64MiB", "--report", path("report.json")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_LE(made.peak_bytes, 64 * kMiB);
  const std::string report = test::readBytes(path("report.json"));
  std::uint64_t records = 0;
  for (std::size_t at = 0; (at = report.find("\"line\"", at)) != std::string::npos; ++at) ++records;
  EXPECT_EQ(records, kDropped);
}

TEST_F(Memory, AZipThatStatesADirectoryOfGigabytesIsRefused) {
  // A hole of three GiB, then end records that all state a directory of nearly that size.
  const std::uint64_t hole = std::uint64_t{3} << 30;
  std::string ends;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const auto bytes = static_cast<std::uint32_t>(hole + i * 22);
    ends += std::string("PK\5\6\0\0\0\0\xfe\xff\xfe\xff", 12);
    for (int shift = 0; shift < 32; shift += 8) ends += static_cast<char>(bytes >> shift);
    ends += std::string(6, '\0');
  }
  write("hole.zip", "PK\3\4");
  fs::resize_file(path("hole.zip"), hole);
  std::ofstream(path("hole.zip"), std::ios::binary | std::ios::app) << ends;
  const Outcome outcome = runFiliform({"check", path("hole.zip"), "--tsv"});
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  EXPECT_NE(outcome.out.find("refuse"), std::string::npos) << outcome.out;
  EXPECT_LE(outcome.peak_bytes, 64 * kMiB);
}

const char* const kMixed =
    "# head\n1 1 0 0 0 5 -1\n2 3 0 1 0 1 1\na\na\na\n\nb 1\n7 3 0 1 0 1 99\n3 3 0 nan 0 1 2\n4 3 0 2 0 1 5\n5 3 0 3 0 "
    "1 "
    "6\n6 3 0 4 0 1 4\n2 3 0 1 0 1 1\n8 3 0 5 0 1 8\n9 3 0 6 0 -1 98\n10 3 0 7 0 1 12\n11 3 0 8 0 1 10\n12 3 0 9 0 1 "
    "11\n13 3 4e9 1 0 1 1\n14 3 0 10 0 1 17\n15 3 0 11 0 1 x\n1 1 9 9 9 1 -1\n2 3 9 9 8 1 77\n3 3 9 9 7 1 1\n";

std::string recordsOf(const nlohmann::json& report) {
  std::string text;
  for (const auto& r : report.at("records"))
    text += (text.empty() ? "" : " ") + std::to_string(r.at("line").get<int>()) + ":" +
            r.at("code").get<std::string>().substr(2) + ":" + r.at("token").get<std::string>();
  return text;
}

TEST(Records, ComeOutAsTheyAlwaysDid) {
  const TempFolder folder;
  test::writeBytes(folder / "mixed.swc", kMixed);
  test::writeBytes(folder / "bad.swc", "x\nx\nx\n1 1 0 0 0 1 -1\n");
  std::vector<test::ZipMember> members(3);
  members[0] = {"in/one.swc", "1 1 0 0 0 1 -1\nq\n2 1 0 0 1 1 1\n", {}, {}, {}};
  members[1] = {"/abs\xc3\xbf.swc", "1 1 0 0 0 1 -1\nq\nr\n\ns\n", {}, {}, {}};
  members[2] = {"two.swc", "1 1 0 0 0 1 -1\n2 1 0 0 1 1 1\nq\nq\n3 1 0 0 1 1 1\n", {}, {}, {}};
  test::writeBytes(folder / "arc.zip", test::buildZip(members));
  const std::vector<std::string> inputs{folder / "mixed.swc", folder / "bad.swc", folder / "arc.zip"};
  std::vector<std::string> arguments{"check", "--tsv"};
  arguments.insert(arguments.end(), inputs.begin(), inputs.end());
  EXPECT_EQ(runFiliform(arguments).out,
            "file\tseverity\tsamples\tsegments\tdropped\tcodes\n"
            "mixed.swc\twarn\t16\t6\t4,5,6,8,10,14,20\tLOOSE_TREE:1,W_BAD_PARENT:1,W_BAD_RADIUS:1,W_CYCLE:2,W_DUP_ID:1,"
            "W_ID_RESTART:1,W_"
            "MISSING_PARENT:4,W_NONFINITE:1,W_ORDER:1,W_RANGE:1,W_SELF_PARENT:1,W_SHORT_LINE:4\n"
            "bad.swc\trefuse\t0\t0\t1,2,3\tE_MOSTLY_BAD:1,W_SHORT_LINE:3\n"
            "arc.zip\twarn\t5\t3\tin/one.swc:2,/"
            "abs\xc3\xbf.swc,two.swc:3,two.swc:4\tE_MOSTLY_BAD:1,W_SHORT_LINE:6,W_ZIP_NAME:1\n");

  arguments = {"ingest", "-o", folder / "set.fil", "--report", folder / "report.json"};
  arguments.insert(arguments.end(), inputs.begin(), inputs.end());
  const Outcome made = runFiliform(arguments);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::string revision = revisionOf(folder / "set.fil");
  revision.pop_back();
  const std::string origin = test::readBytes(folder / ("set.fil/" + revision + "/provenance.json"));
  for (const char* dropped : {R"("cells":2,"dropped":"in/one.swc:2,/absÿ.swc,two.swc:3,two.swc:4"},)",
                              R"("cells":0,"dropped":"1,2,3"},)", R"("cells":3,"dropped":"4,5,6,8,10,14,20"})"})
    EXPECT_NE(origin.find(dropped), std::string::npos) << origin;

  const std::string text = test::readBytes(folder / "report.json");
  const auto report = nlohmann::ordered_json::parse(text);
  EXPECT_EQ(text, report.dump(1, ' ', true) + "\n");
  EXPECT_EQ(recordsOf(report.at(0)),
            "0:OSE_TREE:8 trees 4:SHORT_LINE:a 5:SHORT_LINE:a 6:SHORT_LINE:a 8:SHORT_LINE:b 1 9:MISSING_PARENT:99 "
            "10:NONFINITE:nan 11:CYCLE:5 "
            "12:ORDER:6 14:DUP_ID:2 15:SELF_PARENT:8 16:BAD_RADIUS:-1 16:MISSING_PARENT:98 17:CYCLE:12 20:RANGE:4e9 "
            "21:MISSING_PARENT:17 22:BAD_PARENT:x 23:ID_RESTART:1 24:MISSING_PARENT:77");
  EXPECT_EQ(recordsOf(report.at(1)), "0:MOSTLY_BAD: 1:SHORT_LINE:x 2:SHORT_LINE:x 3:SHORT_LINE:x");
  EXPECT_EQ(recordsOf(report.at(2)), "");
  EXPECT_EQ(recordsOf(report.at(2).at("entries").at(1)),
            "0:ZIP_NAME: 0:MOSTLY_BAD: 2:SHORT_LINE:q 3:SHORT_LINE:r 5:SHORT_LINE:s");
}

}  // namespace
}  // namespace filiform
