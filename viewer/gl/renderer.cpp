#include "viewer/gl/renderer.h"

#include "viewer/gl/internal/card_batch.h"
#include "viewer/gl/internal/card_palette.h"
#include "viewer/gl/internal/gl_objects.h"
#include "viewer/gl/internal/picture_reader.h"
#include "viewer/gl/internal/pieces.h"
#include "viewer/gl/internal/shaders.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <limits>
#include <map>
#include <string>
#include <utility>

namespace filiform {

namespace {

using internal::CardBatch;
using internal::fades;
using internal::isHalo;
using internal::kHighlightRadius_px;
using internal::listPieces;
using internal::Piece;
using internal::Primitive;
using internal::primitiveOf;
using internal::Program;
using internal::requireNoError;
using internal::Stage;
using internal::Target;

// Width of a ribbon in sample pixels.
constexpr double kRibbon = 2;
// Least radius of a ball in sample pixels: a smaller one would fall between the samples.
constexpr double kLeastBall_px = 0.71;
// No cone is drawn thinner: it would break into dots.
constexpr double kLeastRadius_px = 0.55;
// A dark rim separates overlays from the neurites behind them.
constexpr double kOverlayHalo_px = 2.5;
// A highlighted cell is drawn so many samples nearer: its dimmed copy in the neurites' layer does not show.
constexpr double kNearer_px = 2;
// Dimmed cells mix with the background so far.
constexpr double kDimmed = 0.7;

Vector3d colourVector(Rgba c) { return Vector3d(c.r, c.g, c.b) / 255; }

bool contextHasQuadBuffer() {
  GLboolean stereo = GL_FALSE;
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glGetBooleanv(GL_STEREO, &stereo);
  return stereo == GL_TRUE;
}

// The text of a shader with definitions, and a text before its own, after its first line, which states the version.
std::string withDefinitions(std::string text, std::initializer_list<std::pair<const char*, int>> definitions,
                            const char* before = "") {
  std::string defined = before;
  for (const auto& [name, value] : definitions)
    defined += std::string("#define ") + name + " " + std::to_string(value) + "\n";
  return text.insert(text.find('\n') + 1, defined);
}

// Waits until what was drawn into the bound framebuffer is drawn. The driver draws later than the calls return, and
// browsers wait for no less than a pixel: glFinish() returns at once there, and fences are signalled after the frame.
void waitForPixel() {
  std::array<std::uint8_t, 4> pixel{};
  glReadPixels(0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel.data());
}

// Segments between the first two looks at the clock, at most; see Piece::quickGroup().
constexpr std::size_t kFirstGroup = 512, kMostGroup = std::size_t{1} << 20;
// Rows of the picture that one step composes.
constexpr int kRows = 64;

std::pair<const char*, const char*> textsOf(Primitive shape) {
  if (shape == Primitive::line) return {internal::kLineVertexShader, internal::kLineFragmentShader};
  if (shape == Primitive::cone) return {internal::kConeVertexShader, internal::kConeFragmentShader};
  return {internal::kBallVertexShader, internal::kBallFragmentShader};
}
// As the shaders number it. Of lines, `solid` is what does not fade.
enum class Drawn : std::uint8_t { surface, halo, solid = halo, fading };

// A picture under way: first the pieces of each eye, then the rows of the composed picture.
struct Job {
  std::array<EyeView, 2> views;
  RenderOptions options;
  PictureSize eye_size;
  int samples = 1;
  std::size_t eyes = 1;
  std::array<std::vector<Piece>, 2> pieces;
  std::size_t drawn_eyes = 0, drawn_pieces = 0, drawn_segments = 0;  // of the current eye; of the current piece
  std::size_t all_segments = 0, all_drawn = 0;                       // of both eyes
  int composed_rows = 0;
  bool under_way = false, copied = false;  // copied: the eye's surfaces
  Stage stage{};                           // of the last group
  std::size_t group = kFirstGroup;         // segments between two looks at the clock

