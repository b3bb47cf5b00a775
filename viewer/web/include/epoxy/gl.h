// OpenGL of a browser, WebGL 2, with what the renderer also names: no browser has quad-buffer stereo.
#pragma once

#include <GLES3/gl3.h>
#include <webgl/webgl2.h>  // glGetBufferSubData

#define GL_STEREO 0x0C33
#define GL_BACK_LEFT 0x0402
#define GL_BACK_RIGHT 0x0403

inline void glDrawBuffer(GLenum) {}

namespace filiform::web {

inline void getBoolean(GLenum name, GLboolean* value) {
  *value = GL_FALSE;
  if (name != GL_STEREO) glGetBooleanv(name, value);
}

// The renderer's own name, which browsers hide from GL_RENDERER.
const GLubyte* getString(GLenum name);

}  // namespace filiform::web

#define glGetBooleanv filiform::web::getBoolean
#define glGetString filiform::web::getString
