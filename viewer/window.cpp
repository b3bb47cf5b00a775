#include "viewer/window.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
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

class WindowContext final : public GraphicsContext {
 public:
  explicit WindowContext(GLFWwindow* window) : window_(window) {}
  void makeCurrent() override { glfwMakeContextCurrent(window_); }
  std::string description() const override {
    const auto text = [](unsigned name) {
      using GetString = const unsigned char* (*)(unsigned);
      const auto get = reinterpret_cast<GetString>(glfwGetProcAddress("glGetString"));
      const unsigned char* words = get != nullptr ? get(name) : nullptr;
      return words != nullptr ? std::string(reinterpret_cast<const char*>(words)) : std::string("unknown");
    };
    constexpr unsigned kRenderer = 0x1F01, kVersion = 0x1F02;  // GL_RENDERER, GL_VERSION
    return text(kRenderer) + ", OpenGL " + text(kVersion);
  }

 private:
  GLFWwindow* window_;
};

}  // namespace

struct Window::Impl {
  GLFWwindow* window = nullptr;
  std::unique_ptr<WindowContext> context;
  std::vector<InputEvent> events;
  double x = 0, y = 0;  // as the last move told
  double letters = 1, content_scale = 1;
  std::uint8_t modifiers = 0;
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
    ImGui_ImplGlfw_KeyCallback(window, key, scancode, action, mods);
    Impl& w = of(window);
    w.modifiers = modifiersOf(mods);
    Key pressed{specialOf(key), w.modifiers};
    // Characters come by onCharacter, except with Ctrl or Alt, where none is typed.
    if (pressed.code == Key::kNone) {
      if ((w.modifiers & (Key::kControl | Key::kAlt)) == 0) return;
      const char* name = glfwGetKeyName(key, scancode);
      if (name == nullptr || name[0] == 0 || name[1] != 0) return;
      pressed.code = static_cast<unsigned char>(name[0]);
    }
    if (action == GLFW_RELEASE) {
      w.add(InputEvent::Kind::key_up).key = pressed;
      return;
    }
    const bool typing = ImGui::GetIO().WantTextInput;
    if (typing && pressed.code != Key::kEscape) return;
    if (action == GLFW_REPEAT && pressed.code != Key::kBackspace) return;
    w.add(InputEvent::Kind::key).key = pressed;
  }
  static void onCharacter(GLFWwindow* window, unsigned codepoint) {
    ImGui_ImplGlfw_CharCallback(window, codepoint);
    Impl& w = of(window);
    if (ImGui::GetIO().WantTextInput) return;
    w.add(InputEvent::Kind::key).key = {codepoint, 0};
  }
  static void onButton(GLFWwindow* window, int button, int action, int mods) {
    ImGui_ImplGlfw_MouseButtonCallback(window, button, action, mods);
    Impl& w = of(window);
    w.modifiers = modifiersOf(mods);
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
        "; draw pictures without one by `filiform render SCENE -o picture.png`, or start `xvfb-run -a filiform view "
        "SCENE`";
    throw GraphicsError(what);
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
  // With a picture for each eye where the driver has that: few have, and then a plain one.
  for (const int stereo : {GLFW_TRUE, GLFW_FALSE}) {
    glfwWindowHint(GLFW_STEREO, stereo);
    w.window = glfwCreateWindow(std::max(size.width, 1), std::max(size.height, 1), title.c_str(), nullptr, nullptr);
    if (w.window != nullptr) break;
  }
  if (w.window == nullptr) {
    std::string what = "no window: the display gives no OpenGL 3.3 (";
    what += lastError();
    what +=
        "); use Mesa's software renderer (LIBGL_ALWAYS_SOFTWARE=1 filiform view SCENE), or draw pictures by "
        "`filiform render SCENE -o picture.png`";
    glfwTerminate();
    throw GraphicsError(what);
  }
  glfwMakeContextCurrent(w.window);
  glfwSwapInterval(1);
  w.context = std::make_unique<WindowContext>(w.window);
  float across = 1, down = 1;
  glfwGetWindowContentScale(w.window, &across, &down);
  w.content_scale = across > 0 ? across : 1;
  w.letters = w.content_scale * (interface_scale > 0 ? interface_scale : 1);

  glfwSetWindowUserPointer(w.window, &w);
  glfwSetKeyCallback(w.window, Impl::onKey);
  glfwSetCharCallback(w.window, Impl::onCharacter);
  glfwSetMouseButtonCallback(w.window, Impl::onButton);
  glfwSetCursorPosCallback(w.window, Impl::onMove);
  glfwSetScrollCallback(w.window, Impl::onScroll);
  glfwSetDropCallback(w.window, Impl::onDrop);

  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // settings are ours
  ImFontConfig font;
  font.SizePixels = static_cast<float>(std::round(13 * w.letters));
  io.Fonts->AddFontDefault(&font);
  ImGui::StyleColorsDark();
  ImGui::GetStyle().ScaleAllSizes(static_cast<float>(w.letters));
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
double Window::scale() const { return impl_->letters; }
double Window::now_s() const { return glfwGetTime(); }

PictureSize Window::size() const {
  PictureSize size;
  glfwGetFramebufferSize(impl_->window, &size.width, &size.height);
  return {std::max(size.width, 1), std::max(size.height, 1)};
}

std::vector<InputEvent> Window::poll(double wait_s) {
  if (wait_s > 0)
    glfwWaitEventsTimeout(wait_s);
  else
    glfwPollEvents();
  return std::exchange(impl_->events, {});
}

bool Window::pointerOnPanel() const { return ImGui::GetIO().WantCaptureMouse; }

void Window::beginPanels() {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
}

void Window::endPanels() {
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

Picture Window::read() const {
  using ReadPixels = void (*)(int, int, int, int, unsigned, unsigned, void*);
  using PixelStore = void (*)(unsigned, int);
  const auto pixel_store = reinterpret_cast<PixelStore>(glfwGetProcAddress("glPixelStorei"));
  const auto read_pixels = reinterpret_cast<ReadPixels>(glfwGetProcAddress("glReadPixels"));
  constexpr unsigned kPackAlignment = 0x0D05, kRgb = 0x1907, kUnsignedByte = 0x1401;
  const PictureSize pixels = size();
  const auto row = static_cast<std::size_t>(pixels.width) * 3, rows = static_cast<std::size_t>(pixels.height);
  std::vector<std::uint8_t> upside_down(row * rows);
  pixel_store(kPackAlignment, 1);
  read_pixels(0, 0, pixels.width, pixels.height, kRgb, kUnsignedByte, upside_down.data());
  Picture picture{pixels.width, pixels.height, std::vector<std::uint8_t>(row * rows)};
  for (std::size_t y = 0; y < rows; ++y)
    std::copy_n(upside_down.begin() + static_cast<std::ptrdiff_t>((rows - 1 - y) * row), row,
                picture.rgb.begin() + static_cast<std::ptrdiff_t>(y * row));
  return picture;
}

void Window::show() { glfwSwapBuffers(impl_->window); }
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