  double done() const {
    constexpr double kDrawing = 0.8;
    const double drawn = all_segments > 0 ? static_cast<double>(all_drawn) / static_cast<double>(all_segments) : 1;
    return kDrawing * drawn + (1 - kDrawing) * composed_rows / options.size.height;
  }
};

}  // namespace

struct Renderer::Impl {
  // Compiled when first needed: by shape and by what of it is drawn; by mode, samples and shading.
  std::map<std::pair<Primitive, Drawn>, Program> shapes;
  std::map<std::array<int, 3>, Program> compose;
  std::map<BatchId, CardBatch> batches;
  internal::CardPalette palette;
  std::array<Target, 2> eyes;
  Target surfaces;  // a copy of an eye's picture without halos
  // The last picture, and the one under way; for quad-buffer stereo also of the right eye.
  std::array<Target, 2> wholes, wholes_right;
  std::size_t last = 0;      // of `wholes`
  bool quad_buffer = false;  // the last picture is one
  GLuint nothing = 0;        // empty vertex array of the composing pass
  GLint largest_texture = 0;
  bool has_base_instance = false;  // a piece then needs no pointers of its own
  std::uint64_t bytes = 0;
  Job job;
  internal::PictureReader reader;

  const Target& whole() const { return wholes[last]; }
  void remove(BatchId id);
  Program& drawing(Primitive shape, Drawn drawn);
  Program& composing(StereoMode mode, int samples, bool shaded);
  RenderFigures start(const std::array<EyeView, 2>& views, const RenderOptions& options);
  void clearEye(std::size_t eye);
  Program& enter(Stage stage, std::size_t eye);
  void copySurfaces(std::size_t eye);
  void drawPieces(std::size_t eye, std::size_t most_segments);
  void composeRows(int first_row, int rows);
  void mixIn(double shown);
};

Renderer::Renderer(GraphicsContext& context) {
  context.makeCurrent();
  impl_ = std::make_unique<Impl>();
  glGenVertexArrays(1, &impl_->nothing);
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &impl_->largest_texture);
  impl_->palette.put({});
#ifdef GL_ARB_base_instance
  impl_->has_base_instance = epoxy_has_gl_extension("GL_ARB_base_instance");
#endif
}

Renderer::~Renderer() {
  glUseProgram(0);  // a deleted program would be restored by whoever draws next with another one
  while (!impl_->batches.empty()) impl_->remove(impl_->batches.begin()->first);
  glDeleteVertexArrays(1, &impl_->nothing);
}

void Renderer::Impl::remove(BatchId id) {
  const auto found = batches.find(id);
  if (found == batches.end()) return;
  job.under_way = false;
  bytes -= found->second.bytes();
  batches.erase(found);
}

void Renderer::remove(BatchId id) { impl_->remove(id); }
std::uint64_t Renderer::bytes() const { return impl_->bytes; }
void Renderer::paint(const CellPalette& palette) {
  impl_->palette.put(palette);
  impl_->job.under_way = false;
}
void Renderer::show(BatchId id, bool shown) {
  const auto found = impl_->batches.find(id);
  if (found == impl_->batches.end() || found->second.shown == shown) return;
  found->second.shown = shown;
  impl_->job.under_way = false;
}
void Renderer::place(BatchId id, Layer layer) {
  const auto found = impl_->batches.find(id);
  if (found == impl_->batches.end() || found->second.layer() == layer) return;
  found->second.setLayer(layer);
  impl_->job.under_way = false;
}
bool Renderer::isUnderWay() const { return impl_->job.under_way; }

void Renderer::put(BatchId id, const NeuriteBatch& batch, Layer layer) {
  if (batch.segments.empty()) return remove(id);
  impl_->job.under_way = false;
  CardBatch& on_card = impl_->batches[id];
  impl_->bytes += batch.segments.size() * sizeof(DrawnSegment) - on_card.bytes();
  on_card.put(batch, layer);
}

Program& Renderer::Impl::drawing(Primitive shape, Drawn drawn) {
  const std::pair key{shape, drawn};
  const auto found = shapes.find(key);
  if (found != shapes.end()) return found->second;
  const auto [vertex, fragment] = textsOf(shape);
  const auto text = [drawn](const char* of, const char* before) {
    return withDefinitions(of, {{"DRAWN", static_cast<int>(drawn)}}, before);
  };
  return shapes.try_emplace(key, text(vertex, internal::kPaintText).c_str(), text(fragment, "").c_str()).first->second;
}

