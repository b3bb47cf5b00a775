// The effect of the program on its output places: files, links, devices, pipes, inputs.
#include "device/recording/replay.h"
#include "device/simulated/null_device.h"
#include "tests/support/display.h"
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::readBytes;
using test::runFiliform;
using test::runFiliformInShell;
using test::writeBytes;
using Arguments = std::vector<std::string>;

class Outputs : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string swc = "1 1 0 0 0 5 -1\n";
    for (int i = 2; i <= 60; ++i)
      swc += std::to_string(i) + " 3 " + std::to_string(3 * i) + " 0 0 1 " + std::to_string(i - 1) + "\n";
    writeBytes(path("cell.swc"), swc);
    const Outcome made = runFiliform({"ingest", path("cell.swc"), "-o", path("cell.fil"), "--capacity", "16"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  std::string path(const std::string& name) const { return folder_ / name; }
  // A run of half a second of simulated time.
  Arguments shortRun(const Arguments& more) const {
    Arguments words{"navigate", path("cell.fil"), "--seconds", "0.5"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  static void expectRefusal(const Arguments& arguments, int code, const std::string& says) {
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(says), std::string::npos) << outcome.err;
  }
  test::TempFolder folder_;
};

bool canRender() {
  // Without a software renderer, the tests that draw are skipped, as those of `render` are.
  static const bool can = [] {
    const test::TempFolder folder;
    writeBytes(folder / "a.swc", "1 1 0 0 0 5 -1\n2 3 9 0 0 1 1\n");
    return runFiliform({"render", folder / "a.swc", "-o", folder / "a.png", "--size", "32x32"}).exit_code == 0;
  }();
  return can;
}

struct Option {
  std::string name;  // for messages
  std::function<Arguments(const std::string& output)> words;
  bool needs_opengl = false;
  std::string ending{};  // required ending of the output's name
  bool needs_display = false;
  int exit_code = 0;
};

// A recording that ends in a fault replaces a device that is lost.
void recordFault(const std::string& path) {
  class Dying : public NullDevice {
   public:
    DeviceState exchange(const Wrench& wrench) noexcept override {
      DeviceState state = NullDevice::exchange(wrench);
      if (++exchanges_ > 50) state.status = DeviceStatus::fault;
      return state;
    }

   private:
    int exchanges_ = 0;
  };
  std::ofstream file(path, std::ios::binary);
  RecordingDevice recording(std::make_unique<Dying>(), file);
  recording.open();
  for (int i = 0; i < 60; ++i) recording.exchange({});
  recording.finish();
}

// Every option that names a file to write.
std::vector<Option> outputOptions(const std::string& swc, const std::string& set, const std::string& rec,
                                  const std::string& fault_rec) {
  const auto view = [swc](const std::string& option) {
    return [swc, option](const std::string& out) {
      return Arguments{"view", swc, "--seconds", "1", "--size", "200x150", option, out};
    };
  };
  const auto navigate = [set](const std::string& option) {
    return
        [set, option](const std::string& out) { return Arguments{"navigate", set, "--seconds", "0.1", option, out}; };
  };
  return {
      {"synth OUT",
       [](const std::string& out) {
         return Arguments{"synth", out, "--kind", "scene1"};
       }},
      {"synth -o",
       [](const std::string& out) {
         return Arguments{"synth", "-o", out, "--kind", "scene1"};
       }},
      {"synth --placements-out",
       [swc](const std::string& out) {
         return Arguments{"synth", swc + ".zip", "--cells", "2", "--placements-out", out};
       }},
      {"ingest --report",
       [swc, set](const std::string& out) {
         return Arguments{"ingest", swc, "-o", set + ".again", "--force", "--report", out};
       }},
      {"fix --report",
       [swc, set](const std::string& out) {
         return Arguments{"fix", swc, "-o", set + ".fixed/", "--force", "--report", out};
       }},
      {"check --report",
       [swc](const std::string& out) {
         return Arguments{"check", swc, "--report", out};
       }},
      {"export -o", [set](const std::string& out) { return Arguments{"export", set, "--cell", "cell", "-o", out}; }},
      {"export -o .zip",
       [set](const std::string& out) {
         return Arguments{"export", set, "--all", "-o", out};
       },
       false, ".zip"},
      {"measure --npz",
       [set](const std::string& out) {
         return Arguments{"measure", set, "--npz", out};
       },
       false, ".npz"},
      {"contacts -o", [set](const std::string& out) { return Arguments{"contacts", set, "--within", "1", "-o", out}; },
       false, ".tsv"},
      {"path -o", [set](const std::string& out) { return Arguments{"path", set, "cell:1", "cell:60", "-o", out}; }},
      {"navigate -o", navigate("-o")},
      {"navigate --csv", navigate("--csv")},
      {"navigate --plot", navigate("--plot")},
      {"navigate --picture", navigate("--picture")},
      {"navigate --record", navigate("--record")},
      {"navigate --fault-csv",
       [set, fault_rec](const std::string& out) {
         return Arguments{"navigate", set, "--realtime", "--device", "replay:" + fault_rec, "--fault-csv", out};
       },
       false, "", false, 3},
      {"devices --record",
       [](const std::string& out) {
         return Arguments{"devices", "--test", "sim:medium", "--record", out};
       }},
      {"render -o", [set](const std::string& out) { return Arguments{"render", set, "--size", "64x64", "-o", out}; },
       true},
      {"render --path -o",
       [set, rec](const std::string& out) {
         return Arguments{"render", set, "--size", "64x64", "--fps", "5", "--path", rec, "-o", out};
       },
       true, ".mp4"},
      {"view --state", view("--state"), false, "", true},
      {"view --record", view("--record"), false, "", true},
  };
}

// Type, device number, inode, and the target of a link.
struct Identity {
  mode_t mode = 0;
  dev_t device = 0;
  ino_t inode = 0;
  std::string leads_to{};
  bool operator==(const Identity&) const = default;
};
Identity identityOf(const std::string& path) {
  struct stat what {};
  if (::lstat(path.c_str(), &what) != 0) return {};
  std::error_code ignored;
  return {what.st_mode, what.st_rdev, what.st_ino, fs::read_symlink(path, ignored).string()};
}

// A tmpfs may be mounted without devices, so the device nodes must work in their folder.
bool makeDeviceNode(const std::string& path, int minor) {
  if (::mknod(path.c_str(), S_IFCHR | 0666, makedev(1, static_cast<unsigned>(minor))) != 0) return false;
  return std::system(("exec 2>/dev/null; : > " + path).c_str()) == 0;
}

TEST_F(Outputs, EveryOptionLeavesDevicesPipesAndLinksAsTheyWere) {
  if (::geteuid() != 0) GTEST_SKIP() << "makes device nodes: needs root";
  if (test::kSanitized) GTEST_SKIP() << "a hundred processes of the program, once is enough: the preset dev runs them";
  char name[] = "/tmp/filiform-outputs-XXXXXX";
  ASSERT_NE(::mkdtemp(name), nullptr);
  const std::string base = name;
  const auto removed = std::unique_ptr<char, void (*)(char*)>(name, [](char* folder) {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  });
  if (!makeDeviceNode(base + "/try", 3)) GTEST_SKIP() << "this system makes no device nodes in /tmp";
  constexpr int kNull = 3, kFull = 7;
  // A substitute for ffmpeg: it copies its input into the file named last.
  fs::create_directory(base + "/bin");
  writeBytes(base + "/bin/ffmpeg", "#!/bin/sh\nfor last; do :; done\nexec cat > \"$last\"\n");
  fs::permissions(base + "/bin/ffmpeg", fs::perms::owner_all);
  const std::string old_path = std::getenv("PATH");
  ::setenv("PATH", (base + "/bin:" + old_path).c_str(), 1);
  const auto restored = std::unique_ptr<const std::string, void (*)(const std::string*)>(
      &old_path, [](const std::string* before) { ::setenv("PATH", before->c_str(), 1); });
  const Outcome recorded = runFiliform({"navigate", path("cell.fil"), "--seconds", "0.5", "--record", path("a.rec")});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;

  recordFault(path("fault.rec"));
  const bool has_display = test::VirtualDisplay::isInstalled() && !test::VirtualDisplay::name().empty();
  if (has_display) ::setenv("DISPLAY", test::VirtualDisplay::name().c_str(), 1);
  ::setenv("XDG_CONFIG_HOME", path("config").c_str(), 1);

  int covered = 0;
  for (const Option& option : outputOptions(path("cell.swc"), path("cell.fil"), path("a.rec"), path("fault.rec"))) {
    if (option.needs_opengl && !canRender()) continue;
    if (option.needs_display && !has_display) continue;
    SCOPED_TRACE(option.name);
    ++covered;
    const std::string place = base + "/" + std::to_string(covered);
    fs::create_directory(place);
    const auto at = [&](const std::string& file) { return place + "/" + file + option.ending; };
    ASSERT_TRUE(makeDeviceNode(at("null"), kNull) && makeDeviceNode(at("full"), kFull));
    ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
    writeBytes(at("old"), "old");
    fs::permissions(at("old"), fs::perms::owner_read | fs::perms::owner_write);
    fs::create_symlink("null" + option.ending, at("to_null"));
    fs::create_symlink("old" + option.ending, at("to_old"));
    fs::create_symlink("new" + option.ending, at("dangling"));
    std::map<std::string, Identity> before;
    for (const char* file : {"null", "full", "pipe", "to_null", "to_old", "dangling"})
      before[file] = identityOf(at(file));

    for (const char* file : {"null", "to_null", "to_old", "dangling"}) {
      const Outcome outcome = runFiliform(option.words(at(file)));
      EXPECT_EQ(outcome.exit_code, option.exit_code) << file << ": " << outcome.err;
    }
    const Outcome full = runFiliform(option.words(at("full")));
    EXPECT_EQ(full.exit_code, 3) << full.err;
    EXPECT_NE(full.err.find("No space left"), std::string::npos) << full.err;
    const Outcome pipe = runFiliformInShell(
        "timeout 300 cat " + at("pipe") + " > " + at("read") + " & \"$@\"; code=$?; wait; exit $code",
        option.words(at("pipe")));
    EXPECT_EQ(pipe.exit_code, option.exit_code) << pipe.err;
    EXPECT_GT(fs::file_size(at("read")), 0u);

    for (const auto& [file, identity] : before) EXPECT_EQ(identityOf(at(file)), identity) << file;
    EXPECT_NE(readBytes(at("old")), "old");
    EXPECT_EQ(fs::status(at("old")).permissions(), fs::perms::owner_read | fs::perms::owner_write);
    EXPECT_GT(fs::file_size(at("new")), 0u);
    std::set<std::string> files;
    for (const auto& entry : fs::directory_iterator(place)) files.insert(entry.path().stem().string());
    EXPECT_EQ(files,
              (std::set<std::string>{"null", "full", "pipe", "old", "to_null", "to_old", "dangling", "new", "read"}));
  }
  RecordProperty("options", covered);
  EXPECT_GE(covered, 13);
}

// Tests of the window show that pictures are written through a link to a folder, and that a missing folder is made.
TEST_F(Outputs, PicturesOfTheWindowNeedAFolder) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  fs::create_symlink("cell.swc", path("link"));
  for (const std::string& place : {std::string("/dev/null"), std::string("/dev/full"), path("pipe"), path("link")}) {
    const Identity before = identityOf(place);
    expectRefusal({"view", path("cell.swc"), "--pictures", place}, 3, "--pictures " + place + ": is not a folder");
    EXPECT_EQ(identityOf(place), before);
  }
}

TEST_F(Outputs, AnInputIsNeverAnOutput) {
  fs::create_hard_link(path("cell.swc"), path("hard.swc"));
  fs::create_symlink("cell.swc", path("soft.swc"));
  fs::create_directory(path("folder"));
  fs::create_hard_link(path("cell.swc"), path("folder/inner.swc"));
  const std::string before = readBytes(path("cell.swc"));
  const std::string current = readBytes(path("cell.fil/CURRENT"));
  ASSERT_EQ(runFiliform(shortRun({"--record", path("a.rec")})).exit_code, 0);
  for (const char* same : {"cell.swc", "hard.swc", "soft.swc", "cell.fil/../cell.swc"}) {
    SCOPED_TRACE(same);
    expectRefusal({"ingest", path("cell.swc"), "-o", path("x.fil"), "--report", path(same)}, 2, "input");
    expectRefusal({"ingest", path("folder"), "-o", path("x.fil"), "--report", path(same)}, 2, "input");
    for (const char* option : {"--csv", "--plot", "--picture", "--record"})
      expectRefusal({"navigate", path("cell.swc"), option, path(same)}, 2, option);
    expectRefusal({"view", path("cell.swc"), "--record", path(same)}, 2, "input");
  }
  expectRefusal(shortRun({"--device", "replay:" + path("a.rec"), "--record", path("a.rec")}), 2, "input");
  for (const char* option : {"--csv", "--plot", "--record"})
    expectRefusal(shortRun({option, path("cell.fil/CURRENT")}), 2, "input");
  expectRefusal({"export", path("cell.fil"), "--cell", "cell", "-o", path("cell.fil/CURRENT")}, 2, "input");
  expectRefusal({"path", path("cell.fil"), "cell:1", "cell:9", "-o", path("cell.fil/CURRENT")}, 2, "input");
  fs::create_symlink("cell.swc", path("cell.png"));
  expectRefusal({"render", path("cell.swc"), "-o", path("cell.png")}, 2, "input");
  fs::create_symlink("cell.swc", path("cell-00001.png"));
  expectRefusal({"render", path("cell.swc"), "--path", path("a.rec"), "-o", path("cell-%05d.png")}, 2, "input");
  if (!test::kSanitized) {  // else filiform-lab is not built
    fs::create_symlink("cell.swc", path("folder/trials.csv"));
    expectRefusal({"evaluate", "--quick", "--corpus", path("cell.swc"), "-o", path("folder")}, 2, "input");
    fs::create_symlink("../cell.fil/CURRENT", path("folder/bench.json"));
    expectRefusal({"bench", "solver", "--scene", path("cell.fil"), "--quick", "--out", path("folder")}, 2, "input");
  }
  EXPECT_EQ(readBytes(path("cell.swc")), before);
  EXPECT_EQ(readBytes(path("cell.fil/CURRENT")), current);
  EXPECT_FALSE(fs::exists(path("x.fil")));
}

TEST_F(Outputs, TwoOutputsAtOnePlaceAreRefused) {
  fs::create_symlink("a", path("b"));
  expectRefusal(shortRun({"--csv", path("a"), "--plot", path("a")}), 2, "--plot");
  expectRefusal(shortRun({"--csv", path("a"), "--record", path("b")}), 2, "--record");
  expectRefusal(shortRun({"--csv", "-", "--json"}), 2, "--json");
  expectRefusal(shortRun({"--csv", "-", "--record", "/dev/stdout"}), 2, "--record");
  expectRefusal({"synth", path("a"), "--placements-out", path("a")}, 2, "--placements-out");
  expectRefusal({"path", path("cell.fil"), "cell:1", "cell:9", "-o", "-", "--json"}, 2, "--json");
  EXPECT_FALSE(fs::exists(path("a")));
  EXPECT_EQ(runFiliform(shortRun({"--csv", "/dev/null", "--plot", "/dev/null"})).exit_code, 0);
}

TEST_F(Outputs, AFileIsUntouchedWhenTheCommandFails) {
  writeBytes(path("a.csv"), "old");
  writeBytes(path("r.json"), "old");
  expectRefusal(shortRun({"--csv", path("a.csv"), "--route", "1:999"}), 2, "999");
  expectRefusal(shortRun({"--csv", path("a.csv"), "--plot", path("no/folder/b.png")}), 3, "b.png");
  expectRefusal({"ingest", path("cell.swc"), "-o", path("cell.fil"), "--report", path("r.json")}, 1, "--force");
  EXPECT_EQ(readBytes(path("a.csv")), "old");
  EXPECT_EQ(readBytes(path("r.json")), "old");
  // A full disk in the middle of the work.
  const Outcome full = runFiliformInShell("trap '' XFSZ; ulimit -f 4; exec \"$@\" 2>&1 >/dev/null",
                                          {"navigate", path("cell.fil"), "--csv", path("a.csv")});
  EXPECT_EQ(full.exit_code, 3) << full.out;
  EXPECT_EQ(readBytes(path("a.csv")), "old");
  std::set<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder_.path())) files.insert(entry.path().filename().string());
  EXPECT_EQ(files, (std::set<std::string>{"a.csv", "a.unfinished.csv", "r.json", "cell.swc", "cell.fil"}));
  const std::string rows = readBytes(path("a.unfinished.csv"));
  EXPECT_TRUE(rows.starts_with("tick,") && rows.ends_with('\n')) << rows;
}

