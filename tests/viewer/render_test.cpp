// filiform render as a user runs it.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;
using test::runFiliformInShell;

class Render : public ::testing::Test {
 protected:
  void SetUp() override {
    test::writeBytes(folder_ / "y.swc",
                     "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 5 0 1 3\n5 3 40 10 0 1 4\n6 3 30 -5 0 "
                     "700 3\n7 3 40 -10 0 1 6\n");
  }
  bool wrote(const std::string& name) const {
    return std::filesystem::exists(folder_ / name) && test::readBytes(folder_ / name).substr(1, 3) == "PNG";
  }
  void refused(const std::vector<std::string>& more, int code, const std::string& says) {
    std::vector<std::string> arguments{"render", folder_ / "y.swc", "-o", folder_ / "no.png"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    EXPECT_NE(outcome.err.find(says), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "no.png"));
  }
  test::TempFolder folder_;
};

TEST_F(Render, DrawsAFileAndASetAlike) {
  ASSERT_EQ(runFiliform({"ingest", folder_ / "y.swc", "-o", folder_ / "y.fil"}).exit_code, 0);
  for (const char* scene : {"y.swc", "y.fil"}) {
    const Outcome outcome = runFiliform(
        {"render", folder_ / scene, "-o", folder_ / (std::string(scene) + ".png"), "--size", "200x100", "--json"});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto json = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(json["width"], 200);
    EXPECT_EQ(json["segments"], 6);
    EXPECT_EQ(json["left_out"], 0);
    EXPECT_EQ(json["implausible_radii"], 1);
    EXPECT_TRUE(wrote(std::string(scene) + ".png"));
  }
  EXPECT_EQ(test::readBytes(folder_ / "y.swc.png"), test::readBytes(folder_ / "y.fil.png"));
}

TEST_F(Render, TakesEveryViewAndMode) {
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--at", "y:3", "--zoom", "50", "--stereo", "anaglyph"},
        {"--proxy", "25,1,0", "--zoom", "50", "--palette", "orange-blue", "--camera", "40,10"},
        {"--camera", "0,0,200:20,0,0", "--colour-by", "type"},
        {"--camera", "top", "--stereo", "side-by-side", "--widening", "1.2"},
        {"--highlight", "y", "--orthographic"}}) {
    std::vector<std::string> arguments{"render", folder_ / "y.swc", "-o", folder_ / "a.png", "--size", "64x48"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_TRUE(wrote("a.png"));
    std::filesystem::remove(folder_ / "a.png");
  }
}

TEST_F(Render, ColoursByAMeasureOfSetsAndFiles) {
  ASSERT_EQ(runFiliform({"ingest", folder_ / "y.swc", "-o", folder_ / "y.fil"}).exit_code, 0);
  for (const char* scene : {"y.swc", "y.fil"}) {
    const std::vector<std::string> arguments{"render",      folder_ / scene,  "-o",     folder_ / "a.png",
                                             "--colour-by", "measure:length", "--size", "64x48"};
    const Outcome said = runFiliform(arguments);
    EXPECT_EQ(said.exit_code, 0) << said.err;
    EXPECT_NE(said.out.find("measure:length 5"), std::string::npos) << said.out;
    EXPECT_NE(said.out.find(" um: 1 cell\n"), std::string::npos) << said.out;
  }
}