Program& Renderer::Impl::composing(StereoMode mode, int samples, bool shaded) {
  const std::array<int, 3> key{static_cast<int>(mode), samples, shaded ? 1 : 0};
  const auto found = compose.find(key);
  if (found != compose.end()) return found->second;
  const std::string text =
      withDefinitions(internal::kComposeFragmentShader, {{"MODE", key[0]}, {"SAMPLES", key[1]}, {"SHADED", key[2]}});
  return compose.try_emplace(key, internal::kComposeVertexShader, text.c_str()).first->second;
}

void Renderer::Impl::clearEye(std::size_t eye) {
  eyes[eye].resize({job.eye_size.width * job.samples, job.eye_size.height * job.samples}, true);
  eyes[eye].bind();
  job.copied = false;
  const Vector3d background = colourVector(job.options.background);
  glClearColor(static_cast<float>(background.x()), static_cast<float>(background.y()),
               static_cast<float>(background.z()), 1);
  glDisable(GL_SCISSOR_TEST);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

// Sets the OpenGL state and the shader of a stage.
Program& Renderer::Impl::enter(Stage stage, std::size_t eye) {
  const bool faint =
      stage == Stage::highlight_faint_lines || stage == Stage::highlight_faint || stage == Stage::overlays_faint;
  if (faint)
    glDisable(GL_DEPTH_TEST);
  else
    glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  if (faint || fades(stage))
    glEnable(GL_BLEND);
  else
    glDisable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDepthMask(fades(stage) ? GL_FALSE : GL_TRUE);
  const RenderOptions& options = job.options;
  const EyeView& view = job.views[eye];
  const PictureSize& size = eyes[eye].size();
  const Eigen::Matrix4d p = projection(view.frustum);
  const bool is_highlight = stage >= Stage::highlight_faint_lines && stage <= Stage::highlight;
  const bool is_highlight_line = stage == Stage::highlight_faint_lines || stage == Stage::highlight_lines;
  const bool is_neurite = stage < Stage::highlight_faint_lines;
  const Primitive shape = primitiveOf(stage);
  const bool may_fade = is_neurite && options.clear_begin_um > view.frustum.near_um;
  Program& program = drawing(shape, fades(stage)                           ? Drawn::fading
                                    : isHalo(stage)                        ? Drawn::halo
                                    : shape == Primitive::line && may_fade ? Drawn::solid
                                                                           : Drawn::surface);
  program.use();
  program.set("rotation_VW", view.rotation_VW);
  program.set("lens", Eigen::Vector4d(p(0, 0), p(0, 2), p(1, 1), p(1, 2)));
  program.set("depth_map", p(2, 2), p(2, 3) * (is_highlight ? 1 + kNearer_px / (p(1, 1) * size.height / 2) : 1));
  program.set("half_px", size.width / 2.0, size.height / 2.0);
  program.set("near_um", view.frustum.near_um);
  program.set("background", colourVector(options.background));
  program.set("dim", is_neurite ? options.dim : 0);
  program.set(
      "fog", is_neurite ? Vector3d(options.fog_begin_um, options.fog_end_um, options.fog_most) : Vector3d(1e9, 2e9, 0));
  program.set("clearing", is_neurite ? options.clear_end_um : -2, is_neurite ? options.clear_begin_um : -1);
  palette.bind(program, is_neurite ? kDimmed : 0);
  program.set("opacity", !faint ? 1.0 : is_highlight ? 0.45 : 0.4);
  if (shape == Primitive::line) {
    const bool is_ribbon = stage == Stage::ribbons || stage == Stage::fading_ribbons;
    program.set("width_px", is_highlight_line ? 2 * kHighlightRadius_px * job.samples
                            : is_ribbon       ? std::max<double>(job.samples, kRibbon)
                                              : job.samples);
    return program;
  }
  program.set("least_px", is_highlight               ? kHighlightRadius_px * job.samples
                          : shape == Primitive::ball ? kLeastBall_px
                                                     : kLeastRadius_px);
  if (isHalo(stage)) {
    program.set("halo_px", (is_neurite ? options.halo_px : kOverlayHalo_px) * job.samples);
    // The glyph has a halo, and boxes have none.
    program.set("halo_radii", is_neurite ? 0.8 : 1.2 * job.samples, is_neurite ? 2.0 : 2.4 * job.samples);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, surfaces.colour());
    program.set("surfaces", 0);
  } else {
    program.set("halo_px", 0.0);
  }
  return program;
}

