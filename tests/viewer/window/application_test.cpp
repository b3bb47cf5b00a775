// The window in the test's process. Disk, device and file writer can be made to wait: frames go on, and quitting works.
// No clock: frames are counted while something waits.
#include "viewer/window/application.h"

#include "device/factory/device_factory.h"
#include "device/simulated/null_device.h"
#include "index/file/faulty_source.h"
#include "index/ingest/ingest.h"
#include "index/set/tile_set.h"
#include "tests/support/campaign.h"
#include "tests/support/display.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"
#include "viewer/window/panels/panels.h"
#include "viewer/window/window.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <imgui.h>
#include <mutex>
#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using Json = nlohmann::json;

constexpr int kPatience_ms = 60'000;

// While it is shut, a thread that passes must wait.
class Gate {
 public:
  void shut() {
    const std::lock_guard lock(mutex_);
    shut_ = true;
  }
  void open() {
    const std::lock_guard lock(mutex_);
    shut_ = false;
    changed_.notify_all();
  }
  void pass() {
    std::unique_lock lock(mutex_);
    if (!shut_) return;
    ++waiting_;
    changed_.wait(lock, [this] { return !shut_; });
    --waiting_;
  }
  int waiting() const { return waiting_; }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool shut_ = false;
  std::atomic<int> waiting_{0};
};

class SlowDevice final : public NullDevice {
 public:
  explicit SlowDevice(Gate& gate) : gate_(gate) {}
  void open() override {
    gate_.pass();
    NullDevice::open();
  }

 private:
  Gate& gate_;
};

class Applications : public ::testing::Test {
 protected:
  void SetUp() override {
    if (test::kSanitized && !test::wholeCampaign())
      GTEST_SKIP() << "a window that draws under a sanitizer: set FILIFORM_CAMPAIGN";
    if (!test::VirtualDisplay::isInstalled()) GTEST_SKIP() << "no Xvfb or no xdotool: run tools/setup";
    ASSERT_FALSE(test::VirtualDisplay::name().empty()) << "Xvfb did not start";
    ::setenv("DISPLAY", test::VirtualDisplay::name().c_str(), 1);
    ::setenv("XDG_CONFIG_HOME", (folder_ / "config").c_str(), 1);
    CellList cells(test::randomColumn(7, 6, 1000, 200));
    IngestOptions ingesting;
    ingesting.capacity = 128;
    ingesting.levels = true;
    ingest(cells, folder_ / "a.fil", ingesting);

    options_.paths = {folder_ / "a.fil"};
    options_.open = [this](const std::vector<std::string>& paths) {
      OpenedScene scene;
      FaultPlan plan{.delay = FaultPlan::Delay::constant, .delay_s = 1e-9, .wait = [this](double) { disk_.pass(); }};
      auto source = std::make_unique<FaultySource>(openFolder(paths.front()), std::move(plan));
      FaultySource& faults = *source;
      scene.hold(TileSet::open(std::move(source)));
      faults.arm();
      scene.name = "a";
      return scene;
    };
    options_.write = [this](const Picture&, const std::string&) {
      writer_.pass();
      ++written_;
    };
    options_.poll = [this] {
      ++frames_;
      if (given_up_) throw std::runtime_error("the test gives up");
    };
    // The program would end by force some seconds later (tools/program/ending_watch.h): let everything continue.
    options_.ending = [this] {
      ending_ = true;
      openAll();
    };
    options_.size = {300, 200};
    options_.segments = 3000;
    options_.reset = true;
    options_.state = folder_ / "state";
  }

