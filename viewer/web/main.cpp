// The program of the page: the window of `filiform view`, for one set at an address.
//
//   main SET PLACE ZOOM_UM BUDGET_MIB SEGMENTS WIDTH HEIGHT     each may be empty, except SET and the size
#include "device/usb/usb_transport.h"
#include "index/errors.h"
#include "index/set/tile_set.h"
#include "index/text.h"
#include "viewer/web/clock.h"
#include "viewer/window/application.h"

#include <GLFW/glfw3.h>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <emscripten.h>
#include <exception>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace filiform;

constexpr std::uint64_t kBudget_MiB = 96;

constexpr int kMostFramesBefore = 10;  // then the window is made, even if the thread that opens the set has not begun

ApplicationOptions options;
std::future<OpenedScene> opening;  // begun before the window
std::atomic<bool> has_begun_opening{false};
int frames_before = 0;  // without a window
std::unique_ptr<Application> application;
std::string revision;  // of the set; written before `opening` is ready

EM_JS(void, tellFailure, (const char* text), { Module.failed(UTF8ToString(text)); });

OpenedScene openSet(const std::string& address) {
  OpenedScene scene;
  scene.name = escaped(address.substr(address.rfind('/') + 1), 60);
  RemoteOptions remote;
  remote.directory_block_bytes = 64 << 10;  // lines to browsers are slower than those between machines of a cluster
  scene.hold(TileSet::open(address, remote));
  revision = scene.revision;
  return scene;
}

// Runs on another thread; the page's thread makes the download.
void download(const Picture& picture, const std::string& path) {
  std::vector<std::uint8_t> rgba;
  rgba.reserve(picture.rgb.size() / 3 * 4);
  for (std::size_t i = 0; i + 2 < picture.rgb.size(); i += 3)
    rgba.insert(rgba.end(), {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2], 255});
  const std::string name = path.substr(path.rfind('/') + 1);
  MAIN_THREAD_EM_ASM(
      {
        const bytes = new Uint8ClampedArray($1 * $2 * 4);
        bytes.set(HEAPU8.subarray($0, $0 + bytes.length));
        Module.download($1, $2, UTF8ToString($3), bytes);
      },
      rgba.data(), picture.width, picture.height, name.c_str());
}

// A thread of this program begins only while the page's thread rests. So the thread that opens the set begins first,
// and reads while the window is made.
bool makeWindow() {
  if (!has_begun_opening && ++frames_before < kMostFramesBefore) return true;
  try {
    application = std::make_unique<Application>(options);
    return true;
  } catch (const std::exception& error) {
    tellFailure(error.what());
    return false;
  }
}

void step() {
  try {
    if (application ? application->step() : makeWindow()) return;
  } catch (const std::exception& error) {
    tellFailure((std::string(error.what()) + ". Load the page again.").c_str());
  }
  emscripten_cancel_main_loop();
}

}  // namespace

extern "C" {

EMSCRIPTEN_KEEPALIVE void filiform_resize(int width, int height) {
  options.size = PictureSize{width, height};
  if (GLFWwindow* const window = glfwGetCurrentContext(); window != nullptr) glfwSetWindowSize(window, width, height);
}

// Writes what the page is to keep to files.
EMSCRIPTEN_KEEPALIVE void filiform_keep() {
  if (application) application->keep();
}

EMSCRIPTEN_KEEPALIVE void filiform_say(const char* text) {
  if (application) application->say(text);
}

// The revision of the set, once it is open.
EMSCRIPTEN_KEEPALIVE const char* filiform_revision() { return revision.c_str(); }

// The place of a desk: proxy, hand and centre (um), turn (w, x, y, z), zoom (um), force (N), in this order; no numbers:
// it is gone.
EMSCRIPTEN_KEEPALIVE void filiform_desk(const char* name, const double* numbers, int count, int constrained,
                                        int along) {
  if (!application) return;
  if (count != 15) return application->accompany(std::nullopt);
  const auto point = [&](int i) { return filiform::Vector3d(numbers[i], numbers[i + 1], numbers[i + 2]); };
  Companion companion;
  companion.name = escaped(name, 32);
  companion.p_W = point(0);
  companion.h_W = point(3);
  companion.centre_W = point(6);
  companion.rotation_WD = Eigen::Quaterniond(numbers[9], numbers[10], numbers[11], numbers[12]);
  companion.zoom_um = numbers[13];
  companion.force_N = numbers[14];
  companion.constrained = constrained != 0;
  companion.along = along != 0;
  application->accompany(companion);
}

EMSCRIPTEN_KEEPALIVE void filiform_scroll(double notches) { filiform::web::scroll(notches); }

EMSCRIPTEN_KEEPALIVE void filiform_hide(int hidden) { filiform::web::setHidden(hidden != 0); }
}

int main(int count, char** words) {
  const auto word = [&](int i) { return std::string(i < count ? words[i] : ""); };
  options.paths = {word(1)};
  options.place = word(2);
  if (const double zoom_um = std::atof(word(3).c_str());
      zoom_um >= Workspace::kMinZoom_um && zoom_um <= Workspace::kMaxZoom_um)
    options.session.zoom_um = zoom_um;
  const std::uint64_t budget_MiB = std::strtoull(word(4).c_str(), nullptr, 10);
  options.session.budget_bytes = (budget_MiB > 0 ? budget_MiB : kBudget_MiB) << 20;
  options.segments = std::strtoull(word(5).c_str(), nullptr, 10);
  options.size = PictureSize{std::atoi(word(6).c_str()), std::atoi(word(7).c_str())};
  options.state = "/state.json";
  options.open = [](const std::vector<std::string>&) {
    if (!opening.valid()) throw UsageError("a page shows one set; open the link of another set");
    return opening.get();
  };
  options.write = download;
  options.plugged_in = [](const std::string&) { return !systemUsb().devices().empty(); };
  options.awaited_device = "spacemouse";
  try {
    opening = std::async(std::launch::async, [address = options.paths.front()] {
      has_begun_opening = true;
      return openSet(address);
    });
  } catch (const std::exception& error) {  // no thread
    tellFailure(error.what());
    return 3;
  }
  emscripten_set_main_loop(step, 0, 0);
  return 0;
}
