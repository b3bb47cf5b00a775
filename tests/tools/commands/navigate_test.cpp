// Tours, the passivity controller and automatic parameters, as the program shows them.
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

class Travel : public ::testing::Test {
 protected:
  void SetUp() override {
    // A zigzag of 40 samples with a twig at every fourth sample.
    std::string swc;
    for (int i = 1; i <= 40; ++i)
      swc += std::to_string(i) + " 3 " + std::to_string(5 * i) + " " + std::to_string(i % 2 * 2) + " 0 1 " +
             std::to_string(i == 1 ? -1 : i - 1) + "\n";
    for (int i = 1; i <= 10; ++i)
      swc += std::to_string(40 + i) + " 3 " + std::to_string(20 * i) + " 9 3 1 " + std::to_string(4 * i) + "\n";
    test::writeBytes(folder_ / "zigzag.swc", swc);
    const Outcome made = runFiliform({"ingest", folder_ / "zigzag.swc", "-o", folder_ / "z.fil", "--capacity", "8"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  test::TempFolder folder_;
};

TEST_F(Travel, ATourReportsItsLegs) {
  const Outcome outcome =
      runFiliform({"navigate", folder_ / "z.fil", "--route", "tour:3", "--seconds", "20", "--speed", "0.3", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json.at("outcome"), "completed");
  EXPECT_EQ(json.at("ticks"), 20000);
  EXPECT_GT(json.at("jumps"), 2);
  EXPECT_EQ(json.at("legs"), json.at("jumps").get<int>() + 1);
  EXPECT_EQ(
      runFiliform({"navigate", folder_ / "z.fil", "--route", "tour:3", "--seconds", "20", "--speed", "0.3", "--json"})
          .out,
      outcome.out);
  for (const char* wrong : {"tour", "tour:", "tour:x", "tour:-1"}) {
    const Outcome refused = runFiliform({"navigate", folder_ / "z.fil", "--route", wrong});
    EXPECT_EQ(refused.exit_code, 2) << wrong;
    EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
  }
}

// The time limit at the end of a real-time run covers the loop, not the drawing and writing after it.
TEST_F(Travel, APictureThatTakesLongToWriteDoesNotEndARunInRealTimeAsAFault) {
  const Outcome outcome =
      test::runFiliformInShell("mkfifo " + (folder_ / "force.png") + " && { sleep 5; cat " + (folder_ / "force.png") +
                                   "; } >/dev/null & sleep 0.2; exec \"$@\"",
                               {"navigate", folder_ / "z.fil", "--route", "tour:3", "--seconds", "0.5", "--realtime",
                                "--plot", folder_ / "force.png"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST_F(Travel, ATourInRealTimeShowsItsLoopAndIsReplayedToTheByte) {
  const auto travels = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"navigate", folder_ / "z.fil", "--route", "tour:3", "--seconds",
                                       "3",        "--speed",         "0.6",     "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  const auto live = travels({"--device", "sim:firm", "--realtime", "--record", folder_ / "f.rec", "--csv",
                             folder_ / "live.csv", "--prefetch", "none"});
  for (const char* what : {"wake", "compute", "exchange", "period"}) {
    const auto& times = live.at("loop").at(what);
    EXPECT_LE(times.at("p50_us").get<double>(), times.at("p99_us").get<double>()) << what;
    EXPECT_LE(times.at("p99_us").get<double>(), times.at("p99.9_us").get<double>()) << what;
    EXPECT_LE(times.at("p99.9_us").get<double>(), times.at("p99.99_us").get<double>()) << what;
    EXPECT_LE(times.at("p99.99_us").get<double>(), times.at("max_us").get<double>()) << what;
    EXPECT_GT(times.at("mean_us").get<double>(), 0) << what;
  }
  EXPECT_TRUE(live.at("loop").at("interruptions").is_number());
  const auto replayed = travels({"--device", "replay:" + (folder_ / "f.rec"), "--csv", folder_ / "replayed.csv"});
  EXPECT_TRUE(replayed.at("loop").is_null());
  EXPECT_EQ(replayed.at("jumps"), live.at("jumps"));
  EXPECT_EQ(replayed.at("frontiers"), live.at("frontiers"));
  EXPECT_EQ(test::readBytes(folder_ / "replayed.csv"), test::readBytes(folder_ / "live.csv"));
}

TEST_F(Travel, ARecordingKnowsWhatItsRunWasTold) {
  const std::string set = folder_ / "z.fil", recording = folder_ / "told.rec";
  const auto csvOf = [&](std::vector<std::string> more, std::string* err = nullptr) {
    more.insert(more.begin(), {"navigate", set, "--csv", folder_ / "told.csv"});
    const Outcome outcome = runFiliform(more);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    if (err != nullptr) *err = outcome.err;
    return test::readBytes(folder_ / "told.csv");
  };
  const std::string live =
      csvOf({"--route", "tour:5", "--seconds", "1.5", "--zoom", "150.5", "--hand", "loose", "--record", recording});
  std::string err;
  EXPECT_EQ(csvOf({"--device", "replay:" + recording}, &err), live);
  EXPECT_NE(err.find("--route tour:5 --seconds 1.5 --zoom 150.5"), std::string::npos) << err;
  EXPECT_NE(csvOf({"--device", "replay:" + recording, "--zoom", "200"}), live) << "an option given now wins";
  const Outcome missing = runFiliform({"navigate", set, "--device", "replay:" + (folder_ / "none.rec")});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_TRUE(missing.oneLineOnStderr()) << missing.err;
}

TEST_F(Travel, AZoomAtWhichNothingIsTravelledIsRefused) {
  for (const char* zoom : {"3e5", "1e6", "1e9", "1e-9", "0", "-5", "nan"})
    for (const char* route : {"longest", "tour:1"}) {
      const Outcome refused =
          runFiliform({"navigate", folder_ / "z.fil", "--zoom", zoom, "--route", route, "--seconds", "0.2"});
      EXPECT_EQ(refused.exit_code, 2) << zoom << refused.out;
      EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
      EXPECT_NE(refused.err.find("zoom"), std::string::npos) << refused.err;
    }
  EXPECT_NE(runFiliform({"navigate", folder_ / "z.fil", "--zoom", "1e9"}).err.find("1e-06 to 1e+06"),
            std::string::npos);
}

TEST_F(Travel, AReplayUsesTheRecordingOfItsKindAndRefusesTheOther) {
  const std::string set = folder_ / "z.fil", recording = folder_ / "run.rec";
  ASSERT_EQ(runFiliform({"navigate", set, "--seconds", "0.5", "--record", recording}).exit_code, 0);
  for (const char* option : {"--zoom", "--method", "--stiffness"}) {
    const Outcome refused = runFiliform(
        {"view", set, "--device", "replay:" + recording, option, std::string(option) == "--method" ? "climb" : "200"});
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    EXPECT_NE(refused.err.find(std::string(option) + ": leave it out"), std::string::npos) << refused.err;
  }
}

TEST_F(Travel, ADeviceThatKeepsItsOwnTimeNeedsRealTime) {
  const Outcome refused = runFiliform({"navigate", folder_ / "z.fil", "--device", "falcon"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("--realtime"), std::string::npos) << refused.err;
  EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
}

TEST_F(Travel, AKindOfLatencyNeedsRealTimeAndALatency) {
  const std::vector<std::vector<std::string>> wrongs{{"--latency", "5"}, {"--realtime"}, {}};
  for (const std::vector<std::string>& given : wrongs) {
    std::vector<std::string> words{"navigate", folder_ / "z.fil", "--seconds", "0.1", "--latency-kind", "exponential"};
    words.insert(words.end(), given.begin(), given.end());
    const Outcome refused = runFiliform(words);
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("give --realtime and --latency"), std::string::npos) << refused.err;
    EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
  }
  const Outcome negative = runFiliform({"navigate", folder_ / "z.fil", "--latency", "-1"});
  EXPECT_EQ(negative.exit_code, 2);
  EXPECT_NE(negative.err.find("--latency -1: give 0 or more"), std::string::npos) << negative.err;
  const Outcome slow = runFiliform({"navigate", folder_ / "z.fil", "--seconds", "0.1", "--realtime", "--latency", "1",
                                    "--latency-kind", "exponential"});
  EXPECT_NE(slow.exit_code, 2) << slow.err;
}

TEST_F(Travel, TheControllerIsOnWhereTheStiffnessIsOutsideTheBound) {
  const auto travels = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"navigate", folder_ / "z.fil", "--seconds", "0.5", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = runFiliform(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out);
  };
  EXPECT_EQ(travels({}).at("passivity"), false);
  EXPECT_EQ(travels({"--stiffness", "5000"}).at("passivity"), true);
  EXPECT_EQ(travels({"--stiffness", "5000", "--passivity", "off"}).at("passivity"), false);
  EXPECT_EQ(travels({"--passivity", "on"}).at("passivity"), true);
  EXPECT_LE(travels({}).at("least_energy_J"), 0.0);
  const Outcome refused = runFiliform({"navigate", folder_ / "z.fil", "--passivity", "maybe"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
}

TEST_F(Travel, InfoStatesEveryAutomaticParameter) {
  const Outcome outcome = runFiliform({"info", folder_ / "z.fil", "--parameters", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out).at("parameters");
  EXPECT_EQ(json.at("cell"), "zigzag");
  EXPECT_EQ(json.at("stiffness_N_m"), 200);
  EXPECT_NEAR(json.at("force_r_min_um").get<double>(), std::sqrt(29.0), 0.01);
  EXPECT_GT(json.at("force_r_max_um"), json.at("force_r_min_um"));
  EXPECT_GT(json.at("confusion_zoom_um"), 0);
  const Outcome text = runFiliform({"info", folder_ / "z.fil", "--parameters", "--cell", "zigzag"});
  ASSERT_EQ(text.exit_code, 0) << text.err;
  for (const auto& [name, value] : json.items()) {
    if (name != "cell") {
      EXPECT_NE(text.out.find(name), std::string::npos) << name;
    }
  }
  EXPECT_EQ(runFiliform({"info", folder_ / "z.fil", "--parameters", "--cell", "none"}).exit_code, 2);
}

}  // namespace
}  // namespace filiform
