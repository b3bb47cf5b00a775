// A server, a disk or a device that goes in the middle of `navigate`: what is left behind, and what is said.
#include "tests/support/devices/bridge_process.h"
#include "tests/support/process.h"
#include "tests/support/servers/server_process.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <future>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::readBytes;
using test::runFiliform;

class TravelFaults : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(runFiliform({"synth", folder_ / "t.zip", "--cells", "40", "--seed", "2"}).exit_code, 0);
    ASSERT_EQ(runFiliform({"ingest", folder_ / "t.zip", "-o", set_}).exit_code, 0);
    for (const char* name : {"t.csv", "t.rec"}) test::writeBytes(folder_ / name, "old");
  }

  // `navigate` with the outputs t.csv, t.rec and JSON.
  std::vector<std::string> travel(const std::string& set, const std::vector<std::string>& more) const {
    std::vector<std::string> words{"navigate",        set,     "--csv", folder_ / "t.csv", "--record",
                                   folder_ / "t.rec", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  // A whole CSV and a whole recording of the same ticks beside the older files, the cause in one line and in the JSON.
  void expectKept(const Outcome& outcome, const std::string& cause) const {
    EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
    std::size_t causes = 0;
    for (std::size_t at = 0; (at = outcome.err.find(cause, at)) != std::string::npos; ++at) ++causes;
    EXPECT_EQ(causes, 1U) << outcome.err;
    ASSERT_TRUE(nlohmann::json::accept(outcome.out)) << outcome.out << outcome.err;
    const auto json = nlohmann::json::parse(outcome.out);
    EXPECT_NE(json.at("error").get<std::string>().find(cause), std::string::npos) << json.at("error");
    for (const char* name : {"t.csv", "t.rec"}) EXPECT_EQ(readBytes(folder_ / name), "old") << name;
    const std::string csv = readBytes(folder_ / "t.unfinished.csv");
    EXPECT_TRUE(csv.starts_with("tick,time_s,") && csv.ends_with('\n'));
    const auto rows = std::count(csv.begin(), csv.end(), '\n');
    EXPECT_GT(rows, 100);
    const Outcome replayed = runFiliform({"navigate", set_, "--device", "replay:" + (folder_ / "t.unfinished.rec"),
                                          "--csv", folder_ / "again.csv", "--json"});
    EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
    const std::string again = readBytes(folder_ / "again.csv");
    // From a tick that met many absent tiles on, a replay may differ (run.h).
    const std::size_t both = std::min({csv.size(), again.size(), std::size_t{100'000}});
    EXPECT_GT(both, 10'000U);
    EXPECT_EQ(csv.substr(0, both), again.substr(0, both));
    for (const auto& entry : fs::directory_iterator(folder_.path()))
      EXPECT_EQ(entry.path().filename().string().find(".partial-"), std::string::npos) << entry.path();
  }

  // Waits until the travel has written some rows.
  void waitForRows() const {
    constexpr std::uintmax_t kSome = 50'000;  // bytes
    for (int i = 0; i < 600; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      for (const auto& entry : fs::directory_iterator(folder_.path())) {
        std::error_code gone;
        const bool partial = entry.path().filename().string().starts_with("t.partial-");
        if (partial && entry.path().extension() == ".csv" && entry.file_size(gone) >= kSome && !gone) return;
      }
    }
    FAIL() << "no rows after a minute";
  }

  test::TempFolder folder_;
  const std::string set_ = folder_ / "t.fil";
};

// The order of the time limits differs: of a read that is refused at once, and of one that is never answered.
TEST_F(TravelFaults, AServerThatDiesLeavesTheTravelSoFar) {
  for (const int signal : {SIGKILL, SIGSTOP}) {
    test::ServerProcess server({set_, "--no-pictures"}, folder_ / "log");
    std::future<Outcome> travelling = std::async(std::launch::async, [&] {
      return runFiliform(travel(server.address() + "/v1/sets/t", {"--route", "tour:1", "--seconds", "120", "--realtime",
                                                                  "--speed", "0.5", "--budget", "2MiB"}));
    });
    waitForRows();
    server.signal(signal);
    expectKept(travelling.get(), server.address());
    if (signal == SIGSTOP) server.signal(SIGKILL);
    for (const char* name : {"t.unfinished.csv", "t.unfinished.rec"}) fs::remove(folder_ / name);
  }
}

TEST_F(TravelFaults, AFullDiskLeavesTheTravelSoFar) {
  for (const bool realtime : {false, true}) {
    std::vector<std::string> more{"--route", "tour:1", "--seconds", "30"};
    if (realtime) more.emplace_back("--realtime");
    expectKept(test::runFiliformInShell("trap '' XFSZ; ulimit -f 400; exec \"$@\"", travel(set_, more)),
               "cannot write");
    for (const char* name : {"t.unfinished.csv", "t.unfinished.rec"}) fs::remove(folder_ / name);
  }
}

TEST_F(TravelFaults, ADeviceThatGoesLeavesTheTravelSoFar) {
  test::BridgeProcess bridge(folder_ / "b");
  std::future<Outcome> travelling = std::async(std::launch::async, [&] {
    return runFiliform(travel(set_, {"--device", "bridge:" + (folder_ / "b"), "--realtime", "--seconds", "120"}));
  });
  waitForRows();
  bridge.signal(SIGKILL);
  expectKept(travelling.get(), "the device was lost");
}

}  // namespace
}  // namespace filiform
