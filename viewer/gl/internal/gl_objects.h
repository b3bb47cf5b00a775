// OpenGL's programs and framebuffers as objects. Thread rule: the thread of the context.
#pragma once

#include "viewer/gl/graphics_context.h"
#include "viewer/scene/camera.h"

#include <algorithm>
#include <array>
#include <epoxy/gl.h>
#include <string>
#include <utility>

namespace filiform::internal {

class Program {
 public:
  Program(const char* vertex, const char* fragment) : id_(glCreateProgram()) {
    for (const auto& [kind, text] : {std::pair{GL_VERTEX_SHADER, vertex}, std::pair{GL_FRAGMENT_SHADER, fragment}}) {
      const GLuint shader = glCreateShader(static_cast<GLenum>(kind));
      glShaderSource(shader, 1, &text, nullptr);
      glCompileShader(shader);
      GLint good = 0;
      glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
      if (good == 0) {
        std::array<char, 400> log{};
        glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
        refuse(log.data());
      }
      glAttachShader(id_, shader);
      glDeleteShader(shader);
    }
    glLinkProgram(id_);
    GLint good = 0;
    glGetProgramiv(id_, GL_LINK_STATUS, &good);
    if (good == 0) {
      std::array<char, 400> log{};
      glGetProgramInfoLog(id_, static_cast<GLsizei>(log.size()), nullptr, log.data());
      refuse(log.data());
    }
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program() { glDeleteProgram(id_); }

  void use() const { glUseProgram(id_); }
  GLint at(const char* name) const { return glGetUniformLocation(id_, name); }
  void set(const char* name, double x) const { glUniform1f(at(name), static_cast<float>(x)); }
  void set(const char* name, int x) const { glUniform1i(at(name), x); }
  void set(const char* name, const PictureSize& s) const { glUniform2i(at(name), s.width, s.height); }
  void set(const char* name, double x, double y) const {
    glUniform2f(at(name), static_cast<float>(x), static_cast<float>(y));
  }
  void set(const char* name, const Vector3d& v) const {
    const Eigen::Vector3f f = v.cast<float>();
    glUniform3fv(at(name), 1, f.data());
  }
  void set(const char* name, const Eigen::Vector4d& v) const {
    const Eigen::Vector4f f = v.cast<float>();
    glUniform4fv(at(name), 1, f.data());
  }
  void set(const char* name, const Eigen::Matrix3d& m) const {
    const Eigen::Matrix3f f = m.cast<float>();
    glUniformMatrix3fv(at(name), 1, GL_FALSE, f.data());
  }

 private:
  [[noreturn]] void refuse(std::string log) {
    glDeleteProgram(id_);
    std::replace(log.begin(), log.end(), '\n', ' ');
    throw GraphicsError("the graphics driver refuses a shader: " + log +
                        "; update the driver, or use Mesa's software renderer");
  }
  GLuint id_;
};

inline void requireRoom(const char* what) {
  if (glGetError() != GL_OUT_OF_MEMORY) return;
  throw GraphicsError(std::string("the graphics card has no memory left for ") + what +
                      "; ask for fewer segments or a smaller picture");
}

// A framebuffer whose colours and depths shaders can read.
class Target {
 public:
  Target() = default;
  Target(const Target&) = delete;
  Target& operator=(const Target&) = delete;
  ~Target() { clear(); }

  void resize(const PictureSize& size, bool with_depth) {
    if (frame_ != 0 && size.width == size_.width && size.height == size_.height) return;
    clear();
    size_ = size;
    glGenFramebuffers(1, &frame_);
    glBindFramebuffer(GL_FRAMEBUFFER, frame_);
    glGenTextures(1, &colour_);
    glBindTexture(GL_TEXTURE_2D, colour_);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, size.width, size.height, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour_, 0);
    if (with_depth) {
      glGenTextures(1, &depth_);
      glBindTexture(GL_TEXTURE_2D, depth_);
      glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, size.width, size.height, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
                   nullptr);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
      glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_, 0);
    }
    requireRoom("the picture");
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw GraphicsError("the graphics driver refuses a picture of " + std::to_string(size.width) + " x " +
                          std::to_string(size.height) + " samples; ask for a smaller one");
  }
  void bind() const {
    glBindFramebuffer(GL_FRAMEBUFFER, frame_);
    glViewport(0, 0, size_.width, size_.height);
  }
  void bindForReading() const { glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_); }
  GLuint colour() const { return colour_; }
  GLuint depth() const { return depth_; }
  const PictureSize& size() const { return size_; }

 private:
  void clear() {
    glDeleteFramebuffers(1, &frame_);
    glDeleteTextures(1, &colour_);
    glDeleteTextures(1, &depth_);
    frame_ = colour_ = depth_ = 0;
  }
  PictureSize size_{0, 0};
  GLuint frame_ = 0, colour_ = 0, depth_ = 0;
};

}  // namespace filiform::internal
