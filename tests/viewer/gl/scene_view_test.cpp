// Frames while tiles are loaded: no frame waits, each place is drawn once, and the figures count what is missing.
#include "viewer/gl/scene_view.h"

#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/ingest/memory_tiles.h"
#include "index/set/tile_set.h"
#include "solver/workspace/workspace.h"
#include "tests/support/golden.h"
#include "tests/support/scenes/counting_store.h"
#include "tests/support/scenes/far_folder.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <chrono>
#include <set>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::CountingStore;

class SceneViews : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    context_ = makeOffscreenContext();
    folder_ = std::make_unique<test::TempFolder>();
    CellList stream(test::randomColumn(7, 6, 1000, 200));
    IngestOptions options;
    options.capacity = 128;
    options.levels = true;
    ingest(stream, *folder_ / "a.fil", options);
    set_ = TileSet::open(*folder_ / "a.fil");
    levels_ = Levels::open(*set_);
    CellList again(test::randomColumn(7, 6, 1000, 200));
    store_ = buildTilesInMemory(again, {.capacity = 128});
  }
  static void TearDownTestSuite() {
    context_.reset();
    levels_.reset();
    set_.reset();
    store_.reset();
    folder_.reset();
  }

  SceneFrame frameOf(const SceneView& scene, double yaw_rad = 0) const {
    SceneFrame frame;
    frame.size = {160, 100};
    frame.camera = overview(scene.lo_W(), scene.hi_W(), yaw_rad, 0, frame.size.aspect());
    frame.budget.samples = frame.budget.moving_samples = 1;
    frame.moving = false;
    frame.budget.enough_px = 0;
    return frame;
  }
  // Draws frames until no tile is pending.
  SceneFigures settle(SceneView& scene, const SceneFrame& frame) {
    for (int i = 0; i < 10000; ++i) {
      const SceneFigures figures = scene.draw(frame);
      if (figures.pending == 0) return figures;
      scene.waitForTiles(1);
    }
    ADD_FAILURE() << "never complete";
    return {};
  }

  static inline std::unique_ptr<GraphicsContext> context_;
  static inline std::unique_ptr<test::TempFolder> folder_;
  static inline std::unique_ptr<TileSet> set_;
  static inline std::unique_ptr<Levels> levels_;
  static inline std::unique_ptr<TileStore> store_;
  Renderer renderer_{*context_};
};

std::uint64_t ownedBy(const TileStore& store) {
  std::uint64_t all = 0;
  for (TileId tile = 0; tile < store.tile_count(); ++tile) all += store.entry(tile).owned;
  return all;
}

std::size_t drawnTiles(const TileStore& store) {
  std::size_t count = 0;
  for (TileId tile = 0; tile < store.tile_count(); ++tile) count += store.entry(tile).owned > 0;
  return count;
}

TEST_F(SceneViews, FramesEndAtThePictureOfAllTiles) {
  SceneView scene(*store_, nullptr, renderer_);
  const SceneFigures figures = settle(scene, frameOf(scene));
  EXPECT_TRUE(figures.complete);
  EXPECT_EQ(figures.segments, ownedBy(*store_));
  EXPECT_EQ(figures.left_out, 0u);
  const Picture frames = renderer_.read();

  Renderer other(*context_);
  SceneView at_once(*store_, nullptr, other);
  std::size_t last = 0;
  at_once.drawWhole(frameOf(at_once), [&](std::size_t done, std::size_t all) {
    EXPECT_LE(done, all);
    EXPECT_GE(done, last);
    last = done;
  });
  EXPECT_EQ(last, drawnTiles(*store_));
  EXPECT_EQ(other.read().rgb, frames.rgb);
}

