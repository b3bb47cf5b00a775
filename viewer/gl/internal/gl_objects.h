// OpenGL's programs and framebuffers as objects. Thread rule: the thread of the context.
#pragma once

#include "viewer/gl/graphics_context.h"
#include "viewer/scene/camera.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <epoxy/gl.h>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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
  // These require use(). A value that the program has already is not sent again.
  void set(const char* name, double x) { send(name, std::array{static_cast<float>(x)}, glUniform1fv); }
  void set(const char* name, int x) { send(name, std::array{x}, glUniform1iv); }
  void set(const char* name, const PictureSize& s) { send(name, std::array{s.width, s.height}, glUniform2iv); }
  void set(const char* name, double x, double y) {
    send(name, std::array{static_cast<float>(x), static_cast<float>(y)}, glUniform2fv);
  }
  void set(const char* name, const Vector3d& v) { send(name, floats<3>(v), glUniform3fv); }
  void set(const char* name, const Eigen::Vector4d& v) { send(name, floats<4>(v), glUniform4fv); }
  void set(const char* name, const Eigen::Matrix3d& m) {
    send(name, floats<9>(m),
         [](GLint at, GLsizei count, const GLfloat* values) { glUniformMatrix3fv(at, count, GL_FALSE, values); });
  }

 private:
  struct Uniform {
    GLint at = -1;
    std::vector<unsigned char> sent;  // the bytes of the last value
  };

  template <std::size_t kCount, class Matrix>
  static std::array<float, kCount> floats(const Matrix& matrix) {
    std::array<float, kCount> values;
    for (std::size_t i = 0; i < kCount; ++i) values[i] = static_cast<float>(matrix.data()[i]);
    return values;
  }
  template <class Values, class Send>
  void send(const char* name, const Values& values, const Send& to) {
    auto found = uniforms_.find(std::string_view(name));
    if (found == uniforms_.end()) found = uniforms_.emplace(name, Uniform{glGetUniformLocation(id_, name), {}}).first;
    Uniform& uniform = found->second;
    const auto* const bytes = reinterpret_cast<const unsigned char*>(values.data());
    constexpr std::size_t kBytes = sizeof(Values);
    if (uniform.sent.size() == kBytes && std::equal(bytes, bytes + kBytes, uniform.sent.begin())) return;
    uniform.sent.assign(bytes, bytes + kBytes);
    to(uniform.at, 1, values.data());
  }
  [[noreturn]] void refuse(std::string log) {
    glDeleteProgram(id_);
    std::replace(log.begin(), log.end(), '\n', ' ');
    throw GraphicsError("the graphics driver refuses a shader: " + log +
                        "; update the driver, or use Mesa's software renderer");
  }
  GLuint id_;
  std::map<std::string, Uniform, std::less<>> uniforms_;
};

// Throws GraphicsError if OpenGL has reported an error. A round trip.
inline void requireNoError(const std::string& what) {
  const GraphicsErrors errors = takeGraphicsErrors();
  if (errors.out_of_memory)
    throw GraphicsError("the graphics card has no memory left for " + what +
                        "; ask for fewer segments or a smaller picture");
  if (!errors.text.empty())
    throw GraphicsError("the graphics driver reports an error in " + what + ": " + errors.text +
                        "; update the driver, or use Mesa's software renderer");
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
    requireNoError("the picture");
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
