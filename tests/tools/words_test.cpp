// The messages for mistyped command lines, and the forms of values that the program accepts.
#include "index/errors.h"
#include "index/formats/swc.h"
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"
#include "tools/commands/commands.h"
#include "tools/words/near_names.h"
#include "tools/words/numbers.h"
#include "tools/words/unit.h"

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

std::vector<std::string> nearTo(const std::string& wanted, const std::vector<std::string>& names) {
  tools::NearNames near_names(wanted);
  for (const std::string& name : names) near_names.offer(name);
  return near_names.names();
}

TEST(NearNames, PutsTheNearestFirst) {
  using Names = std::vector<std::string>;
  const Names commands{"check", "ingest", "info", "nearest", "navigate", "view"};
  EXPECT_EQ(nearTo("nearst", commands), Names{"nearest"});
  EXPECT_EQ(nearTo("naerest", commands), Names{"nearest"}) << "a swap is one edit";
  EXPECT_EQ(nearTo("in", commands), (Names{"info", "ingest"}));
  EXPECT_EQ(nearTo("INFO", commands), Names{"info"});
  EXPECT_EQ(nearTo("gate", commands), Names{"navigate"});
  EXPECT_EQ(nearTo("zebra", commands), Names{});
  EXPECT_EQ(nearTo("x", {"xa", "axa", "b"}), Names{"xa"}) << "one letter is in too many names, and near no other";
  EXPECT_EQ(nearTo("--cell", {"--help", "--tsv", "--cells"}), Names{"--cells"}) << "dashes are not alike letters";
  EXPECT_EQ(nearTo("-x", {"-h", "-o"}), Names{});
  EXPECT_EQ(nearTo("cell_1", {"cell_15", "cell_14", "cell_13", "cell_12"}), (Names{"cell_12", "cell_13", "cell_14"}));
}

TEST(NearNames, ReadAsAQuestion) {
  EXPECT_EQ(tools::didYouMean({}), "");
  EXPECT_EQ(tools::didYouMean({"a"}), "; did you mean 'a'?");
  EXPECT_EQ(tools::didYouMean({"a", "b", "c\x1b"}), "; did you mean 'a', 'b' or 'c\\x1b'?");
}

TEST(ByteCounts, TakeWhatPeopleWrite) {
  const auto bytes = [](const std::string& text) { return tools::parseBytes("--memory", text); };
  EXPECT_EQ(bytes("1G"), 1ull << 30);
  EXPECT_EQ(bytes("1GiB"), 1ull << 30);
  EXPECT_EQ(bytes("1GB"), 1'000'000'000u);
  EXPECT_EQ(bytes("2T"), 2ull << 40);
  EXPECT_EQ(bytes("1.5 M"), 3u << 19);
  EXPECT_EQ(bytes("64K"), 65536u);
  EXPECT_EQ(bytes("64kB"), 64000u);
  EXPECT_EQ(bytes("64KB"), 64000u);
  EXPECT_EQ(bytes("312"), 312u);
  EXPECT_EQ(bytes("312 B"), 312u);
  for (const char* wrong : {"", "G", "1X", "1g", "1Gi", "1Gb", "1kiB", "1k", "-1G", "1 G B", "9999999T", "nan"})
    EXPECT_THROW(bytes(wrong), UsageError) << wrong;
}

TEST(Units, ANumberMayHaveAUnit) {
  const auto unit_um = [](const std::string& text) {
    SwcOptions options;
    tools::readUnit(text, options);
    EXPECT_FALSE(options.voxel_um) << text;
    return options.unit_um;
  };
  EXPECT_EQ(unit_um("um"), 1);
  EXPECT_EQ(unit_um("nm"), 0.001);
  EXPECT_EQ(unit_um("mm"), 1000);
  EXPECT_EQ(unit_um("0.5"), 0.5);
  EXPECT_EQ(unit_um("8nm"), 0.008);
  EXPECT_EQ(unit_um("5 nm"), 0.005);
  EXPECT_EQ(unit_um("0.5um"), 0.5);
  EXPECT_EQ(unit_um("0.5\u00B5m"), 0.5);
  EXPECT_EQ(unit_um("2mm"), 2000);
  const auto voxel_um = [](const std::string& text) {
    SwcOptions options;
    tools::readUnit(text, options);
    return options.voxel_um.value_or(Vector3d::Zero());
  };
  EXPECT_EQ(voxel_um("4,4,40"), Vector3d(4, 4, 40));
  EXPECT_EQ(voxel_um("8,8,30nm"), Vector3d(0.008, 0.008, 0.03));
  EXPECT_EQ(voxel_um("0.5um,0.5um,1"), Vector3d(0.5, 0.5, 1));
  EXPECT_EQ(voxel_um("8nm,8nm,1um"), Vector3d(0.008, 0.008, 1));
  for (const char* wrong : {"", "inch", "8pm", "0", "-1", "nan", "1,2", "1,2,3,4", "1,,3", "nm,nm,nm", "8nmx", "1e400"})
    EXPECT_THROW(unit_um(wrong), UsageError) << wrong;
}

class Words : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string cell = "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n";
    std::vector<std::string> ingest{"ingest"};
    for (const char* name : {"apple_1", "apple_10", "apple_2", "Pear", "fig"}) {
      test::writeBytes(folder_ / (std::string(name) + ".swc"), cell);
      ingest.push_back(folder_ / (std::string(name) + ".swc"));
    }
    ingest.insert(ingest.end(), {"-o", set_});
    const Outcome made = runFiliform(ingest);
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  void expectRefusal(const std::vector<std::string>& words, int code, const std::vector<std::string>& says,
                     const std::vector<std::string>& says_not = {}) {
    const Outcome outcome = runFiliform(words);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    for (const std::string& text : says) EXPECT_NE(outcome.err.find(text), std::string::npos) << text << outcome.err;
    for (const std::string& text : says_not)
      EXPECT_EQ(outcome.err.find(text), std::string::npos) << text << outcome.err;
  }
  test::TempFolder folder_;
  std::string set_ = folder_ / "fruit.fil";
};