void Renderer::Impl::copySurfaces(std::size_t eye) {
  const PictureSize& size = eyes[eye].size();
  surfaces.resize(size, false);
  surfaces.bind();
  eyes[eye].bindForReading();
  glBlitFramebuffer(0, 0, size.width, size.height, 0, 0, size.width, size.height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  job.copied = true;
}

// Draws the next segments, of one stage: in parts no more than a quick group of one piece.
void Renderer::Impl::drawPieces(std::size_t eye, std::size_t most_segments) {
  const bool in_parts = most_segments < std::numeric_limits<std::size_t>::max();
  const std::vector<Piece>& pieces = job.pieces[eye];
  const Stage stage = pieces[job.drawn_pieces].stage;
  // Other users of this context may have changed the state.
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_CULL_FACE);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  if (isHalo(stage) && !job.copied) copySurfaces(eye);
  eyes[eye].bind();
  Program& program = enter(stage, eye);
  while (most_segments > 0 && job.drawn_pieces < pieces.size() && pieces[job.drawn_pieces].stage == stage) {
    const Piece& piece = pieces[job.drawn_pieces];
    std::size_t count = std::min(most_segments, piece.count - job.drawn_segments);
    if (in_parts) {
      const std::size_t quick = piece.quickGroup(job.drawn_segments, eyes[eye].size());
      if (quick < count) most_segments = count = quick;
    }
    program.set("origin_V", job.views[eye].toView(piece.batch->origin_W()));
    palette.paint(program, *piece.batch);
    if (piece.from == CardBatch::From::ribbons || piece.from == CardBatch::From::lines)
      program.set("pixel_um", piece.batch->pixel_um());
    const std::size_t first = piece.first + job.drawn_segments;
    constexpr GLsizei kCorners = 4;
#ifdef GL_ARB_base_instance
    if (has_base_instance) {
      piece.batch->bindFrom(CardBatch::From::cones, 0);
      glDrawArraysInstancedBaseInstance(GL_TRIANGLE_STRIP, 0, kCorners, static_cast<GLsizei>(count),
                                        static_cast<GLuint>(first));
    } else
#endif
    {
      piece.batch->bindFrom(piece.from, first);
      glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, kCorners, static_cast<GLsizei>(count));
    }
    most_segments -= count;
    job.drawn_segments += count;
    job.all_drawn += count;
    if (job.drawn_segments == piece.count) ++job.drawn_pieces, job.drawn_segments = 0;
  }
}

void Renderer::Impl::composeRows(int first_row, int rows) {
  const RenderOptions& options = job.options;
  const Eigen::Matrix4d p = projection(job.views[0].frustum);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthMask(GL_TRUE);
  glBindVertexArray(nothing);
  const auto bindPicture = [](GLuint unit, GLuint texture) {
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D, texture);
  };
  const auto composeInto = [&](Target& target, std::size_t left, std::size_t right, StereoMode mode) {
    target.resize(options.size, false);
    target.bind();
    glEnable(GL_SCISSOR_TEST);
    glScissor(0, first_row, options.size.width, rows);
    Program& composing_program = composing(mode, job.samples, options.shade_um > 0);
    composing_program.use();
    composing_program.set("left_eye", 0);
    composing_program.set("right_eye", 1);
    composing_program.set("left_depth", 2);
    composing_program.set("right_depth", 3);
    composing_program.set("whole", options.size);
    composing_program.set("eye", job.eye_size);
    composing_program.set("depth_map", p(2, 2), p(2, 3));
    composing_program.set("shade_um", options.shade_um);
    bindPicture(0, eyes[left].colour());
    bindPicture(1, eyes[right].colour());
    bindPicture(2, eyes[left].depth());
    bindPicture(3, eyes[right].depth());
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDisable(GL_SCISSOR_TEST);
  };
  if (options.stereo == StereoMode::quad_buffer) {
    composeInto(wholes_right[1 - last], 1, 1, StereoMode::mono);
    composeInto(wholes[1 - last], 0, 0, StereoMode::mono);
  } else {
    composeInto(wholes[1 - last], 0, job.eyes - 1, options.stereo);
  }
  for (const GLuint unit : {3U, 2U, 1U, 0U}) bindPicture(unit, 0);
}

