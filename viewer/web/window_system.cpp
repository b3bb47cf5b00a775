// What emscripten's GLFW and OpenGL lack, see include/GLFW/glfw3.h and include/epoxy/gl.h.
#include <GLFW/glfw3.h>
#include <array>
#include <emscripten.h>
#include <emscripten/html5.h>
#include <epoxy/gl.h>

namespace filiform::web {

namespace {

EM_JS(void, lastKey, (char* to, int room), { stringToUTF8((Module.lastKey || "").toLowerCase(), to, room); });
EM_JS(int, isFullscreen, (), { return document.fullscreenElement ? 1 : 0; });
EM_JS(void, setFullscreen, (int on), {
  const done = on ? Module.canvas.requestFullscreen() : document.exitFullscreen();
  if (done) done.catch(function(failure) { console.warn("full screen: " + failure); });
});

EM_JS(void, copyText, (const char* text), {
  const done = navigator.clipboard && navigator.clipboard.writeText(UTF8ToString(text));
  if (done) done.catch(function(failure) { console.warn("copy: " + failure); });
});

EM_JS(void, rendererName, (char* to, int room), {
  const shown = Module.ctx.getExtension("WEBGL_debug_renderer_info");
  stringToUTF8(Module.ctx.getParameter(shown ? shown.UNMASKED_RENDERER_WEBGL : Module.ctx.RENDERER) || "", to, room);
});

// GLFW's types are opaque; a page has one screen.
GLFWmonitor* screen() {
  static char place = 0;
  return reinterpret_cast<GLFWmonitor*>(&place);
}

}  // namespace

void contentScale(GLFWwindow*, float* across, float* down) {
  *across = *down = static_cast<float>(emscripten_get_device_pixel_ratio());
}

const char* keyName(int, int) {
  static char name[16];
  lastKey(name, sizeof name);
  return name[0] != 0 ? name : nullptr;
}

GLFWmonitor* windowMonitor(GLFWwindow*) { return isFullscreen() != 0 ? screen() : nullptr; }
void setWindowMonitor(GLFWwindow*, GLFWmonitor* monitor, int, int, int, int, int) {
  setFullscreen(monitor != nullptr ? 1 : 0);
}
GLFWmonitor* primaryMonitor() { return screen(); }
const GLFWvidmode* videoMode(GLFWmonitor*) {
  static const GLFWvidmode kMode{};
  return &kMode;
}
void setContentScaleCallback(GLFWwindow*, void (*)(GLFWwindow*, float, float)) {}
void (*scrolled)(GLFWwindow*, double, double) = nullptr;
void setScrollCallback(GLFWwindow*, void (*called)(GLFWwindow*, double, double)) { scrolled = called; }
void scroll(double notches) {
  if (GLFWwindow* const window = glfwGetCurrentContext(); window != nullptr && scrolled != nullptr)
    scrolled(window, 0, notches);
}
void setClipboardString(GLFWwindow*, const char* text) { copyText(text); }
void waitEventsTimeout(double) { glfwPollEvents(); }

#undef glGetString
const GLubyte* getString(GLenum name) {
  static std::array<char, 256> renderer{};
  if (name != GL_RENDERER) return glGetString(name);
  rendererName(renderer.data(), static_cast<int>(renderer.size()));
  return reinterpret_cast<const GLubyte*>(renderer.data());
}

}  // namespace filiform::web
