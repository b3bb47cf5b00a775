// What a renderer costs and how it works: calls of OpenGL, segments drawn as cones, buffers, pictures in parts, and
// what the driver refuses.
#include "index/errors.h"
#include "tests/viewer/gl/renderer_fixture.h"

#include <epoxy/gl.h>
#include <random>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace filiform::test {
namespace {

TEST_F(Renderers, SoftwareOrACardByNumber) {
  EXPECT_TRUE(isSoftwareRenderer(makeOffscreenContext("software")->description()));
  for (const char* const wrong : {"99", "-1", "1x", "nvidia"}) {
    try {
      makeOffscreenContext(wrong);
      ADD_FAILURE() << wrong;
    } catch (const UsageError& error) {
      EXPECT_NE(std::string(error.what()).find(std::string("--gpu ") + wrong), std::string::npos) << error.what();
    }
  }
  context_->makeCurrent();
}

TEST_F(Renderers, WhatTheDriverRefusesIsSaidOnce) {
  Renderer renderer(*context_);
  glEnable(0xFFFF);
  try {
    renderer.draw(stereoViews(Camera{}, 1.6, 0), {.size = {16, 10}});
    ADD_FAILURE() << "not said";
  } catch (const GraphicsError& error) {
    EXPECT_NE(std::string(error.what()).find("INVALID_ENUM"), std::string::npos) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
  renderer.draw(stereoViews(Camera{}, 1.6, 0), {.size = {16, 10}});
}

// The eye is inside a batch of thin threads: in blocks, only those near the eye cost a cone, and those behind it cost
// nothing. The picture stays.
TEST_F(Renderers, InBlocksFewSegmentsAreConesForAnEyeInside) {
  NeuriteBatch batch;
  std::mt19937 random(7);
  const auto at = [&] { return 200 * (static_cast<double>(random()) / static_cast<double>(random.max()) - 0.5); };
  for (int i = 0; i < 30000; ++i) {
    const double x = at(), y = at(), z = at();
    append(batch, neurites({{x, y, z, 0.02, x + 1, y, z, 0.02}}, kGreen, Vector3d::Zero()));
  }
  NeuriteBatch blocks = batch;
  cutIntoBlocks(blocks);
  sortForDrawing(blocks);
  EXPECT_TRUE(isSortedForDrawing(blocks));
  EXPECT_EQ(blocks.blocks.back().end, batch.segments.size());
  const auto views = stereoViews(lookAt(Vector3d::Zero(), Vector3d(0, 0, -1)), 1.6, 0);
  const auto drawn = [&](const NeuriteBatch& all, Picture& picture) {
    Renderer renderer(*context_);
    renderer.put(1, all);
    const RenderFigures figures = renderer.draw(views, {.size = {320, 200}, .samples = 1});
    picture = renderer.read();
    return figures;
  };
  Picture one, many;
  EXPECT_EQ(drawn(batch, one).cones, batch.segments.size());
  const RenderFigures figures = drawn(blocks, many);
  EXPECT_LE(figures.cones, batch.segments.size() / 4);
  EXPECT_LT(figures.cones + figures.lines, batch.segments.size() * 3 / 4);
  EXPECT_NEAR(litAreaOf(many, 1).count, litAreaOf(one, 1).count, 0.1 * litAreaOf(one, 1).count);
}

struct CallCounts {
  int uniforms = 0, attributes = 0, buffers = 0, reads = 0;
};

// Counts the calls of some functions of OpenGL while it lives.
class CallCounter {
 public:
  CallCounter() {
    counts_ = {};
    uniforms_ = std::exchange(epoxy_glUniform3fv, [](GLint at, GLsizei count, const GLfloat* values) {
      ++counts_.uniforms;
      uniforms_(at, count, values);
    });
    attributes_ =
        std::exchange(epoxy_glVertexAttribPointer,
                      [](GLuint at, GLint size, GLenum type, GLboolean normalised, GLsizei stride, const void* first) {
                        ++counts_.attributes;
                        attributes_(at, size, type, normalised, stride, first);
                      });
    buffers_ = std::exchange(epoxy_glGenBuffers, [](GLsizei count, GLuint* made) {
      ++counts_.buffers;
      buffers_(count, made);
    });
    reads_ = std::exchange(epoxy_glReadPixels, [](GLint x, GLint y, GLsizei width, GLsizei height, GLenum format,
                                                  GLenum type, void* pixels) {
      ++counts_.reads;
      reads_(x, y, width, height, format, type, pixels);
    });
  }
  ~CallCounter() {
    epoxy_glReadPixels = reads_;
    epoxy_glUniform3fv = uniforms_;
    epoxy_glVertexAttribPointer = attributes_;
    epoxy_glGenBuffers = buffers_;
  }
  const CallCounts& counts() const { return counts_; }

 private:
  static inline CallCounts counts_;
  static inline PFNGLUNIFORM3FVPROC uniforms_ = nullptr;
  static inline PFNGLVERTEXATTRIBPOINTERPROC attributes_ = nullptr;
  static inline PFNGLGENBUFFERSPROC buffers_ = nullptr;
  static inline PFNGLREADPIXELSPROC reads_ = nullptr;
};

TEST_F(Renderers, APictureThatDiffersLittleSendsLittle) {
  renderer_.put(1,
                neurites({{-20, 0, 0, 6, 20, 0, 0, 0.01}, {-20, 9, 0, 0.01, 20, 9, 0, 0.01}}, kRed, Vector3d::Zero()));
  renderer_.put(2, ball(0, 0, 0, 3, kGreen, {0, 0, 20}), Layer::overlays);
  draw(camera_);
  const CallCounter counter;
  const Picture first = draw(camera_);
  EXPECT_EQ(counter.counts().attributes, 0);
  EXPECT_EQ(counter.counts().uniforms, 4);  // the origins of the cones, of the overlay and of their halos
  renderer_.put(2, ball(0, 0, 0, 3, kGreen, {0, 0, 20}), Layer::overlays);
  EXPECT_EQ(draw(camera_).rgb, first.rgb);
  EXPECT_EQ(counter.counts().attributes, 0);
  EXPECT_EQ(counter.counts().buffers, 0);
}

// The pieces of many blocks begin at any segment.
TEST_F(Renderers, BlocksSendNoAttributesWhenTheViewMoves) {
  if (!epoxy_has_gl_extension("GL_ARB_base_instance")) GTEST_SKIP() << "the driver cannot begin at an instance";
  NeuriteBatch batch;
  for (int i = 0; i < 200; ++i) {
    const double x = -40 + 0.4 * i, r = i % 2 == 0 ? 1 : 0.01;
    append(batch, neurites({{x, -5, 0, r, x + 1, 5, 0, r}}, kGreen, Vector3d::Zero()));
  }
  cutIntoBlocks(batch, 8);
  renderer_.put(1, batch, Layer::highlight);
  draw(camera_);
  const CallCounter counter;
  draw(lookAt({0, 0, 40}, {5, 0, 0}));
  EXPECT_EQ(counter.counts().attributes, 0);
}

TEST_F(Renderers, ABatchThatIsReplacedByALargerOneIsDrawnWhole) {
  renderer_.put(1, ball(-20, 0, 0, 4, kRed));
  draw(camera_);
  renderer_.put(1, neurites({{-20, 0, 0, 8, -20, 0, 0, 8}, {20, 0, 0, 4, 20, 0, 0, 4}}, kGreen, Vector3d::Zero()),
                Layer::overlays);
  const Picture replaced = draw(camera_);
  EXPECT_EQ(renderer_.bytes(), 2 * sizeof(DrawnSegment));
  Renderer fresh(*context_);
  fresh.put(1, neurites({{-20, 0, 0, 8, -20, 0, 0, 8}, {20, 0, 0, 4, 20, 0, 0, 4}}, kGreen, Vector3d::Zero()),
            Layer::overlays);
  fresh.draw(stereoViews(camera_, size_.aspect(), 0), {.size = size_});
  EXPECT_EQ(fresh.read().rgb, replaced.rgb);
}

TEST_F(Renderers, APictureDrawnInPartsIsTheOneDrawnAtOnce) {
  separation_ = 1.0 / 20;
  NeuriteBatch batch = neurites({{-30, -5, 0, 3, 30, 10, -20, 1}}, kRed, Vector3d::Zero());
  for (int i = 0; i < 2000; ++i) {
    DrawnSegment s = batch.segments.front();
    s.a_um[1] = static_cast<float>(-30 + 0.03 * i);
    s.a_radius_um = s.b_radius_um = i % 3 == 0 ? 0.5F : 0.01F;
    batch.segments.push_back(s);
  }
  batch.lo_W.setConstant(-40);
  batch.hi_W.setConstant(40);
  renderer_.put(1, batch);
  renderer_.put(2, ball(0, 0, 20, 5, kGreen), Layer::overlays);
  renderer_.put(3, ball(20, 0, 20, 5, kGreen), Layer::highlight);
  for (const StereoMode stereo : {StereoMode::mono, StereoMode::anaglyph, StereoMode::side_by_side}) {
    const Picture at_once = draw(camera_, {.stereo = stereo, .shade_um = 10});
    renderer_.draw(stereoViews(camera_, 1.6, 0), {.size = size_});  // another picture
    const RenderOptions options{.size = size_, .stereo = stereo, .shade_um = 10};
    renderer_.begin(stereoViews(camera_, eyeSize(stereo, size_).aspect(), separation_), options);
    double last = 0;
    int parts = 0;
    for (double part = 0; part < 1; ++parts) {
      part = renderer_.advance(0);
      EXPECT_GE(part, last);
      last = part;
    }
    EXPECT_GT(parts, 5);
    Picture picture;
    int reads = 1;
    for (; !renderer_.readMore(picture, 30); ++reads) {
    }
    EXPECT_EQ(reads, 8);
    EXPECT_EQ(picture.rgb, at_once.rgb) << toString(stereo);
  }
}

TEST_F(Renderers, OfALargeHighlightTheThickestSegmentsAreDrawn) {
  NeuriteBatch batch;
  for (int i = 0; i < 1000; ++i) {
    const double x = i % 40, y = i / 40, r = i % 10 == 0 ? 2 : 0.01;
    append(batch, neurites({{x, y, 0, r, x + 1, y, 0, r}}, kGreen, Vector3d::Zero()));
  }
  cutIntoBlocks(batch);
  renderer_.put(1, batch, Layer::highlight);
  draw(camera_);
  EXPECT_EQ(figures_.cones + figures_.lines, 1000u);
  draw(camera_, {.most_highlighted = 100});
  EXPECT_EQ(figures_.cones, 100u);
  EXPECT_EQ(figures_.lines, 0u);
}

// A neurite between the eye and the depth at which neurites have faded away. A neurite that ends there costs its
// visible part.
TEST_F(Renderers, NeuritesThatHaveFadedAwayShadeNothing) {
  if (!epoxy_has_gl_extension("GL_ARB_pipeline_statistics_query")) GTEST_SKIP() << "the driver does not count shading";
  GLuint query = 0;
  glGenQueries(1, &query);
  const auto shaded = [&](std::initializer_list<std::array<double, 8>> list) {
    renderer_.put(1, neurites(list, kRed, Vector3d::Zero()));
    draw(camera_, {.clear_end_um = 60, .clear_begin_um = 80});
    glBeginQuery(GL_FRAGMENT_SHADER_INVOCATIONS_ARB, query);
    draw(camera_, {.clear_end_um = 60, .clear_begin_um = 80});
    glEndQuery(GL_FRAGMENT_SHADER_INVOCATIONS_ARB);
    GLuint count = 0;
    glGetQueryObjectuiv(query, GL_QUERY_RESULT, &count);
    return static_cast<double>(count);
  };
  const double none = shaded({{0, 0, 200, 5, 0, 0, 210, 5}});  // behind the eye
  EXPECT_EQ(shaded({{0, 0, 95, 5, 0, 0, 50, 5}}), none);
  EXPECT_LT(shaded({{0, 0, 95, 5, 0, 0, 30, 5}}), none + 0.15 * 4 * size_.width * size_.height);
  glDeleteQueries(1, &query);
}

// Somata around the eye, as where many cells lie at the origin: they cost as much as one, and the picture stays.
TEST_F(Renderers, OfBallsAroundTheEyeOneIsDrawn) {
  if (!epoxy_has_gl_extension("GL_ARB_pipeline_statistics_query")) GTEST_SKIP() << "the driver does not count shading";
  GLuint query = 0;
  glGenQueries(1, &query);
  NeuriteBatch nearest, all;
  for (int i = 0; i < 50; ++i) {
    const double z = 100 - 5 - (i + 17) % 50;  // the eye is at 100
    append(all, ball(0.1 * i, 0, z, 300, i % 2 == 0 ? kRed : kGreen));
    if ((i + 17) % 50 == 0) nearest = ball(0.1 * i, 0, z, 300, i % 2 == 0 ? kRed : kGreen);
  }
  const auto shaded = [&](const NeuriteBatch& batch, Picture& picture) {
    renderer_.put(1, batch);
    glBeginQuery(GL_FRAGMENT_SHADER_INVOCATIONS_ARB, query);
    picture = draw(camera_);
    glEndQuery(GL_FRAGMENT_SHADER_INVOCATIONS_ARB);
    GLuint count = 0;
    glGetQueryObjectuiv(query, GL_QUERY_RESULT, &count);
    return static_cast<double>(count);
  };
  Picture one, many;
  const double single = shaded(nearest, one);
  EXPECT_LT(shaded(all, many), 1.5 * single);
  EXPECT_EQ(one.rgb, many.rgb);
  glDeleteQueries(1, &query);
}

// Each cone covers the whole picture: a part of many such cones would take seconds.
TEST_F(Renderers, APartOfAPictureIsNoLongerThanItsTime) {
  NeuriteBatch batch = neurites({{-300, 0, 0, 40, 300, 0, 0, 40}}, kRed, Vector3d::Zero());
  batch.segments.resize(512, batch.segments.front());
  renderer_.put(1, batch);
  renderer_.begin(stereoViews(camera_, size_.aspect(), 0), {.size = size_});
  int parts = 1;
  while (renderer_.advance(0) < 1) ++parts;
  EXPECT_GT(parts, 64);
  // However fast the first ones are, it looks at the clock often.
  const CallCounter counter;
  renderer_.begin(stereoViews(camera_, size_.aspect(), 0), {.size = size_});
  EXPECT_EQ(renderer_.advance(1e9), 1);
  EXPECT_GT(counter.counts().reads, 30);
}

}  // namespace
}  // namespace filiform::test