// Draws the last picture over the bound framebuffer, which has its size.
void Renderer::Impl::mixIn(double shown) {
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_CULL_FACE);
  glEnable(GL_BLEND);
  glBlendColor(0, 0, 0, static_cast<float>(shown));
  glBlendFunc(GL_CONSTANT_ALPHA, GL_ONE_MINUS_CONSTANT_ALPHA);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glBindVertexArray(nothing);
  Program& copying = composing(StereoMode::mono, 1, false);
  copying.use();
  copying.set("left_eye", 0);
  copying.set("whole", whole().size());
  copying.set("eye", whole().size());
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, whole().colour());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindTexture(GL_TEXTURE_2D, 0);
  glDisable(GL_BLEND);
}

RenderFigures Renderer::Impl::start(const std::array<EyeView, 2>& views, const RenderOptions& options) {
  const PictureSize& size = options.size;
  if (size.width < 1 || size.height < 1 || size.width > kMaxSize || size.height > kMaxSize)
    throw UsageError("a picture of " + std::to_string(size.width) + " x " + std::to_string(size.height) +
                     " pixels: each side must be 1 to " + std::to_string(kMaxSize));
  int samples = std::clamp(options.samples, 1, 4);
  while (samples > 1 && samples * std::max(size.width, size.height) > largest_texture) samples /= 2;
  if (options.stereo == StereoMode::quad_buffer && !contextHasQuadBuffer())
    throw GraphicsError(
        "this display has no quad-buffer stereo; choose anaglyph, side-by-side, top-bottom or row-interleaved");

  job = {};
  job.views = views;
  job.options = options;
  job.eye_size = eyeSize(options.stereo, size);
  job.samples = samples;
  job.eyes = options.stereo == StereoMode::mono ? 1 : 2;
  RenderFigures figures;
  for (std::size_t eye = 0; eye < job.eyes; ++eye) {
    const RenderFigures listed = listPieces(views[eye], {job.eye_size.width * samples, job.eye_size.height * samples},
                                            samples, options, batches, job.pieces[eye]);
    if (eye == 0) figures = listed;
    for (const Piece& piece : job.pieces[eye]) job.all_segments += piece.count;
  }
  job.under_way = true;
  return figures;
}

RenderFigures Renderer::begin(const std::array<EyeView, 2>& views, const RenderOptions& options) {
  return impl_->start(views, options);
}

double Renderer::advance(double most_ms) {
  using Clock = std::chrono::steady_clock;
  Impl& r = *impl_;
  Job& job = r.job;
  if (!job.under_way) return 1;
  const bool at_once = std::isinf(most_ms);
  const Clock::time_point begin = Clock::now();
  Clock::time_point now = begin;
  const auto since_ms = [&now](Clock::time_point then) {
    return std::chrono::duration<double, std::milli>(now - then).count();
  };
  const auto wait = [&now] {
    waitForPixel();
    now = Clock::now();
  };
  for (; job.drawn_eyes < job.eyes; ++job.drawn_eyes, job.drawn_pieces = 0) {
    const std::size_t eye = job.drawn_eyes;
    if (job.drawn_pieces == 0 && job.drawn_segments == 0) r.clearEye(eye);
    const std::vector<Piece>& pieces = job.pieces[eye];
    while (job.drawn_pieces < pieces.size()) {
      const Stage stage = pieces[job.drawn_pieces].stage;
      if (stage != std::exchange(job.stage, stage)) job.group = kFirstGroup;
      const Clock::time_point group_begin = now;
      r.drawPieces(eye, at_once ? std::numeric_limits<std::size_t>::max() : job.group);
      if (at_once) continue;
      wait();
      const double group_ms = since_ms(group_begin);
      if (group_ms < most_ms / 8) job.group = std::min(2 * job.group, kMostGroup);
      if (group_ms > most_ms / 3) job.group = std::max<std::size_t>(job.group / 2, 1);
      if (since_ms(begin) >= most_ms) return job.done();
    }
  }
  while (job.composed_rows < job.options.size.height) {
    const int left = job.options.size.height - job.composed_rows, rows = at_once ? left : std::min(kRows, left);
    r.composeRows(job.composed_rows, rows);
    job.composed_rows += rows;
    if (rows == left) break;
    wait();
    if (since_ms(begin) >= most_ms) return job.done();
  }
  job.under_way = false;
  r.last = 1 - r.last;
  r.quad_buffer = job.options.stereo == StereoMode::quad_buffer;
  requireNoError("the picture");
  return 1;
}

