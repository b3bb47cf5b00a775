#include "viewer/window/window.h"

#include "viewer/window/internal/letters.h"
#include "viewer/window/internal/system_fonts.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <string_view>
#include <utility>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#if __has_include(<backends/imgui_impl_glfw.h>)
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#else  // beside imgui.h, as vcpkg and Conan install them
#include <imgui_impl_glfw.h>
#include <imgui_impl_opengl3.h>
#endif
#include <imgui.h>

namespace filiform {

namespace {

std::string& lastError() {
  static std::string text;
  return text;
}

void onError(int, const char* text) {
  lastError() = text;
  std::replace(lastError().begin(), lastError().end(), '\n', ' ');
}

std::uint8_t modifiersOf(int glfw) {
  std::uint8_t modifiers = 0;
  if ((glfw & GLFW_MOD_SHIFT) != 0) modifiers |= Key::kShift;
  if ((glfw & GLFW_MOD_CONTROL) != 0) modifiers |= Key::kControl;
  if ((glfw & GLFW_MOD_ALT) != 0) modifiers |= Key::kAlt;
  return modifiers;
}

std::uint32_t specialOf(int key) {
  switch (key) {
    case GLFW_KEY_ESCAPE:
      return Key::kEscape;
    case GLFW_KEY_ENTER:
    case GLFW_KEY_KP_ENTER:
      return Key::kEnter;
    case GLFW_KEY_TAB:
      return Key::kTab;
    case GLFW_KEY_BACKSPACE:
      return Key::kBackspace;
    case GLFW_KEY_LEFT:
      return Key::kLeft;
    case GLFW_KEY_RIGHT:
      return Key::kRight;
    case GLFW_KEY_UP:
      return Key::kUp;
    case GLFW_KEY_DOWN:
      return Key::kDown;
    case GLFW_KEY_PAGE_UP:
      return Key::kPageUp;
    case GLFW_KEY_PAGE_DOWN:
      return Key::kPageDown;
    case GLFW_KEY_HOME:
      return Key::kHome;
    case GLFW_KEY_F1:
      return Key::kF1;
    case GLFW_KEY_F11:
      return Key::kF11;
    default:
      return Key::kNone;
  }
}

std::uint64_t hashOf(const ImDrawData& data) {
  std::uint64_t hash = 0;
  const auto add = [&hash](const void* bytes, std::size_t count) {
    constexpr std::uint64_t kOdd = 0x9E3779B97F4A7C15U;  // mixes the bits, so that the order of the parts counts
    hash = (hash ^ (hash >> 29)) * kOdd + std::hash<std::string_view>{}({static_cast<const char*>(bytes), count});
  };
  add(&data.DisplaySize, sizeof data.DisplaySize);
  add(&data.FramebufferScale, sizeof data.FramebufferScale);
  for (int i = 0; i < data.CmdListsCount; ++i) {
    const ImDrawList& list = *data.CmdLists[i];
    add(list.VtxBuffer.Data, static_cast<std::size_t>(list.VtxBuffer.size_in_bytes()));
    add(list.IdxBuffer.Data, static_cast<std::size_t>(list.IdxBuffer.size_in_bytes()));
    for (const ImDrawCmd& command : list.CmdBuffer) {
      add(&command.ClipRect, sizeof command.ClipRect);
      add(&command.ElemCount, sizeof command.ElemCount);
    }
  }
  return hash;
}

class WindowContext final : public GraphicsContext {
 public:
  explicit WindowContext(GLFWwindow* window) : window_(window) {}
  void makeCurrent() override { glfwMakeContextCurrent(window_); }
  std::string description() const override { return describeCurrentContext(); }