TEST_F(Render, SaysWhatLiesFarOutsideAnOverviewAndHowToSeeIt) {
  std::string many, few = "1 3 50000 0 0 1 -1\n2 3 50001 0 0 1 1\n";
  for (int i = 1; i <= 400; ++i)
    many += std::to_string(i) + " 3 " + std::to_string(i % 20) + ' ' + std::to_string(i / 20) + " 0 1 " +
            std::to_string(i > 1 ? i - 1 : -1) + '\n';
  test::writeBytes(folder_ / "many.swc", many);
  test::writeBytes(folder_ / "few.swc", few);
  const std::string set = folder_ / "far.fil";
  ASSERT_EQ(runFiliform({"ingest", folder_ / "many.swc", folder_ / "few.swc", "-o", set, "--capacity", "20"}).exit_code,
            0);
  const auto render = [&](const std::string& option) {
    std::vector<std::string> arguments{"render", set, "-o", folder_ / "far.png", "--size", "64x48"};
    if (!option.empty()) arguments.push_back(option);
    return runFiliform(arguments).out;
  };
  EXPECT_NE(render("").find("not in the picture: 1 segment far from all others; --all"), std::string::npos);
  EXPECT_EQ(render("--all").find("not in the picture"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(render("--json"))["far_segments"], 1);
}

TEST_F(Render, WhatCannotBeIsOneClearLine) {
  refused({"--size", "0x10"}, 2, "--size");
  refused({"--size", "wide"}, 2, "WIDTHxHEIGHT");
  refused({"--stereo", "3d"}, 2, "anaglyph");
  refused({"--colour-by", "mood"}, 2, "radius");
  refused({"--colour-by", "measure:lenght"}, 2, "did you mean 'length'");
  refused({"--camera", "up"}, 2, "front");
  refused({"--camera", "follow"}, 2, "--proxy");
  refused({"--camera", "1,2,3:1,2,3"}, 2, "two different points");
  refused({"--at", "y:99"}, 2, "no sample");
  refused({"--at", "who:1"}, 2, "no cell");
  refused({"--proxy", "1,2"}, 2, "3 numbers");
  refused({"--palette", "grey"}, 2, "orange-blue");
  refused({"--theme", "pink"}, 2, "light or dark");
  refused({"--highlight", "who"}, 2, "no cell");
  refused({"--stereo", "quad-buffer"}, 3, "anaglyph");
  refused({"--path", "none.rec"}, 2, "FILE.mp4");
}

TEST_F(Render, ARecordedTravelIsAFilmAtAFixedRate) {
  ASSERT_EQ(
      runFiliform({"navigate", folder_ / "y.swc", "--zoom", "60", "--route", "1:5", "--record", folder_ / "y.rec"})
          .exit_code,
      0);
  const Outcome outcome =
      runFiliform({"render", folder_ / "y.swc", "-o", folder_ / "y-%04d.png", "--path", folder_ / "y.rec", "--zoom",
                   "60", "--route", "1:5", "--fps", "2", "--size", "64x48", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(outcome.err.empty()) << outcome.err;  // no note that the replay differs
  const auto json = nlohmann::json::parse(outcome.out);
  const int pictures = json["pictures"];
  EXPECT_GT(pictures, 1);
  EXPECT_TRUE(wrote("y-0001.png"));
  std::array<char, 16> last{};
  std::snprintf(last.data(), last.size(), "y-%04d.png", pictures);
  EXPECT_TRUE(wrote(last.data()));
  EXPECT_NE(test::readBytes(folder_ / "y-0001.png"), test::readBytes(folder_ / last.data()));
  const Outcome alone = runFiliform({"render", folder_ / "y.swc", "-o", folder_ / "y.mp4"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_NE(alone.err.find("--path"), std::string::npos);
}

TEST_F(Render, AFilmShowsTheTravelThatWasRecordedWhateverIsTypedAgain) {
  const std::string scene = folder_ / "y.swc", rec = folder_ / "t.rec";
  ASSERT_EQ(runFiliform({"navigate", scene, "--zoom", "60", "--route", "1:5", "--method", "force", "--record", rec})
                .exit_code,
            0);
  const auto film = [&](const std::string& name, std::vector<std::string> more) {
    more.insert(more.begin(), {"render", scene, "-o", folder_ / (name + "-%02d.png"), "--path", rec, "--fps", "2",
                               "--size", "64x48"});
    return runFiliform(more);
  };
  const Outcome told = film("told", {"--zoom", "60", "--route", "1:5", "--method", "force"});
  ASSERT_EQ(told.exit_code, 0) << told.err;
  const Outcome alone = film("alone", {});
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  EXPECT_NE(alone.err.find("--route 1:5 --method force --zoom 60"), std::string::npos) << alone.err;
  EXPECT_EQ(alone.err.find("forces differ"), std::string::npos) << alone.err;
  for (const char* number : {"01", "02"})
    EXPECT_EQ(test::readBytes(folder_ / ("alone-" + std::string(number) + ".png")),
              test::readBytes(folder_ / ("told-" + std::string(number) + ".png")));
  const Outcome other = film("other", {"--zoom", "90"});
  EXPECT_NE(other.err.find("--zoom 90 (recorded: 60)"), std::string::npos) << other.err;
}

TEST_F(Render, TheBudgetIsKeptAndTheRestCounted) {
  const Outcome outcome =
      runFiliform({"render", folder_ / "y.swc", "-o", folder_ / "a.png", "--segments", "2", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["segments"], 0);
  EXPECT_EQ(json["left_out"], 6);
}

// An environment variable of Mesa makes the driver report an old version.
TEST_F(Render, WithoutOpenGl33ItSaysWhatToDo) {
  const Outcome outcome = runFiliformInShell("MESA_GL_VERSION_OVERRIDE=2.1 exec \"$@\"",
                                             {"render", folder_ / "y.swc", "-o", folder_ / "a.png"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  EXPECT_NE(outcome.err.find("libgl1-mesa-dri"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.png"));
}

}  // namespace
}  // namespace filiform