TEST_F(Words, AMisspeltCommandNamesTheNearest) {
  expectRefusal({"nearst", set_}, 2, {"unknown command 'nearst'", "did you mean 'nearest'?", "filiform --help"});
  expectRefusal({"frobnicate"}, 2, {"unknown command 'frobnicate'", "filiform --help"}, {"did you mean"});
}

TEST_F(Words, AMisspeltOptionNamesTheNearest) {
  expectRefusal({"info", set_, "--jsn"}, 2, {"unknown option '--jsn'", "'--json'", "filiform info --help"});
  expectRefusal({"ingest", "--memroy=64MiB", "a.swc"}, 2, {"'--memroy'", "'--memory'"}, {"64MiB"});
  expectRefusal({"nearest", set_, "1", "2", "3", "-4"}, 2, {"XYZ"}, {"unknown option"});
  expectRefusal({"--versoin"}, 2, {"'--versoin'", "'--version'"});
}

TEST_F(Words, AValueThatDoesNotFitIsToldWhatDoes) {
  expectRefusal({"navigate", set_, "--zoom", "300um"}, 2, {"--zoom 300um: give a number"});
  expectRefusal({"nearest", set_, "1", "2", "3", "--k", "1.5"}, 2, {"--k 1.5: give a whole number from 1 to 1000000"});
  expectRefusal({"nearest", set_, "1", "2", "3", "--k", "0"}, 2, {"--k 0: give a whole number from 1 to 1000000"});
  expectRefusal({"nearest", set_, "1", "2", "3", "--radius", "-1"}, 2, {"--radius -1: give 0 or more"});
  expectRefusal({"nearest", set_, "--box", "0", "0", "0", "5", "5"}, 2,
                {"--box: give 6 values (X0 Y0 Z0 X1 Y1 Z1), not 5"});
  expectRefusal({"nearest", set_, "1", "2"}, 2, {"XYZ: give 3 values (X Y Z), not 2"});
  expectRefusal({"nearest", set_, "1", "2", "3", "4"}, 2, {"XYZ", "4"});
  expectRefusal({"ingest", "a.swc", "-o"}, 2, {"--output needs a value: SET"});
  expectRefusal({"navigate", set_, "--route", "longst"}, 2, {"no such route 'longst'", "longest"});
  expectRefusal({"info", folder_.path()}, 3, {"CURRENT: is missing", "not a tile set", "filiform ingest"});
}