TEST_F(Outputs, IngestIsNoReplacementForAFile) {
  writeBytes(path("file"), "old");
  fs::create_symlink("file", path("link"));
  for (const char* name : {"file", "link"})
    for (const bool force : {false, true}) {
      Arguments words{"ingest", path("cell.swc"), "-o", path(name)};
      if (force) words.push_back("--force");
      expectRefusal(words, 1, name);
    }
  expectRefusal({"ingest", path("cell.swc"), "-o", "/dev/null", "--force"}, 1, "/dev/null");
  EXPECT_EQ(readBytes(path("file")), "old");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(Outputs, StandardOutputHoldsTheResultAlone) {
  const Outcome rows = runFiliform(shortRun({"--csv", "-"}));
  ASSERT_EQ(rows.exit_code, 0) << rows.err;
  EXPECT_EQ(rows.out.substr(0, 5), "tick,");
  EXPECT_EQ(rows.out.find("method"), std::string::npos);
  EXPECT_NE(rows.err.find("method"), std::string::npos) << rows.err;
  for (const char* name : {"/dev/stdout", "/proc/self/fd/1", "/dev/fd/1"})
    EXPECT_EQ(runFiliform(shortRun({"--csv", name})).out, rows.out) << name;
  // Redirected into a file: appended to that file.
  writeBytes(path("out"), "first\n");
  EXPECT_EQ(runFiliformInShell("exec \"$@\" >> " + path("out"), shortRun({"--csv", "/dev/stdout"})).exit_code, 0);
  EXPECT_EQ(readBytes(path("out")), "first\n" + rows.out);
  // The file that the shell made for standard output, given by name.
  EXPECT_EQ(runFiliformInShell("exec \"$@\" > " + path("same"), shortRun({"--csv", path("same")})).exit_code, 0);
  EXPECT_EQ(readBytes(path("same")), rows.out);
  const Outcome swc = runFiliform({"export", path("cell.fil"), "--cell", "cell", "-o", "-"});
  EXPECT_EQ(swc.out.substr(0, 2), "# ");
  const Outcome plot = runFiliform(shortRun({"--plot", "-"}));
  EXPECT_EQ(plot.out.substr(1, 3), "PNG");
}

TEST_F(Outputs, AClosedPipeEndsQuietly) {
  std::string points;
  for (int i = 0; i < 20000; ++i) points += std::to_string(i % 180) + " 1 2\n";
  writeBytes(path("points"), points);
  const std::string head = "set -o pipefail; \"$@\" | head -n 1 > /dev/null";
  const Arguments tour{"navigate", path("cell.fil"), "--seconds", "10", "--route", "tour:1", "--csv"};
  Arguments to_dash = tour, to_device = tour;
  to_dash.push_back("-");
  to_device.push_back("/dev/stdout");
  for (const Arguments& words :
       {to_dash, Arguments{"nearest", path("cell.fil"), "--points", path("points")}, to_device}) {
    SCOPED_TRACE(words[0]);
    const Outcome outcome = runFiliformInShell(head, words);
    EXPECT_EQ(outcome.exit_code, 141);
    EXPECT_EQ(outcome.err, "");
  }
  const Outcome full = runFiliformInShell("\"$@\" > /dev/full", {"info", path("cell.fil")});
  EXPECT_EQ(full.exit_code, 3);
  EXPECT_TRUE(full.oneLineOnStderr()) << full.err;
  EXPECT_NE(full.err.find("No space left"), std::string::npos) << full.err;
  const Outcome closed = runFiliformInShell("\"$@\" >&-", {"info", path("cell.fil")});
  EXPECT_EQ(closed.exit_code, 3);
  EXPECT_TRUE(closed.oneLineOnStderr()) << closed.err;
}

TEST_F(Outputs, TextAndJsonSayTheSameOfEveryOutcome) {
  // A hand that aims at 0.1 um a second gives up. A route with an elbow takes more than 0.1 s.
  const auto said = [&](const Arguments& more, const std::string& shell) {
    Arguments json = more;
    json.push_back("--json");
    const Outcome text = runFiliformInShell(shell, more), object = runFiliformInShell(shell, json);
    const auto parsed = nlohmann::json::parse(object.out);
    const std::string word = parsed.at("outcome");
    EXPECT_NE(text.out.find("method climb: " + word), std::string::npos) << text.out << word;
    EXPECT_EQ(text.exit_code, object.exit_code);
    return word + " " + std::to_string(text.exit_code);
  };
  EXPECT_EQ(said({"navigate", path("cell.fil")}, "exec \"$@\""), "completed 0");
  EXPECT_EQ(said(shortRun({}), "exec \"$@\""), "time_over 0");
  const std::string until_begun = "\"$@\" & p=$!; sleep 1; kill -";
  const Arguments tour{"navigate", path("cell.fil"), "--route", "tour:1", "--seconds", "100000", "--realtime"};
  EXPECT_EQ(said(tour, until_begun + "INT $p; wait $p"), "interrupted 130");
  EXPECT_EQ(said(tour, until_begun + "TERM $p; wait $p"), "interrupted 143");
  const Arguments fast{"navigate", path("cell.fil"), "--route", "tour:1", "--seconds", "100000"};
  EXPECT_EQ(said(fast, until_begun + "INT $p; wait $p"), "interrupted 130");
  // A recording that ends before the tip.
  ASSERT_EQ(runFiliform(shortRun({"--record", path("a.rec")})).exit_code, 0);
  EXPECT_EQ(
      said({"navigate", path("cell.fil"), "--device", "replay:" + path("a.rec"), "--seconds", "100"}, "exec \"$@\""),
      "stuck 0");
}

TEST_F(Outputs, AnInterruptedRunLeavesOlderFilesAndKeepsItsRecording) {
  for (const char* name : {"a.csv", "a.png", "a.rec"}) writeBytes(path(name), "old");
  const Arguments words{"navigate", path("cell.fil"), "--route", "tour:1",      "--seconds", "100000",
                        "--csv",    path("a.csv"),    "--plot",  path("a.png"), "--record",  path("a.rec")};
  const Outcome outcome = runFiliformInShell("\"$@\" & p=$!; sleep 1; kill -INT $p; wait $p", words);
  EXPECT_EQ(outcome.exit_code, 130);
  EXPECT_NE(outcome.out.find("interrupted"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.err.find("a.unfinished.rec"), std::string::npos) << outcome.err;
  for (const char* name : {"a.csv", "a.png", "a.rec"}) EXPECT_EQ(readBytes(path(name)), "old") << name;
  EXPECT_EQ(
      runFiliform({"navigate", path("cell.fil"), "--device", "replay:" + path("a.unfinished.rec"), "--route", "tour:1"})
          .exit_code,
      0);
  std::set<std::string> files;
  for (const auto& entry : fs::directory_iterator(folder_.path())) files.insert(entry.path().filename().string());
  EXPECT_EQ(files, (std::set<std::string>{"a.csv", "a.png", "a.rec", "a.unfinished.csv", "a.unfinished.rec", "cell.swc",
                                          "cell.fil"}));
  // If nothing exists at the path, the recording gets its own name.
  const Outcome fresh = runFiliformInShell(
      "\"$@\" & p=$!; sleep 1; kill -INT $p; wait $p",
      {"navigate", path("cell.fil"), "--route", "tour:1", "--seconds", "100000", "--record", path("fresh.rec")});
  EXPECT_EQ(fresh.exit_code, 130);
  EXPECT_TRUE(fs::exists(path("fresh.rec")));
}

TEST_F(Outputs, ThePictureNameTellsItsFormat) {
  for (const char* name : {"a.gif", "a.jpg", "a.swc"}) {
    expectRefusal({"render", path("cell.swc"), "-o", path(name)}, 2, ".png");
    EXPECT_FALSE(fs::exists(path(name)));
  }
}

}  // namespace
}  // namespace filiform