 private:
  GLFWwindow* window_;
};

}  // namespace

// Dear ImGui takes a press and a release in two frames, and acts in the next.
constexpr int kClickFrames = 4;

struct Window::Impl {
  GLFWwindow* window = nullptr;
  std::unique_ptr<WindowContext> context;
  std::vector<InputEvent> events;
  double x = 0, y = 0;  // of the last move event
  double interface_scale = 1, content_scale = 1;
  double set_pixels_per_point = 0;  // 0: as GLFW says
  Theme theme = Theme::dark;
  double built_scale = 0, built_pixels_per_point = 0;  // of the current letters and sizes; 0: none yet
  internal::Letters letters{internal::findFonts(internal::fontFolders())};
  std::uint64_t shown_panels = 0;  // hash of the panels that the window shows
  bool stale = true;               // the window's pixels are lost, or of other letters
  std::uint8_t modifiers = 0;
  std::uint8_t click_modifiers = 0;  // of the last event of a button
  int click_frames = 0;              // in which the panels still take it
  bool repeated = false;             // the key event to which the next character belongs
  int windowed_x = 0, windowed_y = 0, windowed_width = 0, windowed_height = 0;

  static Impl& of(GLFWwindow* window) { return *static_cast<Impl*>(glfwGetWindowUserPointer(window)); }

  InputEvent& add(InputEvent::Kind kind) {
    InputEvent event;
    event.kind = kind;
    event.x = x;
    event.y = y;
    event.modifiers = modifiers;
    event.time_s = glfwGetTime();
    return events.emplace_back(std::move(event));
  }