TEST_F(SceneViews, MarksAreBallsThatAppearAndVanish) {
  SceneView scene(*store_, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  const auto marked = [&] {
    settle(scene, frame);
    scene.drawWhole(frame);
    const Picture picture = renderer_.read();
    int pixels = 0;
    for (std::size_t i = 0; i + 2 < picture.rgb.size(); i += 3)
      pixels += picture.rgb[i] > 150 && picture.rgb[i + 1] < 110 && picture.rgb[i + 2] > 110 ? 1 : 0;
    return pixels;
  };
  const int none = marked();
  const Vector3d middle_W = 0.5 * (scene.lo_W() + scene.hi_W());
  frame.marks_W = std::make_shared<std::vector<Vector3d>>(std::vector<Vector3d>{middle_W});
  const int one = marked();
  EXPECT_GT(one, none + 10);
  frame.marks_W = std::make_shared<std::vector<Vector3d>>(
      std::vector<Vector3d>{middle_W, middle_W + 60 * Vector3d::UnitX(), middle_W - 60 * Vector3d::UnitX()});
  EXPECT_GT(marked(), one + 20);
  frame.marks_W.reset();
  EXPECT_EQ(marked(), none);
}

TEST_F(SceneViews, NoFrameWaitsForATile) {
  CountingStore slow(*store_);
  slow.delayLoads(std::chrono::milliseconds(2));
  SceneView scene(slow, nullptr, renderer_);
  const SceneFrame frame = frameOf(scene);
  const SceneFigures first = scene.draw(frame);
  EXPECT_FALSE(first.complete);
  EXPECT_TRUE(first.has_gaps);
  EXPECT_EQ(first.pending + first.tiles, drawnTiles(*store_));
  EXPECT_EQ(first.left_out + first.segments, ownedBy(*store_));
  const SceneFigures last = settle(scene, frame);
  EXPECT_EQ(last.left_out, 0u);
  EXPECT_EQ(slow.loads().size(), drawnTiles(*store_));  // each once
}

TEST_F(SceneViews, UploadsOfAFrameAreCapped) {
  SceneView scene(*store_, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  frame.budget.upload_bytes = 1;
  std::uint32_t uploads = 0;
  for (std::uint32_t i = 0; uploads < drawnTiles(*store_) && i < 10000; ++i) {
    const SceneFigures figures = scene.draw(frame);
    EXPECT_LE(figures.uploads, 1u);
    uploads += figures.uploads;
    if (figures.uploads == 0) scene.waitForTiles(1);
  }
  EXPECT_EQ(uploads, drawnTiles(*store_));
}

// The error on the screen falls with each tile. No place is drawn twice: drawn and left out segments add up to the
// whole. No stand-in remains at the end.
TEST_F(SceneViews, CoarseTilesStandInUntilFinerOnesCome) {
  SceneView scene(*set_, levels_.get(), renderer_);
  SceneFrame frame = frameOf(scene);
  frame.budget.upload_bytes = 1;
  const std::uint64_t all = ownedBy(*set_);
  bool stood_in = false;
  double error_px = INFINITY;
  SceneFigures figures;
  for (int i = 0; i < 10000 && !figures.complete; ++i) {
    figures = scene.draw(frame);
    if (figures.uploads == 0) scene.waitForTiles(1);
    if (figures.segments == 0) continue;
    EXPECT_LE(figures.error_px, error_px);
    error_px = figures.error_px;
    stood_in = stood_in || figures.stand_ins > 0;
    EXPECT_LE(figures.segments, all);
  }
  EXPECT_TRUE(stood_in);
  EXPECT_EQ(figures.stand_ins, 0u);
  EXPECT_EQ(figures.segments, all);
  EXPECT_EQ(figures.left_out, 0u);
  EXPECT_EQ(figures.error_px, 0);
  const Picture frames = renderer_.read();
  Renderer other(*context_);
  SceneView at_once(*set_, levels_.get(), other);
  at_once.drawWhole(frameOf(at_once));
  EXPECT_EQ(other.read().rgb, frames.rgb);
}

TEST_F(SceneViews, FromFarAwayNoFrameReadsTheDirectory) {
  auto source = std::make_unique<test::FarFolder>(*folder_ / "a.fil");
  const test::FarFolder& far = *source;
  const auto set = TileSet::open(std::move(source));
  const auto levels = Levels::open(*set);
  SceneView scene(*set, levels.get(), renderer_);
  const SceneFrame frame = frameOf(scene);
  const SceneFigures first = scene.draw(frame);
  EXPECT_GT(first.pending, 0u);
  EXPECT_EQ(far.directory_reads_here, 0);
  const SceneFigures figures = settle(scene, frame);
  EXPECT_EQ(far.directory_reads_here, 0);
  EXPECT_GT(far.directory_reads, 0);
  EXPECT_TRUE(figures.complete);
  EXPECT_EQ(figures.segments, ownedBy(*set));
  const Picture frames = renderer_.read();

  Renderer other(*context_);
  SceneView near(*set_, levels_.get(), other);
  near.drawWhole(frameOf(near));
  EXPECT_EQ(other.read().rgb, frames.rgb);
}

TEST_F(SceneViews, LessIsDrawnWhileTheCameraMoves) {
  SceneView scene(*set_, levels_.get(), renderer_);
  SceneFrame frame = frameOf(scene);
  frame.moving.reset();
  frame.budget.moving_segments = 1000;
  SceneFigures figures = settle(scene, frame);
  EXPECT_TRUE(figures.moving);  // the first frame counts as motion: there was no camera before
  EXPECT_LE(figures.segments, 1000u);
  EXPECT_GT(figures.error_px, 0);
  frame.time_s = SceneFrame::kRest_s + 0.01;
  figures = settle(scene, frame);
  EXPECT_FALSE(figures.moving);
  EXPECT_EQ(figures.segments, ownedBy(*set_));
  frame.camera = orbit(frame.camera, 0.01, 0);
  figures = scene.draw(frame);
  EXPECT_TRUE(figures.moving);
  EXPECT_LE(figures.segments, 1000u);
  EXPECT_GT(figures.segments, 0u);
}

// Tiles that arrive cost no picture while others still hide them: the first picture shows coarse tiles, the second all.
TEST_F(SceneViews, LoadingDrawsTheFirstPictureAndTheCompleteOne) {
  for (const Levels* levels : {static_cast<const Levels*>(nullptr), static_cast<const Levels*>(levels_.get())}) {
    SceneView scene(*set_, levels, renderer_);
    SceneFrame frame = frameOf(scene);
    frame.budget.upload_bytes = 1;
    int pictures = 0;
    SceneFigures figures;
    for (int i = 0; i < 10000 && !figures.complete; ++i) {
      figures = scene.draw(frame);
      pictures += figures.redrawn ? 1 : 0;
      if (figures.uploads == 0) scene.waitForTiles(1);
    }
    EXPECT_TRUE(figures.complete);
    EXPECT_EQ(pictures, 2);
    const Picture frames = renderer_.read();
    Renderer other(*context_);
    SceneView at_once(*set_, levels, other);
    at_once.drawWhole(frameOf(at_once));
    EXPECT_EQ(other.read().rgb, frames.rgb);
  }
}

// While tiles arrive slowly, a picture a second shows those that came.
TEST_F(SceneViews, SlowLoadingDrawsOnePictureASecond) {
  CountingStore slow(*store_);
  slow.delayLoads(std::chrono::milliseconds(2));
  SceneView scene(slow, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  frame.budget.upload_bytes = 1;
  int pictures = 0, frames = 0;
  for (SceneFigures figures; !figures.complete && frames < 10000; ++frames) {
    frame.time_s = frames / 20.0;
    figures = scene.draw(frame);
    pictures += figures.redrawn ? 1 : 0;
    if (figures.uploads == 0) scene.waitForTiles(1);
  }
  EXPECT_GT(pictures, 2);
  EXPECT_LE(pictures, 2 + frames / 20);
}

TEST_F(SceneViews, WhatDidNotChangeIsNotDrawnAgain) {
  SceneView scene(*store_, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  EXPECT_TRUE(settle(scene, frame).redrawn);
  scene.draw(frame);
  EXPECT_FALSE(scene.draw(frame).redrawn);
  Workspace workspace({.zoom_um = 50});
  frame.workspace = &workspace;
  EXPECT_TRUE(scene.draw(frame).redrawn);
  EXPECT_FALSE(scene.draw(frame).redrawn);
  workspace.rotate(0.1, 0, Vector3d::Zero());
  EXPECT_TRUE(scene.draw(frame).redrawn);
  frame.proxy_W = Vector3d(1, 2, 3);
  EXPECT_TRUE(scene.draw(frame).redrawn);
  frame.size = {100, 100};
  EXPECT_TRUE(scene.draw(frame).redrawn);
  EXPECT_FALSE(scene.draw(frame).redrawn);
}

// A hand that moves the proxy is motion, even if the camera rests: fewer segments are drawn. A trembling hand is not.
TEST_F(SceneViews, AProxyThatMovesIsMotionAndOneThatTremblesIsNot) {
  SceneView scene(*store_, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  const double px_um = frame.size.height / (2 * std::tan(frame.camera.height_angle_rad / 2)) / frame.camera.focus_um;
  frame.proxy_W = frame.camera.focus_W();
  settle(scene, frame);
  frame.time_s += 10;
  frame.moving.reset();
  EXPECT_FALSE(scene.draw(frame).moving);
  frame.proxy_W->x() += 0.1 / px_um;
  frame.time_s += 0.01;
  EXPECT_FALSE(scene.draw(frame).redrawn);
  frame.proxy_W->x() += 5 / px_um;
  frame.time_s += 0.01;
  const SceneFigures figures = scene.draw(frame);
  EXPECT_TRUE(figures.redrawn);
  EXPECT_TRUE(figures.moving);
  frame.time_s += 1;
  EXPECT_FALSE(scene.draw(frame).moving);
}

TEST_F(SceneViews, FrozenTilesStay) {
  SceneView scene(*set_, levels_.get(), renderer_);
  SceneFrame frame = frameOf(scene);
  frame.budget.enough_px = 3;
  const SceneFigures before = settle(scene, frame);
  frame.frozen = true;
  frame.camera = orbit(frame.camera, 0.3, 0.1, 0.2);
  EXPECT_EQ(settle(scene, frame).segments, before.segments);
  frame.frozen = false;
  EXPECT_NE(settle(scene, frame).tiles, before.tiles);
}

TEST_F(SceneViews, ATileThatCannotBeReadIsSaidAndTriedAgain) {
  CountingStore broken(*store_);
  broken.failLoads(1, 1);
  SceneView scene(broken, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  SceneFigures figures = settle(scene, frame);
  ASSERT_EQ(figures.failed.size(), 1u);
  EXPECT_NE(figures.failed[0].find("tile 1"), std::string::npos) << figures.failed[0];
  EXPECT_FALSE(figures.complete);
  EXPECT_EQ(figures.left_out, store_->entry(1).owned);
  frame.time_s = 60;
  for (int i = 0; i < 100 && !figures.complete; ++i) {
    scene.waitForTiles(1);
    figures = scene.draw(frame);
  }
  EXPECT_TRUE(figures.complete);
  EXPECT_EQ(broken.loads(1), 2u);

  broken.failLoads(2);
  SceneView at_once(broken, nullptr, renderer_);
  EXPECT_THROW(at_once.drawWhole(frame), CorruptTile);
}

TEST_F(SceneViews, AHighlightThatCannotBeReadIsTriedAgain) {
  CountingStore broken(*store_);
  SceneView scene(broken, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  settle(scene, frame);
  frame.cells = {0};
  broken.failLoads(broken.loadCellDetail(0).tiles.front(), 1);
  SceneFigures figures = settle(scene, frame);
  ASSERT_EQ(figures.failed.size(), 1u);
  EXPECT_NE(figures.failed[0].find("cell "), std::string::npos) << figures.failed[0];
  frame.time_s = 60;
  for (int i = 0; i < 100 && !figures.complete; ++i) {
    scene.waitForTiles(1);
    figures = scene.draw(frame);
  }
  EXPECT_TRUE(figures.complete);
}

TEST_F(SceneViews, WhatIsNotDrawnLeavesTheCardWhenItIsFull) {
  SceneView scene(*set_, levels_.get(), renderer_);
  SceneFrame frame = frameOf(scene);
  const std::uint64_t all = settle(scene, frame).card_bytes;
  frame.camera = lookAt(frame.camera.eye_W, frame.camera.eye_W + Vector3d(0, 0, 1));  // away
  frame.budget.card_bytes = all / 2;
  settle(scene, frame);
  EXPECT_LE(renderer_.bytes(), all / 2);
  EXPECT_GT(all, 0u);
}

TEST_F(SceneViews, OtherColoursAndStatesOfCellsShowInTheNextFrameAndUploadNothing) {
  SceneView scene(*store_, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  settle(scene, frame);
  const Picture by_cell = renderer_.read();
  const std::uint64_t bytes = renderer_.bytes();
  const auto next = [&] {
    const SceneFigures figures = scene.draw(frame);
    EXPECT_TRUE(figures.redrawn && figures.complete);
    EXPECT_EQ(figures.uploads, 0u);
    EXPECT_EQ(figures.segments, ownedBy(*store_));
    EXPECT_EQ(renderer_.bytes(), bytes);
    return renderer_.read();
  };
  for (const ColourBy colour : kColourings) {
    if (colour == ColourBy::cell) continue;
    frame.colour = colour;
    EXPECT_NE(next().rgb, by_cell.rgb) << toString(colour);
  }
  frame.colour = ColourBy::cell;
  EXPECT_EQ(next().rgb, by_cell.rgb);

  const auto lit = [](const Picture& picture) {
    std::uint64_t sum = 0;
    for (const std::uint8_t value : picture.rgb) sum += value;
    return sum;
  };
  CellStates states(store_->cell_count(), CellState::dimmed);
  frame.states = std::make_shared<CellStates>(states);
  const std::uint64_t dimmed = lit(next());
  states[0] = CellState::shown;
  frame.states = std::make_shared<CellStates>(states);
  const std::uint64_t one = lit(next());
  states.assign(states.size(), CellState::hidden);
  frame.states = std::make_shared<CellStates>(states);
  const std::uint64_t none = lit(next());
  EXPECT_GT(lit(by_cell), one);
  EXPECT_GT(one, dimmed);
  EXPECT_GT(dimmed, none);
  const Rgba ground = frame.background;
  EXPECT_EQ(none, std::uint64_t{160} * 100 * (ground.r + ground.g + ground.b));
  frame.states = nullptr;
  EXPECT_EQ(next().rgb, by_cell.rgb);
}

std::shared_ptr<const CellStates> only(const TileStore& store, std::vector<std::uint32_t> cells) {
  auto states = std::make_shared<CellStates>(store.cell_count(), CellState::hidden);
  for (const std::uint32_t cell : cells) (*states)[cell] = CellState::shown;
  return states;
}

TEST_F(SceneViews, IsolatedCellsAloneAreReadAndCounted) {
  CountingStore counted(*store_);
  SceneView scene(counted, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  frame.states = only(counted, {1, 3});
  const SceneFigures figures = settle(scene, frame);
  EXPECT_TRUE(figures.complete);
  EXPECT_EQ(figures.segments, counted.cell(1).segments + counted.cell(3).segments);
  std::set<TileId> own;
  for (const std::uint32_t cell : {1U, 3U})
    for (const TileId tile : counted.loadCellDetail(cell).tiles) own.insert(tile);
  for (const TileId tile : counted.loads()) EXPECT_TRUE(own.contains(tile)) << "tile " << tile << " has none of them";
}

TEST_F(SceneViews, IsolatedCellsAreShownAtOnceFromWhatIsThereAndLookTheSameThen) {
  SceneView scene(*store_, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  settle(scene, frame);
  const Picture all = renderer_.read();
  frame.states = only(*store_, {2});
  SceneFigures figures = scene.draw(frame);
  EXPECT_TRUE(figures.redrawn);
  const Picture at_once = renderer_.read();
  EXPECT_NE(at_once.rgb, all.rgb);
  figures = settle(scene, frame);
  figures = scene.draw(frame);
  EXPECT_EQ(figures.tiles, 0u) << "the cell alone is drawn";
  EXPECT_EQ(figures.segments, store_->cell(2).segments);
  EXPECT_TRUE(test::compare(renderer_.read(), at_once).showsTheSame());
  frame.states = nullptr;
  figures = scene.draw(frame);
  EXPECT_EQ(figures.uploads, 0u) << "the tiles are still on the card";
  settle(scene, frame);
  EXPECT_EQ(renderer_.read().rgb, all.rgb);
  // A whole picture needs no frame before it.
  frame.states = only(*store_, {2});
  SceneView at_rest(*store_, nullptr, renderer_);
  EXPECT_EQ(at_rest.drawWhole(frame).segments, store_->cell(2).segments);
}

TEST_F(SceneViews, LeavesNothingOnTheCard) {
  {
    SceneView scene(*store_, nullptr, renderer_);
    SceneFrame frame = frameOf(scene);
    frame.proxy_W = Vector3d::Zero();
    settle(scene, frame);
    EXPECT_GT(renderer_.bytes(), 0u);
  }
  EXPECT_EQ(renderer_.bytes(), 0u);
}

// A picture in parts: frames between the parts keep the picture before. A new view abandons it.
TEST_F(SceneViews, APictureInPartsEndsAtTheOneDrawnAtOnceUnlessTheViewChanges) {
  SceneView scene(*set_, levels_.get(), renderer_);
  SceneFrame frame = frameOf(scene);
  settle(scene, frame);
  frame.camera = orbit(frame.camera, 0.3, 0.1);
  frame.budget.part_ms = 1e-3;
  const Picture before = renderer_.read();
  SceneFigures figures = scene.draw(frame);
  ASSERT_TRUE(figures.drawing);
  EXPECT_FALSE(figures.redrawn);
  EXPECT_FALSE(figures.complete);
  EXPECT_EQ(renderer_.read().rgb, before.rgb);
  frame.camera = orbit(frame.camera, 0.3, 0.1);
  int frames = 0;
  for (figures = scene.draw(frame); figures.drawing && frames < 10000; ++frames) figures = scene.draw(frame);
  EXPECT_TRUE(figures.redrawn);
  EXPECT_GT(frames, 3);
  figures = settle(scene, frame);
  while (figures.drawing || !figures.complete) figures = scene.draw(frame);
  Renderer other(*context_);
  SceneView at_once(*set_, levels_.get(), other);
  at_once.drawWhole(frame);
  EXPECT_TRUE(test::compare(renderer_.read(), other.read()).showsTheSame());
  EXPECT_FALSE(scene.draw(frame).redrawn);
}

TEST_F(SceneViews, AnotherThemeChangesTheGroundAndTheProxy) {
  SceneView scene(*store_, nullptr, renderer_);
  SceneFrame frame = frameOf(scene);
  frame.proxy_W = frame.camera.focus_W();
  settle(scene, frame);
  const auto brightness = [&](int x, int y) { return static_cast<int>(test::colourAt(renderer_.read(), x, y).g); };
  EXPECT_EQ(brightness(2, 2), groundOf(Theme::dark).g);
  EXPECT_GT(brightness(80, 50), 120);
  frame.background = groundOf(Theme::light);
  EXPECT_TRUE(scene.draw(frame).redrawn);
  EXPECT_EQ(brightness(2, 2), groundOf(Theme::light).g);
  EXPECT_LT(brightness(80, 50), 120);
}

// A picture in motion that takes longer than its part has larger pixels; at rest it has those of the screen.
TEST_F(SceneViews, ALatePictureInMotionIsDrawnAtOnceWithLargerPixels) {
  SceneView scene(*set_, levels_.get(), renderer_);
  SceneFrame frame = frameOf(scene);
  settle(scene, frame);
  frame.moving = true;
  frame.budget.moving_part_ms = 1e-3;
  SceneFigures figures;
  for (int i = 0; i < 3; ++i) {
    frame.camera = orbit(frame.camera, 0.3, 0.1);
    figures = scene.draw(frame);
    EXPECT_FALSE(figures.drawing);
    EXPECT_TRUE(figures.redrawn);
    EXPECT_EQ(figures.stretch, SceneBudget::kMostStretch);
    EXPECT_EQ(renderer_.read().width, frame.size.width / SceneBudget::kMostStretch);
  }
  frame.moving = false;
  figures = settle(scene, frame);
  EXPECT_EQ(figures.stretch, 1);
  EXPECT_EQ(renderer_.read().width, frame.size.width);
  // Rows of the two eyes in turn stay those of the screen.
  frame.moving = true;
  frame.stereo = StereoMode::row_interleaved;
  EXPECT_TRUE(scene.draw(frame).redrawn);
  EXPECT_EQ(renderer_.read().height, frame.size.height);
}

TEST_F(SceneViews, AWholePictureInPartsIsTheOneDrawnAtOnceAndLoadsBesideTheCalls) {
  SceneView at_once(*set_, levels_.get(), renderer_);
  SceneFrame frame = frameOf(at_once);
  at_once.drawWhole(frame);
  const Picture whole = renderer_.read();

  CountingStore slow(*set_);
  slow.delayLoads(std::chrono::milliseconds(1));
  Renderer other(*context_);
  SceneView scene(slow, nullptr, other);
  frame.budget.segments = 2'000'000;
  double part = 0, last = 0;
  int calls = 0;
  for (; part < 1; ++calls) {
    part = scene.advanceWhole(frame, 0.1);
    EXPECT_GE(part, last);
    last = part;
    if (part < 0.5) scene.waitForTiles(1);
  }
  EXPECT_GT(calls, 4);
  EXPECT_TRUE(test::compare(other.read(), whole).showsTheSame());
  slow.delayLoads(std::chrono::milliseconds(0));
  // Its loading thread ends on another thread.
  const std::shared_ptr<void> end = scene.end();
  EXPECT_EQ(other.bytes(), 0u);
}

}  // namespace
}  // namespace filiform
