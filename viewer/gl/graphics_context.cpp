#include "viewer/gl/graphics_context.h"

#include <algorithm>
#include <cstddef>
#include <epoxy/gl.h>
#include <utility>

namespace filiform {

namespace {

// Of this thread's context: the driver calls back on the thread that made the call.
thread_local std::string first_debug_message;

#ifdef GL_DEBUG_OUTPUT
void onDebugMessage(GLenum, GLenum type, GLuint, GLenum, GLsizei length, const GLchar* text, const void*) {
  if (type != GL_DEBUG_TYPE_ERROR || !first_debug_message.empty() || text == nullptr) return;
  first_debug_message = length >= 0 ? std::string(text, static_cast<std::size_t>(length)) : std::string(text);
  std::replace(first_debug_message.begin(), first_debug_message.end(), '\n', ' ');
}
#endif

const char* nameOf(GLenum error) {
  switch (error) {
    case GL_INVALID_ENUM:
      return "GL_INVALID_ENUM";
    case GL_INVALID_VALUE:
      return "GL_INVALID_VALUE";
    case GL_INVALID_OPERATION:
      return "GL_INVALID_OPERATION";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
      return "GL_INVALID_FRAMEBUFFER_OPERATION";
    case GL_OUT_OF_MEMORY:
      return "GL_OUT_OF_MEMORY";
    default:
      return "an unknown error";
  }
}

}  // namespace

void watchGraphicsErrors() {
#ifdef GL_DEBUG_OUTPUT
  if (epoxy_gl_version() >= 43 || epoxy_has_gl_extension("GL_KHR_debug")) {
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(onDebugMessage, nullptr);
  }
#endif
  takeGraphicsErrors();
}

GraphicsErrors takeGraphicsErrors() {
  constexpr int kMost = 16;  // a lost context may report errors without end
  GraphicsErrors errors{std::exchange(first_debug_message, {})};
  for (int i = 0; i < kMost; ++i) {
    const GLenum error = glGetError();
    if (error == GL_NO_ERROR) break;
    if (errors.text.empty()) errors.text = nameOf(error);
    errors.out_of_memory |= error == GL_OUT_OF_MEMORY;
  }
  return errors;
}

std::string describeCurrentContext() {
  const auto text = [](GLenum name) {
    const GLubyte* words = glGetString(name);
    return words != nullptr ? std::string(reinterpret_cast<const char*>(words)) : std::string("unknown");
  };
  return text(GL_RENDERER) + ", OpenGL " + text(GL_VERSION);
}

bool isSoftwareRenderer(const std::string& description) {
  for (const char* name : {"llvmpipe", "softpipe", "swrast", "SwiftShader", "Software"})
    if (description.find(name) != std::string::npos) return true;
  return false;
}

}  // namespace filiform