RenderFigures Renderer::draw(const std::array<EyeView, 2>& views, const RenderOptions& options) {
  const RenderFigures figures = impl_->start(views, options);
  advance(INFINITY);
  return figures;
}

void Renderer::warmUp() {
  NeuriteBatch batch;
  batch.lo_W.setConstant(-100);
  batch.hi_W.setConstant(100);
  for (const float radius_um : {20.0F, 0.3F, 0.1F, 1e-3F})
    for (const float end_um : {0.0F, 60.0F})
      batch.segments.push_back({.a_um = {0, 0, -50},
                                .a_radius_um = radius_um,
                                .b_um = {end_um, 0, -50},
                                .b_radius_um = radius_um,
                                .paint = 0});
  for (const Layer layer : {Layer::neurites, Layer::highlight, Layer::overlays})
    put(UINT64_MAX - static_cast<BatchId>(layer), batch, layer);
  for (const int samples : {1, 2})
    for (const bool inside : {false, true}) {
      RenderOptions options{.size = {64, 40}, .samples = samples};
      options.shade_um = inside ? 0 : 1;
      if (inside) options.clear_end_um = 40, options.clear_begin_um = 60;
      draw({EyeView{}, EyeView{}}, options);
    }
  for (const Layer layer : {Layer::neurites, Layer::highlight, Layer::overlays})
    remove(UINT64_MAX - static_cast<BatchId>(layer));
}

bool Renderer::hasQuadBuffer() const { return contextHasQuadBuffer(); }

Picture Renderer::read() const {
  Picture picture;
  while (!readMore(picture, std::numeric_limits<int>::max())) {
  }
  return picture;
}

bool Renderer::readMore(Picture& picture, int most_rows) const {
  return impl_->reader.readMore(impl_->whole(), picture, most_rows);
}

Picture Renderer::readWindow(const PictureSize& window) { return internal::PictureReader::readWindow(window); }

void Renderer::finish() const {
  if (impl_->whole().size().width == 0) return;
  impl_->whole().bind();
  waitForPixel();
}

void Renderer::present(const PictureSize& window, double shown) {
  if (window.width < 1 || window.height < 1)
    throw UsageError("the window has no pixels: width and height must be 1 or more");
  const PictureSize& size = impl_->whole().size();
  if (size.width == 0) return;
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  glDisable(GL_SCISSOR_TEST);
  const auto fits = [&window](const PictureSize& of) { return window.width == of.width && window.height == of.height; };
  const bool same = fits(size);
  const Target& before = impl_->wholes[1 - impl_->last];
  const bool mixes = shown < 1 && same && fits(before.size()) && !isUnderWay() && !impl_->quad_buffer;
  const auto copy = [&](const Target& from, GLenum to) {
    from.bindForReading();
    if (impl_->quad_buffer) glDrawBuffer(to);
    glBlitFramebuffer(0, 0, size.width, size.height, 0, 0, window.width, window.height, GL_COLOR_BUFFER_BIT,
                      same ? GL_NEAREST : GL_LINEAR);
  };
  if (impl_->quad_buffer) copy(impl_->wholes_right[impl_->last], GL_BACK_RIGHT);
  copy(mixes ? before : impl_->whole(), GL_BACK_LEFT);
  if (impl_->quad_buffer) glDrawBuffer(GL_BACK);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  glViewport(0, 0, window.width, window.height);
  if (mixes) impl_->mixIn(shown);
}

}  // namespace filiform