  // Runs the window, while `user` acts on another thread.
  void run(const std::function<void()>& user) {
    std::thread other([&] {
      user();
      // The window must end in any case.
      if (!waitFor([this] { return ending_.load(); })) ADD_FAILURE() << "the window does not quit";
      openAll();
      given_up_ = true;
    });
    runApplication(options_);
    other.join();
  }
  void quit() { EXPECT_TRUE(test::VirtualDisplay::send("key q")); }
  bool waitFor(const std::function<bool()>& done) const {
    for (int i = 0; i < kPatience_ms / 5 && !ending_; ++i) {
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return done();
  }
  testing::AssertionResult waitForState(const std::function<bool(const Json&)>& done) const {
    Json state;
    const bool came = waitFor([&] {
      std::ifstream in(options_.state);
      state = Json::parse(in, nullptr, false);
      try {
        return state.is_object() && done(state);
      } catch (const Json::exception&) {  // not there yet
        return false;
      }
    });
    return came ? testing::AssertionSuccess() : testing::AssertionFailure() << state.dump();
  }
  testing::AssertionResult isOpen() const {
    return waitForState([](const Json& s) { return s.at("open") == true && !s.at("cell").get<std::string>().empty(); });
  }
  bool framesGoOn() const {
    return waitFor([this, then = frames_.load()] { return frames_ > then + 10; });
  }
  void openAll() {
    for (Gate* gate : {&disk_, &device_, &writer_}) gate->open();
  }

  test::TempFolder folder_;
  Gate disk_, device_, writer_;
  std::atomic<int> frames_{0}, written_{0};
  std::atomic<bool> ending_{false}, given_up_{false};
  ApplicationOptions options_;
};

TEST_F(Applications, FramesGoOnAndQuitWorksWhileTheDiskIsSilent) {
  run([this] {
    EXPECT_TRUE(isOpen());
    disk_.shut();
    // A picture needs finer tiles than the window.
    EXPECT_TRUE(test::VirtualDisplay::send("key o"));
    EXPECT_TRUE(test::VirtualDisplay::send("key P"));
    EXPECT_TRUE(waitFor([this] { return disk_.waiting() > 0; }));
    EXPECT_TRUE(framesGoOn());
    EXPECT_TRUE(test::VirtualDisplay::send("key backslash"));  // counts the tiles
    EXPECT_TRUE(waitForState([](const Json& s) { return s.at("tiles_panel") == true; }));
    EXPECT_TRUE(framesGoOn());
    EXPECT_GT(disk_.waiting(), 0);
    quit();
    quit();  // the picture is lost
  });
}

TEST_F(Applications, FramesGoOnAndQuitWorksWhileADeviceOpensSlowly) {
  options_.session.device = "slow";
  options_.session.make_device = [this](const std::string& name, double period_s) -> std::unique_ptr<HapticDevice> {
    if (name != "slow") return makeDevice(name, {.period_s = period_s});
    return std::make_unique<SlowDevice>(device_);
  };
  device_.shut();
  run([this] {
    EXPECT_TRUE(waitFor([this] { return device_.waiting() > 0; }));
    EXPECT_TRUE(framesGoOn());
    EXPECT_GT(device_.waiting(), 0);
    quit();
  });
}

TEST_F(Applications, FramesGoOnAndQuitWorksWhileAPictureIsWritten) {
  writer_.shut();
  run([this] {
    EXPECT_TRUE(isOpen());
    EXPECT_TRUE(test::VirtualDisplay::send("key P"));
    EXPECT_TRUE(waitFor([this] { return writer_.waiting() > 0; }));
    EXPECT_TRUE(framesGoOn());
    EXPECT_GT(writer_.waiting(), 0);
    quit();
  });
  EXPECT_EQ(written_, 1);
}

TEST_F(Applications, AtRestNothingIsPresentedUntilAKeyIsPressed) {
  const int rest_s = test::wholeCampaign() ? 10 : 2;
  const auto counted = [this](const char* what) {
    std::ifstream in(options_.state);
    return Json::parse(in, nullptr, false).value(what, std::uint64_t{0});
  };
  run([&] {
    EXPECT_TRUE(isOpen());
    EXPECT_TRUE(waitForState([](const Json& s) { return s.at("complete") == true && s.at("moving") == false; }));
    // The messages of the start go, and the state is written ten times a second.
    EXPECT_TRUE(waitFor([&, last = std::uint64_t{0}, since = std::chrono::steady_clock::now()]() mutable {
      const std::uint64_t presented = counted("presented");
      const auto now = std::chrono::steady_clock::now();
      if (std::exchange(last, presented) != presented) since = now;
      return now - since > std::chrono::seconds(1);
    }));
    const std::uint64_t presented = counted("presented"), pictures = counted("pictures_drawn"), frames = frames_;
    std::this_thread::sleep_for(std::chrono::seconds(rest_s));
    EXPECT_EQ(counted("presented"), presented);
    EXPECT_EQ(counted("pictures_drawn"), pictures);
    EXPECT_GT(frames_, static_cast<int>(frames));
    EXPECT_TRUE(test::VirtualDisplay::send("key h"));
    EXPECT_TRUE(waitFor([&] { return counted("presented") > presented; }));
    EXPECT_EQ(counted("pictures_drawn"), pictures);  // a panel alone
    quit();
  });
}

// All keys come in one frame: each belongs to what was open when it was pressed.
TEST_F(Applications, KeysOfOneSlowFrameGoWhereTheyBelong) {
  Gate frame;
  options_.observe = [&](const OpenedScene&, const NavigationSnapshot&) {
    frame.pass();
    return std::vector<std::string>();
  };
  // GLFW takes two presses of one key in a millisecond for one.
  const auto inOneFrame = [&](const std::string& keys) {
    frame.shut();
    EXPECT_TRUE(waitFor([&] { return frame.waiting() > 0; }));
    EXPECT_TRUE(test::VirtualDisplay::send("key --delay 3 " + keys));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    frame.open();
  };
  run([&] {
    EXPECT_TRUE(isOpen());
    inOneFrame("slash q x BackSpace m 9 Return");
    EXPECT_TRUE(waitForState([](const Json& s) { return !s.at("search_error").get<std::string>().empty(); }));
    EXPECT_TRUE(waitForState([](const Json& s) { return s.at("search") == true && s.at("search_text") == "qm9"; }));
    // The field has the keyboard again. Esc closes it, and the keys after it act.
    inOneFrame("q Escape h m slash h Left q");
    EXPECT_TRUE(waitForState(
        [](const Json& s) { return s.at("search") == true && s.at("search_text") == "qh" && s.at("help") == true; }));
    inOneFrame("Escape Escape x x x");
    EXPECT_TRUE(waitForState([](const Json& s) { return s.at("help") == false && s.at("search") == false; }));
    // The measurement would be lost.
    quit();
    EXPECT_TRUE(waitForState([](const Json& s) { return s.at("last_action") == "quit"; }));
    EXPECT_FALSE(ending_);
    quit();
  });
}

// When the window moves to a screen of another scale, letters are built again at once.
TEST_F(Applications, LettersFollowTheScale) {
  Window window("letters", {300, 200});
  const auto heightOfLetters = [&] {
    window.beginPanels();
    const float height = ImGui::GetFontSize();
    ImGui::GetForegroundDrawList()->AddText({10, 10}, IM_COL32_WHITE, "M");
    EXPECT_TRUE(window.endPanels());
    window.drawPanels();
    return height;
  };
  const auto lit = [&] {
    const Picture picture = window.read();
    return std::count_if(picture.rgb.begin(), picture.rgb.end(), [](std::uint8_t c) { return c > 200; });
  };
  const double scale = window.scale();
  const float height = heightOfLetters();
  const auto small = lit();
  EXPECT_GT(small, 20);
  window.setInterfaceScale(2);
  EXPECT_EQ(window.scale(), 2 * scale);
  EXPECT_NEAR(heightOfLetters(), 2 * height, 1);
  EXPECT_GT(lit(), 2 * small);  // drawn over the small one
  window.setInterfaceScale(0);
  EXPECT_EQ(window.scale(), 2 * scale);
}

// What a finer picture adds fades in: see Renderer::present().
TEST_F(Applications, APictureIsMixedWithTheOneBefore) {
  Window window("pictures", {300, 200});
  Renderer renderer(window.context());
  const auto draw = [&](std::uint8_t grey, const PictureSize& size) {
    renderer.draw({EyeView{}, EyeView{}}, {.size = size, .samples = 1, .background = {grey, grey, grey, 255}});
  };
  const auto shown = [&](double part) {
    renderer.present(window.size(), part);
    return static_cast<int>(window.read().rgb.at(0));
  };
  draw(0, window.size());
  EXPECT_EQ(shown(0.5), 0) << "no picture before";
  draw(200, window.size());
  for (const double part : {0.0, 0.25, 0.5, 1.0}) EXPECT_NEAR(shown(part), 200 * part, 1);
  draw(100, {150, 100});
  EXPECT_EQ(shown(0.5), 100) << "of another size";
}

struct Lit {
  int count = 0, left = 1 << 20, top = 1 << 20, right = 0, bottom = 0;
};

Lit litOf(const Picture& picture) {
  Lit lit;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      if (picture.rgb[3 * static_cast<std::size_t>(y * picture.width + x)] < 60) continue;
      ++lit.count;
      lit.left = std::min(lit.left, x), lit.right = std::max(lit.right, x);
      lit.top = std::min(lit.top, y), lit.bottom = std::max(lit.bottom, y);
    }
  return lit;
}

