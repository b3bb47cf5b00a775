// The program as users run it: every mistake gives one clear line and the documented exit code, and leaves no
// incomplete file.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <cstdlib>
#include <filesystem>
#include <map>
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

std::string textOfFile(const fs::path& file) { return test::readBytes(file.string()); }
void write(const fs::path& file, const std::string& text) { test::writeBytes(file.string(), text); }

// A Y: a soma, a dendrite with a fork, 7 samples.
const char* const kSmallCell =
    "# a small cell\n1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 5 0 1 3\n5 3 40 10 0 1 4\n6 3 30 -5 0 1 "
    "3\n7 3 40 -10 0 1 6\n";

// All entries below a folder with the bytes of every file, to show that nothing changed.
std::map<std::string, std::string> snapshotOf(const fs::path& folder) {
  std::map<std::string, std::string> entries;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    entries[fs::relative(entry.path(), folder).string()] = entry.is_regular_file() ? textOfFile(entry.path()) : "";
  return entries;
}

class Program : public ::testing::Test {
 protected:
  void SetUp() override {
    write(path("cell.swc"), kSmallCell);
    const Outcome made = runFiliform({"ingest", path("cell.swc"), "-o", path("small.fil"), "--capacity", "2"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  std::string path(const std::string& name) const { return folder_ / name; }
  static void expectRefusal(const Outcome& outcome, int code, const std::string& says) {
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(says), std::string::npos) << outcome.err;
  }
  test::TempFolder folder_;
};

TEST_F(Program, HelpOfEveryCommandHasAnExample) {
  for (const char* command :
       {"synth", "check", "ingest", "info", "verify", "nearest", "export", "navigate", "devices"}) {
    const Outcome outcome = runFiliform({command, "--help"});
    EXPECT_EQ(outcome.exit_code, 0) << command;
    EXPECT_NE(outcome.out.find("Example"), std::string::npos) << command << outcome.out;
  }
}

TEST_F(Program, UnknownCommandExitsTwo) {
  EXPECT_EQ(runFiliform({"frobnicate"}).exit_code, 2);
  EXPECT_EQ(runFiliform({}).exit_code, 2);
  EXPECT_EQ(runFiliform({"info"}).exit_code, 2);
}

TEST_F(Program, MissingInputExitsThree) {
  expectRefusal(runFiliform({"ingest", path("none.swc"), "-o", path("x.fil")}), 3, "none.swc");
  expectRefusal(runFiliform({"check", path("none.swc")}), 3, "none.swc");
  expectRefusal(runFiliform({"info", path("none.fil")}), 3, "none.fil");
  expectRefusal(runFiliform({"navigate", path("none.fil")}), 3, "none.fil");
  EXPECT_FALSE(fs::exists(path("x.fil")));
}

TEST_F(Program, FolderWithoutSwcExitsOne) {
  fs::create_directory(path("empty"));
  expectRefusal(runFiliform({"ingest", path("empty"), "-o", path("x.fil")}), 1, "empty");
  EXPECT_FALSE(fs::exists(path("x.fil")));
}

TEST_F(Program, ZipThatIsNoneExitsOne) {
  write(path("fake.zip"), kSmallCell);
  expectRefusal(runFiliform({"ingest", path("fake.zip"), "-o", path("x.fil")}), 1, "fake.zip");
  EXPECT_FALSE(fs::exists(path("x.fil")));
  EXPECT_EQ(runFiliform({"check", path("fake.zip"), "--tsv"}).exit_code, 1);
}

TEST_F(Program, ExistingSetIsUntouchedWithoutForce) {
  const auto before = snapshotOf(path("small.fil"));
  expectRefusal(runFiliform({"ingest", path("cell.swc"), "-o", path("small.fil")}), 1, "--force");
  EXPECT_EQ(snapshotOf(path("small.fil")), before);
}

TEST_F(Program, ForceReplacesTheRevisionAndTheSameOneIsKept) {
  const auto before = snapshotOf(path("small.fil"));
  EXPECT_EQ(runFiliform({"ingest", path("cell.swc"), "-o", path("small.fil"), "--capacity", "2", "--force"}).exit_code,
            0);
  EXPECT_EQ(snapshotOf(path("small.fil")), before);
  EXPECT_EQ(runFiliform({"ingest", path("cell.swc"), "-o", path("small.fil"), "--capacity", "8", "--force"}).exit_code,
            0);
  EXPECT_NE(textOfFile(path("small.fil/CURRENT")), before.at("CURRENT"));
  std::size_t entries = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(path("small.fil"))) ++entries;
  EXPECT_EQ(entries, 2u) << "CURRENT and one revision";
}

TEST_F(Program, FullDiskExitsThreeAndLeavesNothing) {
  // A file-size limit acts as a full disk: the kernel refuses a write beyond it. The signal is ignored from the start,
  // because a sanitizer writes before main() does.
  const Outcome outcome = runFiliformInShell("trap '' XFSZ; ulimit -f 0; exec \"$@\" 2>&1",
                                             {"ingest", path("cell.swc"), "-o", path("x.fil")});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.out;
  EXPECT_FALSE(fs::exists(path("x.fil")));
}

TEST_F(Program, FullFileSystemExitsThreeAndKeepsTheOldSet) {
  fs::create_directory(path("mount"));
  const std::string mount = "mount -t tmpfs -o size=4k none " + path("mount") + " 2>/dev/null || exit 99; ";
  if (std::system(("unshare -rm bash -c '" + mount + "'").c_str()) != 0)
    GTEST_SKIP() << "this kernel refuses a private tmpfs mount (unshare -rm)";
  const Outcome outcome = runFiliformInShell(
      "exec unshare -rm bash -c '" + mount + "\"$@\"; code=$?; ls -A " + path("mount") + "; exit $code' bash \"$@\"",
      {"ingest", path("cell.swc"), "-o", path("mount/x.fil")});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  EXPECT_EQ(outcome.out, "") << "left behind";
}

TEST_F(Program, NotANumberOnTheCommandLineExitsTwo) {
  for (const char* bad : {"nan", "inf", "-inf", "1e999", "12x", ""})
    EXPECT_EQ(runFiliform({"nearest", path("small.fil"), "0", bad, "0"}).exit_code, 2) << bad;
  expectRefusal(runFiliform({"nearest", path("small.fil"), "0", "nan", "0"}), 2, "nan");
}

TEST_F(Program, BudgetBelowTheFloorStatesTheFloor) {
  expectRefusal(runFiliform({"navigate", path("small.fil"), "--budget", "1"}), 2, "floor");
}

TEST_F(Program, UnknownCellRouteMethodAndHandExitTwo) {
  expectRefusal(runFiliform({"navigate", path("small.fil"), "--cell", "nobody"}), 2, "nobody");
  expectRefusal(runFiliform({"export", path("small.fil"), "--cell", "nobody", "-o", path("n.swc")}), 2, "nobody");
  EXPECT_FALSE(fs::exists(path("n.swc")));
  expectRefusal(runFiliform({"navigate", path("small.fil"), "--route", "1:99"}), 2, "99");
  expectRefusal(runFiliform({"navigate", path("small.fil"), "--method", "best"}), 2, "force");
  EXPECT_EQ(runFiliform({"navigate", path("small.fil"), "--hand", "loose", "--device", "sim:firm"}).exit_code, 2);
  EXPECT_EQ(runFiliform({"navigate", path("small.fil"), "--hand", "iron"}).exit_code, 2);
}

TEST_F(Program, CheckPrintsOneRowAnArgument) {
  const Outcome outcome = runFiliform({"check", "--tsv", path("cell.swc")});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.out, "file\tseverity\tsamples\tsegments\tdropped\tcodes\ncell.swc\taccept\t7\t6\t-\t-\n");
}