TEST_F(Words, AnUnknownHandDeviceOrKindIsNamedWithThoseThatExist) {
  expectRefusal({"navigate", set_, "--hand", "lose"}, 2,
                {"no such hand 'lose'", "loose, medium or firm", "did you mean 'loose'?"});
  expectRefusal({"navigate", set_, "--device", "falcn:x.bin"}, 2,
                {"no such device 'falcn:x.bin'", "falcon[:FIRMWARE]", "did you mean 'falcon'?"});
  expectRefusal({"devices", "--test", "sim:frim"}, 2, {"no such hand 'frim'", "did you mean 'firm'?"});
  expectRefusal({"devices", "--test", "joystick"}, 2, {"no such device 'joystick'", "null"}, {"did you mean"});
  expectRefusal({"synth", folder_ / "s.zip", "--kind", "colum"}, 2,
                {"no such kind 'colum'", "traces", "did you mean 'column'?"});
}

TEST_F(Words, ARateOfZeroIsToldTheRange) {
  for (const char* rate : {"0", "-1", "1000001", "nan"})
    expectRefusal({"navigate", set_, "--rate", rate}, 2,
                  {std::string("--rate ") + rate + ": give more than 0 and at most 1000000 ticks a second"});
}

TEST_F(Words, SynthWritesNoZipUnderAnotherEnding) {
  for (const char* name : {"a.txt", "a.swc", "a.zip.txt"}) {
    expectRefusal({"synth", folder_ / name, "--kind", "scene1"}, 2, {std::string(name) + ": synth writes a zip"});
    EXPECT_FALSE(std::filesystem::exists(folder_ / name));
  }
  for (const char* name : {"a.zip", "a.ZIP", "a"})
    EXPECT_EQ(runFiliform({"synth", folder_ / name, "--kind", "scene1"}).exit_code, 0) << name;
  EXPECT_EQ(runFiliform({"synth", "/dev/null", "--kind", "scene1"}).exit_code, 0);
  EXPECT_EQ(runFiliform({"synth", "-", "--kind", "scene1"}).exit_code, 0);
  expectRefusal({"synth", folder_.path(), "--kind", "scene1"}, 3, {"is a folder"});
}

TEST_F(Words, TheHelpHasNoMarksOfItsLibrary) {
  for (const char* command : {"nearest", "render", "ingest", "view"}) {
    const std::string help = runFiliform({command, "--help"}).out;
    for (const char* mark : {"(0x)", "(3x)", " x 6", "NONNEGATIVE", ":FLOAT", ":UINT"})
      EXPECT_EQ(help.find(mark), std::string::npos) << command << ": " << mark;
  }
}

TEST_F(Words, WithoutACommandTheCommandsArePrinted) {
  const Outcome bare = runFiliform({});
  EXPECT_EQ(bare.exit_code, 2);
  EXPECT_EQ(bare.out, "");
  for (const char* command : {"ingest", "nearest", "navigate", "view"})
    EXPECT_NE(bare.err.find(std::string("\n  ") + command + " "), std::string::npos) << command << bare.err;
}

TEST_F(Words, ACellIsNamedByAnyPartThatNoOtherHas) {
  const auto cellOf = [&](const std::string& name) {
    const Outcome outcome = runFiliform({"navigate", set_, "--cell", name, "--seconds", "0.01", "--json"});
    return outcome.exit_code == 0 ? nlohmann::json::parse(outcome.out).at("cell").get<std::string>() : outcome.err;
  };
  EXPECT_EQ(cellOf("apple_1"), "apple_1") << "the whole name wins over those that begin with it";
  EXPECT_EQ(cellOf("APPLE_1"), "apple_1");
  EXPECT_EQ(cellOf("_2"), "apple_2");
  EXPECT_EQ(cellOf("pear"), "Pear");
  EXPECT_EQ(cellOf("fig.swc"), "fig") << "a part of the source";
  expectRefusal({"navigate", set_, "--cell", "apple"}, 2,
                {"--cell apple", "3 cells", "'apple_1'", "'apple_10'", "'apple_2'"});
  expectRefusal({"navigate", set_, "--cell", "swc"}, 2, {"the sources of 5 cells"});
  expectRefusal({"export", set_, "--cell", "aple_2", "-o", folder_ / "x.swc"}, 2, {"did you mean 'apple_2'"});
  expectRefusal({"export", set_, "--cell", "", "-o", folder_ / "x.swc"}, 2, {"--cell"});
  expectRefusal({"info", set_, "--parameters", "--cell", "zebra"}, 2, {"--cell zebra", "filiform cells"});
}

TEST_F(Words, AMessageNamesTheOptionThatWasGiven) {
  if (test::kSanitized) GTEST_SKIP() << "the OpenGL driver leaks, and the sanitizer changes the exit code";
  const std::string png = folder_ / "x.png";
  const Outcome can_draw = runFiliform({"render", set_, "-o", png, "--size", "16x16"});
  if (can_draw.exit_code == 3) GTEST_SKIP() << can_draw.err;
  expectRefusal({"render", set_, "-o", png, "--highlight", "figg"}, 2, {"--highlight figg", "'fig'"}, {"--cell"});
  expectRefusal({"render", set_, "-o", png, "--at", "fgi:2"}, 2, {"--at fgi", "'fig'"}, {"--cell"});
}

TEST_F(Words, AnIngestTakesAUnitWithANumberAndAMemoryWithALetter) {
  const std::string set = folder_ / "nm.fil";
  const Outcome made = runFiliform({"ingest", folder_ / "fig.swc", "-o", set, "--unit", "8nm", "--memory", "1G"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Outcome nearest = runFiliform({"nearest", set, "1", "0", "0", "--json"});
  EXPECT_NEAR(nlohmann::json::parse(nearest.out).at(0).at("x").get<double>(), 20 * 0.008, 0.001);
}

TEST_F(Words, ATarIsAnArchive) {
  const std::string cells = "apple_1.swc apple_2.swc fig.swc";
  const auto pack = [&](const std::string& command) {
    const Outcome packed = test::runFiliformInShell("cd " + folder_.path() + " && " + command, {});
    EXPECT_EQ(packed.exit_code, 0) << packed.err;
    return runFiliform({"check", folder_ / "t.tar"});
  };
  const std::string set = folder_ / "t.fil";
  for (const std::string& command : {"tar -cf t.tar " + cells, "tar --format=v7 -cf t.tar " + cells}) {
    const Outcome check = pack(command);
    EXPECT_EQ(check.exit_code, 0) << check.err;
    EXPECT_EQ(check.out.substr(0, check.out.find('\n')),
              "3 inputs: 3 accepted, 0 with warnings, 0 refused; 9 samples, 6 segments kept");
    const Outcome made = runFiliform({"ingest", folder_ / "t.tar", "-o", set, "--force"});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    const Outcome fig = runFiliform({"navigate", set, "--cell", "fig", "--seconds", "0.01", "--json"});
    EXPECT_EQ(fig.exit_code, 0) << fig.err;
  }
  const Outcome check = pack("tar -czf t.tgz " + cells + " && cp t.tgz t.tar");
  EXPECT_EQ(check.exit_code, 1);
  EXPECT_EQ(check.out,
            "1 input: 0 accepted, 0 with warnings, 1 refused; 0 samples, 0 segments kept\n"
            "  refused t.tar: not an archive of its ending, or one that contradicts itself (E_ZIP_FORMAT)\n");
  const std::string none = folder_ / "none.fil";
  expectRefusal({"ingest", folder_ / "t.tar", "-o", none}, 1, {"t.tar", "not an archive of its ending"});
  EXPECT_FALSE(std::filesystem::exists(none));
}

TEST_F(Words, AWrongSceneIsNoInternalError) {
  if (!test::kSanitized)  // else filiform-lab is not built
    expectRefusal({"bench", "scene", "--quick", "--scene", folder_ / "none.fil", "--out", folder_ / "b"}, 3,
                  {"none.fil"}, {"internal error"});
  expectRefusal({"synth", folder_ / "s.zip", "--kind", "scene9"}, 2, {"scene1", "scene2", "scene3"},
                {"internal error"});
}

TEST_F(Words, WithoutTheLabItsCommandsSayWhatTheyNeed) {
  const std::string alone = folder_ / "filiform";
  std::filesystem::copy_file(test::filiformProgram(), alone);
  for (const char* command : {"bench", "evaluate"}) {
    const Outcome outcome =
        test::runFiliformInShell("PATH=/usr/bin:/bin exec '" + alone + "' " + command + " --quick", {});
    EXPECT_EQ(outcome.exit_code, 3);
    EXPECT_NE(outcome.err.find("filiform-lab"), std::string::npos) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  }
}

}  // namespace
}  // namespace filiform