// Panels look the same on a screen whose points are two pixels and on one of that resolution whose points are pixels.
TEST_F(Applications, PanelsAreLaidOutInPoints) {
  Window window("points", {900, 600});
  Renderer renderer(window.context());
  window.setInterfaceScale(2);
  const auto shown = [&](double pixels_per_point) {
    window.setPixelsPerPoint(pixels_per_point);
    PanelData data;
    data.size = window.points();
    data.scale = window.scale() / window.pixelsPerPoint();
    data.um_px = 0.5 * pixels_per_point;
    data.status.scene = "a scene";
    data.lines.hint = "a hint";
    data.map.lo_W = Vector3d::Zero();
    data.map.hi_W = Vector3d(300, 300, 300);
    data.map.zoom_um = 100;
    OpenPanels open;
    open.help = true;
    SearchPanel search;
    Settings settings;
    renderer.draw({EyeView{}, EyeView{}}, {.size = window.size(), .samples = 1});
    for (int i = 0; i < 4; ++i) {  // Dear ImGui knows the size of a panel after one or two frames
      window.beginPanels();
      drawPanels(data, {}, open, search, settings);
      window.endPanels();
    }
    renderer.present(window.size());
    window.drawPanels();
    return window.read();
  };
  const Lit pixels = litOf(shown(1)), points = litOf(shown(2));
  EXPECT_GT(pixels.count, 20'000);
  EXPECT_NEAR(points.count, pixels.count, 0.05 * pixels.count);
  for (const auto side : {&Lit::left, &Lit::top, &Lit::right, &Lit::bottom}) EXPECT_NEAR(points.*side, pixels.*side, 6);
}

}  // namespace
}  // namespace filiform
