// A window with an OpenGL 3.3 core context, its input events, and Dear ImGui for the panels.
//
//   Window window("filiform", {1280, 800});
//   while (window.isOpen()) {
//     for (const InputEvent& event : window.poll(0)) handle(event);
//     renderer.draw(views, options);
//     window.beginPanels();
//     window.endPanels();
//     renderer.present(window.size());
//     window.drawPanels();
//     window.show();
//   }
//
// Thread rule: the main thread.
#pragma once

#include "viewer/gl/graphics_context.h"
#include "viewer/gl/renderer.h"
#include "viewer/scene/camera.h"
#include "viewer/window/settings/bindings.h"
#include "viewer/window/settings/settings.h"

#include <memory>
#include <string>
#include <vector>

namespace filiform {

struct InputEvent {
  enum class Kind : std::uint8_t { key, key_up, button, button_up, move, scroll, drop };
  Kind kind = Kind::key;
  Key key{};                   // key, key_up
  bool repeated = false;       // key: it is held, and the keyboard repeats it
  int button = 0;              // 0 left, 1 right, 2 middle
  std::uint8_t modifiers = 0;  // of Key
  double x = 0, y = 0;         // pixels of the picture, from the top left; scroll: y in notches
  double time_s = 0;
  std::vector<std::string> paths{};  // drop
  // key, key_up: as the panels' text fields need it, see Window::type(). A key that types a character gives two events:
  // one with Key::kNone, then one with the character.
  struct Stroke {
    int key = -1, scancode = 0, action = 0, modifiers = 0;  // of GLFW
    std::uint32_t character = 0;
  } stroke{};
};

class Window {
 public:
  // Throws GraphicsError, which says what to do, if there is no display or no OpenGL 3.3. Only one window at a time.
  Window(const std::string& title, const PictureSize& size, double interface_scale = 0);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  GraphicsContext& context();
  bool isOpen() const;       // the user has not closed it
  PictureSize size() const;  // of the picture, pixels; at least 1 x 1
  double scale() const;      // of letters and panels, pixels: the screen's scale times the user's
  // Panels are laid out in points: a point is a pixel with X11, and two on most HiDPI screens with Wayland or macOS.
  double pixelsPerPoint() const;
  PictureSize points() const;  // of the window
  // For tests: as on a screen whose points are this many pixels.
  void setPixelsPerPoint(double pixels);
  // Sets the user's scale. It takes effect with the next panels, when no mouse button is held.
  void setInterfaceScale(double scale);
  void setTheme(Theme theme);  // of the next panels
  // Makes the letters of a text available; call it before the panels show the text.
  void want(const std::string& utf8);
  double now_s() const;

  // Returns the events since the last call, in their order, except clicks and notches of the wheel on a panel. Waits up
  // to `wait_s` for an event.
  std::vector<InputEvent> poll(double wait_s);
  bool pointerOnPanel() const;

  // A text field has the keyboard, as of the last panels but one.
  bool isTyping() const;
  // Gives a key event to the next panels.
  void type(const InputEvent& event);

  void beginPanels();
  void dropPanels();  // instead of endPanels(): they take input, and are not drawn
  // True: the panels differ from the last ones, or the window has lost its pixels. Else the window may stay as it is.
  bool endPanels();
  void drawPanels();     // over the presented picture
  Picture read() const;  // the window's pixels; call it before show()
  void show();
  void hide();  // at the end, so that the user does not wait for the last work
  void setTitle(const std::string& title);
  void copy(const std::string& text);  // to the clipboard
  void toggleFullscreen();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform
