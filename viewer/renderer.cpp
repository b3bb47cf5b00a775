#include "viewer/renderer.h"

#include "viewer/internal/shaders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <epoxy/gl.h>
#include <map>
#include <span>
#include <string>

namespace filiform {

namespace {

// In pixels of the samples: thinner segments are drawn as lines, a pixel wide; then, up to the second, as ribbons:
// lines two samples wide, where the driver has them. A cone costs five times as much.
constexpr double kLineRadius_px = 0.6, kRibbonRadius_px = 1.25;
constexpr float kRibbon = 2;
// A thread is never drawn thinner: it would break into dots.
constexpr double kLeastRadius_px = 0.55;
// A dark rim sets marks off from the threads behind them.
constexpr double kMarkHalo_px = 2.5;
// Of a highlighted cell's threads, in pixels.
constexpr double kHighlightRadius_px = 1.1;

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
                        "; update it, or use Mesa's software renderer");
  }
  GLuint id_;
};

void requireRoom(const char* what) {
  if (glGetError() != GL_OUT_OF_MEMORY) return;
  throw GraphicsError(std::string("the graphics card has no room for ") + what +
                      "; ask for fewer segments or a smaller picture");
}

// A picture that can be drawn into and read from shaders.
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

// A batch on the card.
struct Uploaded {
  Vector3d origin_W, lo_W, hi_W;
  Layer layer;
  std::vector<float> radii_um;  // of the segments, falling
  GLuint vertices, buffer;
  bool shown = true;
};

// So that the first segment drawn is that one. (glDrawArraysInstancedBaseInstance came after OpenGL 3.3.)
void bindFrom(const Uploaded& batch, std::size_t first) {
  glBindVertexArray(batch.vertices);
  glBindBuffer(GL_ARRAY_BUFFER, batch.buffer);
  const auto attribute = [first](GLuint place, GLenum type, GLboolean normalised, std::size_t offset) {
    glVertexAttribPointer(place, 4, type, normalised, sizeof(DrawnSegment),
                          reinterpret_cast<const void*>(first * sizeof(DrawnSegment) + offset));
  };
  attribute(0, GL_FLOAT, GL_FALSE, offsetof(DrawnSegment, a_um));
  attribute(1, GL_FLOAT, GL_FALSE, offsetof(DrawnSegment, b_um));
  attribute(2, GL_UNSIGNED_BYTE, GL_TRUE, offsetof(DrawnSegment, colour));
}

bool isSeen(const Uploaded& batch, const LevelView& view) {
  return std::all_of(view.planes.begin(), view.planes.end(), [&](const LevelView::Plane& plane) {
    return plane.n.dot((plane.n.array() >= 0).select(batch.hi_W, batch.lo_W).matrix()) >= plane.d;
  });
}

Vector3d colourVector(Rgba c) { return Vector3d(c.r, c.g, c.b) / 255; }

}  // namespace

struct Renderer::Impl {
  Program cone{internal::kConeVertexShader, internal::kConeFragmentShader};
  Program line{internal::kLineVertexShader, internal::kLineFragmentShader};
  std::map<std::array<int, 3>, Program> compose;  // by mode, samples, whether it is shaded: made when first needed
  std::map<BatchId, Uploaded> batches;
  std::array<Target, 2> eyes;
  Target whole, whole_right;  // of quad-buffer stereo one for each eye
  bool quad_buffer = false;   // as it was drawn last
  GLuint nothing = 0;         // vertex array of the composing pass, which has no vertices to read
  std::uint64_t bytes = 0;
  float widest_line = 1;

  void remove(BatchId id);
  const Program& composing(StereoMode mode, int samples, bool shaded);
  void prepare(const Program& program, const EyeView& view, const PictureSize& size, const RenderOptions& options,
               int samples) const;
  RenderFigures drawEye(const EyeView& view, const PictureSize& size, const RenderOptions& options, int samples) const;
};

Renderer::Renderer(GraphicsContext& context) {
  context.makeCurrent();
  impl_ = std::make_unique<Impl>();
  glGenVertexArrays(1, &impl_->nothing);
  std::array<float, 2> widths{1, 1};
  glGetFloatv(GL_ALIASED_LINE_WIDTH_RANGE, widths.data());
  impl_->widest_line = widths[1];
}

Renderer::~Renderer() {
  while (!impl_->batches.empty()) impl_->remove(impl_->batches.begin()->first);
  glDeleteVertexArrays(1, &impl_->nothing);
}

void Renderer::Impl::remove(BatchId id) {
  const auto found = batches.find(id);
  if (found == batches.end()) return;
  glDeleteVertexArrays(1, &found->second.vertices);
  glDeleteBuffers(1, &found->second.buffer);
  bytes -= static_cast<std::uint64_t>(found->second.radii_um.size()) * sizeof(DrawnSegment);
  batches.erase(found);
}

void Renderer::remove(BatchId id) { impl_->remove(id); }
std::uint64_t Renderer::bytes() const { return impl_->bytes; }
void Renderer::show(BatchId id, bool shown) {
  const auto found = impl_->batches.find(id);
  if (found != impl_->batches.end()) found->second.shown = shown;
}

void Renderer::put(BatchId id, const ThreadBatch& batch, Layer layer) {
  remove(id);
  if (batch.segments.empty()) return;
  const auto radius = [](const DrawnSegment& s) { return std::max(s.a_radius_um, s.b_radius_um); };
  std::vector<DrawnSegment> sorted;
  std::span<const DrawnSegment> segments = batch.segments;
  if (!isThickestFirst(batch)) {
    ThreadBatch copy = batch;
    sortThickestFirst(copy);
    sorted = std::move(copy.segments);
    segments = sorted;
  }
  Uploaded up{batch.origin_W, batch.lo_W, batch.hi_W, layer, {}, 0, 0};
  up.radii_um.reserve(segments.size());
  for (const DrawnSegment& segment : segments) up.radii_um.push_back(radius(segment));
  const std::size_t bytes = batch.segments.size() * sizeof(DrawnSegment);
  glGenVertexArrays(1, &up.vertices);
  glBindVertexArray(up.vertices);
  glGenBuffers(1, &up.buffer);
  glBindBuffer(GL_ARRAY_BUFFER, up.buffer);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), segments.data(), GL_STATIC_DRAW);
  for (const GLuint place : {0U, 1U, 2U}) {
    glEnableVertexAttribArray(place);
    glVertexAttribDivisor(place, 1);
  }
  impl_->batches.emplace(id, std::move(up));
  impl_->bytes += bytes;
  requireRoom("the threads");
}

const Program& Renderer::Impl::composing(StereoMode mode, int samples, bool shaded) {
  const std::array<int, 3> key{static_cast<int>(mode), samples, shaded ? 1 : 0};
  const auto found = compose.find(key);
  if (found != compose.end()) return found->second;
  std::string text = internal::kComposeFragmentShader;
  std::string defined = "#define MODE " + std::to_string(key[0]);
  defined += "\n#define SAMPLES " + std::to_string(key[1]);
  defined += "\n#define SHADED " + std::to_string(key[2]);
  text.insert(text.find('\n') + 1, defined + "\n");  // after the version
  return compose.try_emplace(key, internal::kComposeVertexShader, text.c_str()).first->second;
}

void Renderer::Impl::prepare(const Program& program, const EyeView& view, const PictureSize& size,
                             const RenderOptions& options, int samples) const {
  const Eigen::Matrix4d p = projection(view.frustum);
  program.use();
  program.set("rotation_VW", view.rotation_VW);
  program.set("lens", Eigen::Vector4d(p(0, 0), p(0, 2), p(1, 1), p(1, 2)));
  program.set("depth_map", p(2, 2), p(2, 3));
  program.set("half_px", size.width / 2.0, size.height / 2.0);
  program.set("near_um", view.frustum.near_um);
  program.set("least_px", kLeastRadius_px);
  program.set("halo_px", options.halo_px * samples);
  program.set("halo_radii", 0.8, 2.0);
  program.set("background", colourVector(options.background));
  program.set("dim", options.dim);
  program.set("fog", Vector3d(options.fog_begin_um, options.fog_end_um, options.fog_most));
  program.set("clearing", options.clear_end_um, options.clear_begin_um);
  program.set("opacity", 1.0);
}

RenderFigures Renderer::Impl::drawEye(const EyeView& view, const PictureSize& size, const RenderOptions& options,
                                      int samples) const {
  const LevelView levels = levelView(view, size);
  RenderFigures figures;
  struct Part {  // a batch, thickest first: cones up to the first bound, ribbons up to the second, then lines
    const Uploaded* batch;
    std::size_t cones, ribbons;
  };
  std::vector<Part> threads, highlights, marks;
  for (const auto& [id, batch] : batches) {
    if (!batch.shown) continue;
    if (!isSeen(batch, levels)) {
      ++figures.culled;
      continue;
    }
    ++figures.batches;
    if (batch.layer != Layer::threads) {
      (batch.layer == Layer::marks ? marks : highlights)
          .push_back({&batch, batch.radii_um.size(), batch.radii_um.size()});
      if (batch.layer == Layer::highlight) figures.cones += batch.radii_um.size();
      continue;
    }
    const double distance = (batch.lo_W - view.eye_W).cwiseMax(view.eye_W - batch.hi_W).cwiseMax(0.0).norm();
    const auto thickerThan = [&, &radii_um = batch.radii_um](double radius_px) {
      const double least_um = radius_px * distance / levels.pixels_per_rad;
      const auto thin = std::partition_point(radii_um.begin(), radii_um.end(),
                                             [least_um](float radius_um) { return radius_um >= least_um; });
      return static_cast<std::size_t>(thin - radii_um.begin());
    };
    const std::size_t ribbons = thickerThan(kLineRadius_px);
    const std::size_t cones = widest_line >= kRibbon ? thickerThan(kRibbonRadius_px) : ribbons;
    threads.push_back({&batch, cones, ribbons});
    figures.cones += cones;
    figures.lines += batch.radii_um.size() - cones;
  }

  const Vector3d background = colourVector(options.background);
  glClearColor(static_cast<float>(background.x()), static_cast<float>(background.y()),
               static_cast<float>(background.z()), 1);
  // Who else draws in this context may have left anything on.
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_CULL_FACE);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDisable(GL_BLEND);

  prepare(line, view, size, options, samples);
  const auto drawLines = [&](float width, const auto& begin_of, const auto& end_of) {
    glLineWidth(std::min(width, widest_line));
    for (const Part& part : threads) {
      const std::size_t begin = begin_of(part), end = end_of(part);
      if (begin == end) continue;
      line.set("origin_V", view.toView(part.batch->origin_W));
      bindFrom(*part.batch, begin);
      glDrawArraysInstanced(GL_LINES, 0, 2, static_cast<GLsizei>(end - begin));
    }
  };
  const auto cones = [](const Part& part) { return part.cones; };
  const auto ribbons = [](const Part& part) { return part.ribbons; };
  const auto all = [](const Part& part) { return part.batch->radii_um.size(); };
  const auto width = static_cast<float>(samples);
  if (width >= kRibbon) {
    drawLines(width, cones, all);
  } else {
    drawLines(kRibbon, cones, ribbons);
    drawLines(width, ribbons, all);
  }
  prepare(cone, view, size, options, samples);
  const auto drawCones = [&](const std::vector<Part>& parts) {
    for (const Part& part : parts) {
      if (part.cones == 0) continue;
      cone.set("origin_V", view.toView(part.batch->origin_W));
      bindFrom(*part.batch, 0);
      glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(part.cones));
    }
  };
  drawCones(threads);
  if (highlights.empty() && marks.empty()) return figures;

  // Inside dense tissue they would vanish: faint without a test of depth, then as they are.
  const auto drawTwice = [&](const std::vector<Part>& parts, double faint, double rim_px) {
    if (parts.empty()) return;
    cone.set("halo_px", 0.0);
    cone.set("opacity", faint);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    drawCones(parts);
    glDisable(GL_BLEND);
    glEnable(GL_DEPTH_TEST);
    cone.set("opacity", 1.0);
    cone.set("halo_px", rim_px * samples);
    drawCones(parts);
  };
  cone.set("fog", Vector3d(1e9, 2e9, 0));
  cone.set("dim", 0.0);
  cone.set("clearing", -2.0, -1.0);
  cone.set("least_px", kHighlightRadius_px * samples);
  drawTwice(highlights, 0.45, 0);
  cone.set("least_px", kLeastRadius_px);
  cone.set("halo_radii", 1.2 * samples, 2.4 * samples);  // of the glyph, not of the boxes
  drawTwice(marks, 0.4, kMarkHalo_px);
  return figures;
}