  static void onKey(GLFWwindow* window, int key, int scancode, int action, int mods) {
    Impl& w = of(window);
    w.modifiers = modifiersOf(mods);
    w.repeated = action == GLFW_REPEAT;
    Key pressed{specialOf(key), w.modifiers};
    // onCharacter() reports characters, except with Ctrl or Alt, which type none.
    const char* name = nullptr;
    if (pressed.code == Key::kNone && (w.modifiers & (Key::kControl | Key::kAlt)) != 0)
      name = glfwGetKeyName(key, scancode);
    if (name != nullptr && name[0] != 0 && name[1] == 0) pressed.code = static_cast<unsigned char>(name[0]);
    InputEvent& event = w.add(action == GLFW_RELEASE ? InputEvent::Kind::key_up : InputEvent::Kind::key);
    event.key = pressed;
    event.repeated = w.repeated;
    event.stroke = {key, scancode, action, mods, 0};
  }
  static void onCharacter(GLFWwindow* window, unsigned codepoint) {
    Impl& w = of(window);
    InputEvent& event = w.add(InputEvent::Kind::key);
    event.key = {codepoint, 0};
    event.repeated = w.repeated;
    event.stroke.character = codepoint;
  }
  static void onButton(GLFWwindow* window, int button, int action, int mods) {
    ImGui_ImplGlfw_MouseButtonCallback(window, button, action, mods);
    Impl& w = of(window);
    w.modifiers = w.click_modifiers = modifiersOf(mods);
    w.click_frames = kClickFrames;
    if (button > 2 || (action == GLFW_PRESS && ImGui::GetIO().WantCaptureMouse)) return;
    w.add(action == GLFW_PRESS ? InputEvent::Kind::button : InputEvent::Kind::button_up).button = button;
  }
  static void onMove(GLFWwindow* window, double x, double y) {
    Impl& w = of(window);
    int width = 1, height = 1, across = 1, down = 1;
    glfwGetWindowSize(window, &width, &height);
    glfwGetFramebufferSize(window, &across, &down);
    w.x = x * across / std::max(width, 1);
    w.y = y * down / std::max(height, 1);
    w.add(InputEvent::Kind::move);
  }
  static void onScroll(GLFWwindow* window, double dx, double dy) {
    ImGui_ImplGlfw_ScrollCallback(window, dx, dy);
    if (ImGui::GetIO().WantCaptureMouse) return;
    of(window).add(InputEvent::Kind::scroll).y = dy;
  }
  // The window has moved to another screen, or the screen has a new scale.
  static void onContentScale(GLFWwindow* window, float across, float) {
    if (across > 0) of(window).content_scale = across;
  }
  static void onRefresh(GLFWwindow* window) { of(window).stale = true; }
  static void onDrop(GLFWwindow* window, int count, const char** paths) {
    of(window).add(InputEvent::Kind::drop).paths.assign(paths, paths + count);
  }
};

Window::Window(const std::string& title, const PictureSize& size, double interface_scale)
    : impl_(std::make_unique<Impl>()) {
  Impl& w = *impl_;
  glfwSetErrorCallback(onError);
  if (glfwInit() == GLFW_FALSE) {
    std::string what = "no window: ";
    const char* display = std::getenv("DISPLAY");
    what += display == nullptr || *display == 0 ? "there is no display (DISPLAY is not set)" : lastError();
    what +=
        "; draw a picture without a display with `filiform render SCENE -o picture.png`, or run `xvfb-run -a filiform "
        "view SCENE`";
    throw GraphicsError(what);
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  // Ask for quad-buffer stereo first; few drivers have it. Then ask for a plain window.
  for (const int stereo : {GLFW_TRUE, GLFW_FALSE}) {
    glfwWindowHint(GLFW_STEREO, stereo);
    w.window = glfwCreateWindow(std::max(size.width, 1), std::max(size.height, 1), title.c_str(), nullptr, nullptr);
    if (w.window != nullptr) break;
  }
  if (w.window == nullptr) {
    std::string what = "no window: the display has no OpenGL 3.3 (";
    what += lastError();
    what +=
        "); use Mesa's software renderer (LIBGL_ALWAYS_SOFTWARE=1 filiform view SCENE), or draw a picture with "
        "`filiform render SCENE -o picture.png`";
    glfwTerminate();
    throw GraphicsError(what);
  }
  glfwMakeContextCurrent(w.window);
  watchGraphicsErrors();
  glfwSwapInterval(1);
  w.context = std::make_unique<WindowContext>(w.window);
  float across = 1, down = 1;
  glfwGetWindowContentScale(w.window, &across, &down);
  w.content_scale = across > 0 ? across : 1;
  w.interface_scale = interface_scale > 0 ? interface_scale : 1;

  glfwSetWindowUserPointer(w.window, &w);
  glfwSetKeyCallback(w.window, Impl::onKey);
  glfwSetCharCallback(w.window, Impl::onCharacter);
  glfwSetMouseButtonCallback(w.window, Impl::onButton);
  glfwSetCursorPosCallback(w.window, Impl::onMove);
  glfwSetScrollCallback(w.window, Impl::onScroll);
  glfwSetDropCallback(w.window, Impl::onDrop);
  glfwSetWindowContentScaleCallback(w.window, Impl::onContentScale);
  glfwSetWindowRefreshCallback(w.window, Impl::onRefresh);

  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // Settings keeps the settings
  io.KeyRepeatDelay = 1e9F;  // the keyboard's own repeats come as events
  ImGui_ImplGlfw_InitForOpenGL(w.window, false);
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

Window::~Window() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(impl_->window);
  glfwTerminate();
}

GraphicsContext& Window::context() { return *impl_->context; }
bool Window::isOpen() const { return glfwWindowShouldClose(impl_->window) == GLFW_FALSE; }
double Window::scale() const { return impl_->interface_scale * impl_->content_scale; }
void Window::want(const std::string& utf8) { impl_->letters.want(utf8); }

void Window::setInterfaceScale(double scale) {
  if (scale > 0 && !ImGui::IsAnyMouseDown()) impl_->interface_scale = scale;
}

void Window::setTheme(Theme theme) {
  if (std::exchange(impl_->theme, theme) != theme) impl_->built_scale = -1;
}
double Window::now_s() const { return glfwGetTime(); }

PictureSize Window::size() const {
  PictureSize size;
  glfwGetFramebufferSize(impl_->window, &size.width, &size.height);
  return {std::max(size.width, 1), std::max(size.height, 1)};
}

double Window::pixelsPerPoint() const {
  if (impl_->set_pixels_per_point > 0) return impl_->set_pixels_per_point;
  int width = 0, height = 0;
  glfwGetWindowSize(impl_->window, &width, &height);
  return width > 0 ? static_cast<double>(size().width) / width : 1;
}

PictureSize Window::points() const {
  const PictureSize pixels = size();
  const double points = 1 / pixelsPerPoint();
  return {static_cast<int>(std::lround(pixels.width * points)), static_cast<int>(std::lround(pixels.height * points))};
}

void Window::setPixelsPerPoint(double pixels) { impl_->set_pixels_per_point = pixels; }

std::vector<InputEvent> Window::poll(double wait_s) {
  if (wait_s > 0)
    glfwWaitEventsTimeout(wait_s);
  else
    glfwPollEvents();
  return std::exchange(impl_->events, {});
}

bool Window::pointerOnPanel() const { return ImGui::GetIO().WantCaptureMouse; }

bool Window::isTyping() const { return ImGui::GetIO().WantTextInput; }

void Window::type(const InputEvent& event) {
  const InputEvent::Stroke& stroke = event.stroke;
  if (stroke.character != 0) return ImGui_ImplGlfw_CharCallback(impl_->window, stroke.character);
  ImGui_ImplGlfw_KeyCallback(impl_->window, stroke.key, stroke.scancode, stroke.action, stroke.modifiers);
  // Also a repeat, and a press whose release came in the same frame, is a new press.
  ImGuiIO& io = ImGui::GetIO();
  if (stroke.action != GLFW_RELEASE && stroke.key >= 0 && stroke.key < IM_ARRAYSIZE(io.KeysDownDuration))
    io.KeysDownDuration[stroke.key] = -1;
}

void Window::beginPanels() {
  Impl& w = *impl_;
  ImGuiIO& io = ImGui::GetIO();
  const double pixels = pixelsPerPoint();
  if (w.letters.isStale() || w.built_scale != scale() || w.built_pixels_per_point != pixels) {
    ImGuiStyle style;
    if (w.theme == Theme::light)
      ImGui::StyleColorsLight(&style);
    else
      ImGui::StyleColorsDark(&style);
    style.ScaleAllSizes(static_cast<float>(scale() / pixels));
    ImGui::GetStyle() = style;
    w.letters.build(scale());
    io.FontGlobalScale = static_cast<float>(1 / pixels);
    if (w.built_scale != 0) {
      ImGui_ImplOpenGL3_DestroyFontsTexture();
      ImGui_ImplOpenGL3_CreateFontsTexture();
    }
    w.built_scale = scale();
    w.built_pixels_per_point = pixels;
    w.stale = true;
  }
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  const PictureSize room = points();
  io.DisplaySize = {static_cast<float>(room.width), static_cast<float>(room.height)};
  io.DisplayFramebufferScale = {static_cast<float>(pixels), static_cast<float>(pixels)};
  // Panels get keys only while a field has the keyboard: a click has its modifiers with it.
  if (w.click_frames > 0) {
    const std::uint8_t held = --w.click_frames > 0 ? w.click_modifiers : 0;
    io.KeyCtrl = (held & Key::kControl) != 0;
    io.KeyShift = (held & Key::kShift) != 0;
  }
  ImGui::NewFrame();
}

bool Window::endPanels() {
  ImGui::Render();
  const std::uint64_t now = hashOf(*ImGui::GetDrawData());
  return std::exchange(impl_->shown_panels, now) != now || std::exchange(impl_->stale, false);
}

void Window::dropPanels() { ImGui::EndFrame(); }
void Window::drawPanels() { ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData()); }

Picture Window::read() const { return Renderer::readWindow(size()); }

void Window::show() { glfwSwapBuffers(impl_->window); }
void Window::hide() {
  glfwHideWindow(impl_->window);
  glfwPollEvents();
}
void Window::copy(const std::string& text) { glfwSetClipboardString(impl_->window, text.c_str()); }
void Window::setTitle(const std::string& title) { glfwSetWindowTitle(impl_->window, title.c_str()); }

void Window::toggleFullscreen() {
  Impl& w = *impl_;
  if (glfwGetWindowMonitor(w.window) != nullptr) {
    glfwSetWindowMonitor(w.window, nullptr, w.windowed_x, w.windowed_y, w.windowed_width, w.windowed_height,
                         GLFW_DONT_CARE);
    return;
  }
  GLFWmonitor* monitor = glfwGetPrimaryMonitor();
  if (monitor == nullptr) return;
  const GLFWvidmode* mode = glfwGetVideoMode(monitor);
  glfwGetWindowPos(w.window, &w.windowed_x, &w.windowed_y);
  glfwGetWindowSize(w.window, &w.windowed_width, &w.windowed_height);
  glfwSetWindowMonitor(w.window, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
}

}  // namespace filiform
