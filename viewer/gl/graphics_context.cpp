#include "viewer/gl/graphics_context.h"

#include <epoxy/gl.h>

namespace filiform {

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