TEST_F(Program, TheSetNamesWhatWasDropped) {
  write(path("short.swc"), "1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n3 3 2 0\n");
  ASSERT_EQ(runFiliform({"ingest", path("short.swc"), "-o", path("short.fil")}).exit_code, 0);
  const std::string current = textOfFile(path("short.fil/CURRENT"));
  const std::string revision = path("short.fil/" + current.substr(0, current.size() - 1));
  const auto manifest = nlohmann::json::parse(textOfFile(revision + "/manifest.json"));
  const auto provenance = nlohmann::json::parse(textOfFile(revision + "/provenance.json"));
  EXPECT_EQ(provenance.at("sources").at(0).at("dropped"), "3");
  EXPECT_EQ(manifest.at("provenance").at("codes").at("W_SHORT_LINE"), 1);
}

TEST_F(Program, InfoJsonHoldsThePromisedFields) {
  const Outcome outcome = runFiliform({"info", path("small.fil"), "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto info = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(info.at("cells"), 1);
  EXPECT_EQ(info.at("samples"), 7);
  EXPECT_EQ(info.at("segments"), 6);
  EXPECT_EQ(info.at("isolated"), 0);
  EXPECT_EQ(info.at("roots"), 1);
  EXPECT_EQ(info.at("capacity"), 2);
  EXPECT_EQ(info.at("refused"), 0);
  EXPECT_DOUBLE_EQ(info.at("quantum_um").get<double>(), 0x1p-9);
  EXPECT_GE(info.at("tiles").get<int>(), 3);
  EXPECT_GE(info.at("stored_segments").get<int>(), 6);
  EXPECT_GT(info.at("bytes").get<int>(), 0);
  EXPECT_GT(info.at("decoded_bytes").get<int>(), 0);
}

TEST_F(Program, NearestAnswersPointsFromArgumentsFilesAndStdin) {
  const Outcome one = runFiliform({"nearest", path("small.fil"), "12", "3", "0", "--tsv"});
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_EQ(one.out.substr(0, one.out.find('\n')),
            "query\trank\tdistance\tx\ty\tz\tcell\tsegment\tsample\texact\ttiles_read\ttype\tradius\tt");
  const Outcome piped =
      runFiliform({"nearest", path("small.fil"), "--points", "-", "--json"}, "# two\n12 3 0\n-100,\t0, 0\n");
  ASSERT_EQ(piped.exit_code, 0) << piped.err;
  const auto rows = nlohmann::json::parse(piped.out);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_DOUBLE_EQ(rows[0].at("distance").get<double>(), 3);
  EXPECT_EQ(rows[0].at("cell"), "cell");
  EXPECT_EQ(rows[0].at("segment"), 2);
  EXPECT_EQ(rows[0].at("sample"), 3);
  EXPECT_EQ(rows[0].at("exact"), true);
  EXPECT_DOUBLE_EQ(rows[1].at("distance").get<double>(), 100);
  EXPECT_EQ(runFiliform({"nearest", path("small.fil"), "--points", "-"}, "1 2\n").exit_code, 2);
}

TEST_F(Program, ExportGivesTheCellBack) {
  ASSERT_EQ(runFiliform({"export", path("small.fil"), "--cell", "cell", "-o", path("back.swc")}).exit_code, 0);
  const Outcome again = runFiliform({"ingest", path("back.swc"), "-o", path("back.fil"), "--capacity", "2"});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const Outcome info = runFiliform({"info", path("back.fil"), "--json"});
  EXPECT_EQ(nlohmann::json::parse(info.out).at("segments"), 6);
}

TEST_F(Program, ALibraryIsPlacedByATableWhateverTheOrderOfItsRows) {
  const std::string header = "source\tx_um\ty_um\tz_um\tqw\tqx\tqy\tqz\tname\n";
  const std::string a = "cell.swc\t100\t0\t0\t1\t0\t0\t0\tfirst\n", b = "cell.swc\t0\t50\t0\t0\t0\t1\t0\t\n";
  write(path("ab.tsv"), header + a + b);
  write(path("ba.tsv"), header + b + a);
  for (const char* order : {"ab", "ba"}) {
    const std::string table = path(std::string(order) + ".tsv"), set = path(std::string(order) + ".fil");
    fs::create_directory(path(order));
    fs::rename(table, path(order) + "/t.tsv");
    const Outcome made = runFiliform({"ingest", path("cell.swc"), "--placements", path(order) + "/t.tsv", "-o", set});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  EXPECT_EQ(textOfFile(path("ab.fil") + "/CURRENT"), textOfFile(path("ba.fil") + "/CURRENT"));
  const Outcome nearest = runFiliform({"nearest", path("ab.fil"), "100", "0", "0", "--json"});
  EXPECT_EQ(nlohmann::json::parse(nearest.out).at(0).at("cell"), "first");
  write(path("bad.tsv"), header + "other.swc\t0\t0\t0\t1\t0\t0\t0\t\n");
  expectRefusal(runFiliform({"ingest", path("cell.swc"), "--placements", path("bad.tsv"), "-o", path("bad.fil")}), 1,
                "bad.tsv:2: 'other.swc'");
  EXPECT_FALSE(fs::exists(path("bad.fil")));
}

TEST_F(Program, AnEdgeListGoesInAndComesBack) {
  write(path("tree.edges"), "node 5 0 0 0 1 1\nnode 7 3 4 0\nedge 5 7\n");
  ASSERT_EQ(runFiliform({"ingest", path("tree.edges"), "-o", path("tree.fil")}).exit_code, 0);
  ASSERT_EQ(runFiliform({"export", path("tree.fil"), "--cell", "tree", "-o", path("back.edges")}).exit_code, 0);
  const Outcome check = runFiliform({"check", path("back.edges"), "--tsv"});
  EXPECT_NE(check.out.find("back.edges\taccept\t2\t1\t-\t-\n"), std::string::npos) << check.out;
}

TEST_F(Program, NavigateReportsThePromisedFieldsAndRows) {
  const Outcome outcome =
      runFiliform({"navigate", path("small.fil"), "--route", "1:5", "--zoom", "100", "--csv", path("f.csv"), "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto summary = nlohmann::json::parse(outcome.out);
  for (const char* field : {"outcome", "route_um", "reached_um", "ticks", "sim_s", "segments", "tiles", "tiles_read",
                            "evictions", "stalls", "frontiers", "peak_bytes", "budget_bytes", "decoded_bytes",
                            "mean_force_N", "max_force_N", "force_integral_Ns", "max_force_step_N", "missed_deadlines"})
    EXPECT_TRUE(summary.contains(field)) << field;
  EXPECT_EQ(summary.at("frontiers"), 0);
  EXPECT_TRUE(summary.at("missed_deadlines").is_null());
  const std::string csv = textOfFile(path("f.csv"));
  EXPECT_EQ(csv.substr(0, csv.find('\n')),
            "tick,time_s,hx_um,hy_um,hz_um,px_um,py_um,pz_um,cell,segment,fx_N,fy_N,fz_N,visited,frontier,cell_name");
  const std::string row = csv.substr(csv.find('\n') + 1);
  EXPECT_TRUE(row.substr(0, row.find('\n')).ends_with(",\"cell\"")) << row.substr(0, row.find('\n'));
}

TEST_F(Program, ASmallFileIsTravelledWithoutATileSet) {
  const Outcome outcome = runFiliform({"navigate", path("cell.swc"), "--zoom", "100", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out).at("tiles_read"), 0);
  std::size_t entries = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(folder_.path())) ++entries;
  EXPECT_EQ(entries, 2u) << "cell.swc and small.fil, nothing new";
}

TEST_F(Program, TextFromFilesCannotReachTheTerminalRaw) {
  write(path("evil\x1b[31m.swc"), "not numbers at all\n");
  const Outcome outcome = runFiliform({"check", path("evil\x1b[31m.swc")});
  EXPECT_EQ((outcome.out + outcome.err).find('\x1b'), std::string::npos) << outcome.out << outcome.err;
}

}  // namespace
}  // namespace filiform
