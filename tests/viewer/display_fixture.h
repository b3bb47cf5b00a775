// filiform view in a window of a virtual display, driven by xdotool. Skipped without Xvfb or xdotool.
#pragma once

#include "tests/support/campaign.h"
#include "tests/support/display.h"
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform::test {

namespace fs = std::filesystem;
using Json = nlohmann::json;

inline constexpr int kStep_ms = 150;    // a frame must lie between two events
inline constexpr int kPatience_s = 90;  // enough for a busy machine without a graphics card

inline void refused(const Outcome& outcome, int code, const std::string& says) {
  EXPECT_EQ(outcome.exit_code, code) << outcome.err;
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  EXPECT_NE(outcome.err.find(says), std::string::npos) << outcome.err;
}

class Display : public ::testing::Test {
 protected:
  static bool wanted() { return test::wholeCampaign() || !test::kSanitized; }
  // Not in SetUpTestSuite(), because skipped tests do not need it.
  static void prepare() {
    if (folder_ != nullptr) return;
    folder_ = new test::TempFolder;
    runFiliform({"synth", *folder_ / "c.zip", "--cells", "4", "--seed", "3"});
    runFiliform({"ingest", *folder_ / "c.zip", "-o", *folder_ / "c.fil"});
    test::writeBytes(*folder_ / "y.swc",
                     "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 5 0 1 3\n5 3 40 10 0 1 4\n"
                     "6 3 30 -5 0 1 3\n7 3 40 -10 0 1 6\n");
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }
  void SetUp() override {
    if (!wanted()) GTEST_SKIP() << "a window that draws under a sanitizer: set FILIFORM_CAMPAIGN";
    if (!test::VirtualDisplay::isInstalled()) GTEST_SKIP() << "no Xvfb or no xdotool: run tools/setup";
    ASSERT_FALSE(test::VirtualDisplay::name().empty()) << "Xvfb did not start";
    prepare();
    pictures_ = (test::filiformProgram().parent_path() / "view-test").string();
    fs::create_directories(pictures_);
    fs::remove_all(*folder_ / "config");
    // Not the first start, which shows the scene from afar.
    fs::create_directories(*folder_ / "config/filiform");
    test::writeBytes(settings(), "{}");
  }
  void TearDown() override {
    if (viewer_ <= 0) return;
    kill(viewer_, SIGKILL);
    waitpid(viewer_, nullptr, 0);
  }

  static std::string settings() { return *folder_ / "config/filiform/view.json"; }
  std::string environment() const {
    return "DISPLAY=" + test::VirtualDisplay::name() + " XDG_CONFIG_HOME='" + (*folder_ / "config") + "' ";
  }
  void view(const std::string& arguments) {
    fs::remove(*folder_ / "state");
    viewer_ = test::startInShell(environment() + "exec '" + test::filiformProgram().string() + "' view " + arguments +
                                 " --state '" + (*folder_ / "state") + "' --pictures '" + pictures_ + "' 2>'" +
                                 (*folder_ / "err") + "'");
    ASSERT_GT(viewer_, 0);
  }
  Json state() const {
    std::ifstream in(*folder_ / "state");
    Json parsed = Json::parse(in, nullptr, false);
    return parsed.is_object() ? parsed : Json::object();
  }
  // Waits until the state fulfils `done`.
  void await(const std::string& what, const std::function<bool(const Json&)>& done) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(kPatience_s);
    Json last;
    while (std::chrono::steady_clock::now() < until) {
      last = state();
      try {
        if (done(last)) return;
      } catch (const Json::exception&) {  // not there yet
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    FAIL() << "not within " << kPatience_s << " s: " << what << "\n"
           << last.dump(1) << test::readBytes(*folder_ / "err");
  }
  void send(const std::string& xdotool) { ASSERT_TRUE(test::VirtualDisplay::send(xdotool)) << xdotool; }
  void type(const std::string& xdotool) {
    send(xdotool);
    std::this_thread::sleep_for(std::chrono::milliseconds(kStep_ms));
  }
  // Sends a key, and waits until its action is done.
  void act(const std::string& key) {
    const Json before = state();
    send("key " + key);
    await(key, [&](const Json& s) { return s.at("actions") > before.at("actions"); });
  }
  // Sends an event, and waits for two more frames: the first may have begun before the event.
  void sendAndDraw(const std::string& xdotool) {
    send(xdotool);
    for (int i = 0; i < 2; ++i) {
      const auto frames = state().at("frames").get<std::uint64_t>();
      await("a frame", [&](const Json& s) { return s.at("frames") > frames; });
    }
  }
  // Waits for the end of the program, and returns its exit code.
  int ended() {
    for (int i = 0; i < 10 * kPatience_s; ++i) {
      int status = 0;
      if (waitpid(viewer_, &status, WNOHANG) == viewer_) {
        viewer_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return -1;
  }

  static inline test::TempFolder* folder_ = nullptr;
  std::string pictures_;
  pid_t viewer_ = -1;
};

}  // namespace filiform::test