RenderFigures Renderer::draw(const std::array<EyeView, 2>& views, const RenderOptions& options) {
  const PictureSize& size = options.size;
  if (size.width < 1 || size.height < 1 || size.width > kMaxSize || size.height > kMaxSize)
    throw UsageError("a picture of " + std::to_string(size.width) + " x " + std::to_string(size.height) +
                     " pixels: each side must be 1 to " + std::to_string(kMaxSize));
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  int samples = std::clamp(options.samples, 1, 4);
  while (samples > 1 && samples * std::max(size.width, size.height) > most) samples /= 2;
  const PictureSize eye = eyeSize(options.stereo, size);
  const bool quad_buffer = options.stereo == StereoMode::quad_buffer;
  if (quad_buffer && !hasQuadBuffer())
    throw GraphicsError(
        "this display has no quad-buffer stereo; choose anaglyph, side-by-side, top-bottom or row-interleaved");

  RenderFigures figures;
  const std::size_t count = options.stereo == StereoMode::mono ? 1 : 2;
  for (std::size_t i = 0; i < count; ++i) {
    impl_->eyes[i].resize({eye.width * samples, eye.height * samples}, true);
    impl_->eyes[i].bind();
    const RenderFigures drawn = impl_->drawEye(views[i], impl_->eyes[i].size(), options, samples);
    if (i == 0) figures = drawn;
  }

  glDisable(GL_DEPTH_TEST);
  const Eigen::Matrix4d p = projection(views[0].frustum);
  glBindVertexArray(impl_->nothing);
  const auto bindPicture = [](GLuint unit, GLuint texture) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D, texture);
  };
  const auto composeInto = [&](Target& target, std::size_t left, std::size_t right, StereoMode mode) {
    target.resize(size, false);
    target.bind();
    const Program& compose = impl_->composing(mode, samples, options.shade_um > 0);
    compose.use();
    compose.set("left_eye", 0);
    compose.set("right_eye", 1);
    compose.set("left_depth", 2);
    compose.set("right_depth", 3);
    compose.set("whole", size);
    compose.set("eye", eye);
    compose.set("depth_map", p(2, 2), p(2, 3));
    compose.set("shade_um", options.shade_um);
    bindPicture(0, impl_->eyes[left].colour());
    bindPicture(1, impl_->eyes[right].colour());
    bindPicture(2, impl_->eyes[left].depth());
    bindPicture(3, impl_->eyes[right].depth());
    glDrawArrays(GL_TRIANGLES, 0, 3);
  };
  if (quad_buffer) {
    composeInto(impl_->whole_right, 1, 1, StereoMode::mono);
    composeInto(impl_->whole, 0, 0, StereoMode::mono);
  } else {
    composeInto(impl_->whole, 0, count - 1, options.stereo);
  }
  for (const GLuint unit : {3U, 2U, 1U, 0U}) bindPicture(unit, 0);
  impl_->quad_buffer = quad_buffer;
  requireRoom("the picture");
  return figures;
}

bool Renderer::hasQuadBuffer() const {
  GLboolean stereo = GL_FALSE;
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glGetBooleanv(GL_STEREO, &stereo);
  return stereo == GL_TRUE;
}

Picture Renderer::read() const {
  const PictureSize& size = impl_->whole.size();
  const auto row = static_cast<std::size_t>(size.width) * 3, rows = static_cast<std::size_t>(size.height);
  Picture picture{size.width, size.height, std::vector<std::uint8_t>(row * rows)};
  if (picture.rgb.empty()) return picture;
  impl_->whole.bind();
  std::vector<std::uint8_t> upside_down(row * rows);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, size.width, size.height, GL_RGB, GL_UNSIGNED_BYTE, upside_down.data());
  for (std::size_t y = 0; y < rows; ++y)
    std::copy_n(upside_down.begin() + static_cast<std::ptrdiff_t>((rows - 1 - y) * row), row,
                picture.rgb.begin() + static_cast<std::ptrdiff_t>(y * row));
  return picture;
}

void Renderer::finish() const { glFinish(); }

void Renderer::present(const PictureSize& window) const {
  if (window.width < 1 || window.height < 1) throw UsageError("a window of no pixels cannot be drawn into");
  const PictureSize& size = impl_->whole.size();
  if (size.width == 0) return;
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  glDisable(GL_SCISSOR_TEST);
  const bool same = window.width == size.width && window.height == size.height;
  const auto copy = [&](const Target& from, GLenum to) {
    from.bindForReading();
    if (impl_->quad_buffer) glDrawBuffer(to);
    glBlitFramebuffer(0, 0, size.width, size.height, 0, 0, window.width, window.height, GL_COLOR_BUFFER_BIT,
                      same ? GL_NEAREST : GL_LINEAR);
  };
  if (impl_->quad_buffer) copy(impl_->whole_right, GL_BACK_RIGHT);
  copy(impl_->whole, GL_BACK_LEFT);
  if (impl_->quad_buffer) glDrawBuffer(GL_BACK);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, window.width, window.height);
}

}  // namespace filiform
