// Whole pictures against those in tests/viewer/golden/, with a tolerance (tests/support/golden.h). After a change that
// is meant: FILIFORM_GOLDEN=renew build/dev/filiform_viewer_tests --gtest_filter='GoldenPictures.*', and look at them.
#include "tests/support/golden.h"

#include "index/ingest/memory_tiles.h"
#include "solver/workspace/workspace.h"
#include "tests/support/folders.h"
#include "tests/support/scenes/random_cells.h"
#include "tools/pictures/png.h"
#include "viewer/gl/scene_view.h"

#include <cstdlib>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// With a soma at its origin.
Cell neuron(std::uint64_t seed, std::uint32_t samples, const Vector3d& origin_W) {
  test::NeuronShape shape;
  shape.samples = samples;
  shape.step_um = 6;
  shape.extra_root = 0;
  shape.origin_W = origin_W;
  Cell cell = test::randomNeuron(seed, shape);
  cell.types[0] = 1;
  cell.radii_um[0] = 7;
  return cell;
}

std::unique_ptr<TileStore> tilesInMemory(std::vector<Cell> cells) {
  CellList stream(std::move(cells));
  return buildTilesInMemory(stream, {.capacity = 128});
}

class GoldenPictures : public ::testing::Test {
 protected:
  GoldenPictures() {
    std::vector<Cell> cells;
    for (std::uint64_t i = 0; i < 3; ++i)
      cells.push_back(neuron(20 + i, 260, {45.0 * static_cast<double>(i), 20.0 * static_cast<double>(i % 2), 0}));
    store_ = tilesInMemory(std::move(cells));
  }

  // Draws the picture, and compares it with the file or renews the file.
  Picture check(const std::string& name, SceneFrame&& frame) { return check(name, std::move(frame), *store_); }
  Picture check(const std::string& name, SceneFrame&& frame, const TileStore& store) {
    frame.size = {200, 140};
    Renderer renderer(*context_);
    SceneView scene(store, nullptr, renderer);
    if (frame.workspace != nullptr)
      frame.camera = workspaceCamera(*frame.workspace, eyeSize(frame.stereo, frame.size).aspect());
    else
      frame.camera = overview(scene.lo_W(), scene.hi_W(), 0.3, 0.2, eyeSize(frame.stereo, frame.size).aspect());
    scene.drawWhole(frame);
    const Picture drawn = renderer.read();
    std::string path = test::inSource("tests/viewer/golden/");
    path += name;
    path += ".png";
    const char* const wish = std::getenv("FILIFORM_GOLDEN");
    if (wish != nullptr && std::string(wish) == "renew") tools::writePng(drawn, path);
    const test::PictureDifference difference = test::compare(drawn, test::readPng(path));
    if (!difference.showsTheSame()) {
      std::string drawn_path = "golden-";
      drawn_path += name;
      drawn_path += ".png";
      tools::writePng(drawn, drawn_path);
      ADD_FAILURE() << name << ": mean difference " << difference.mean << ", far off " << difference.far_off
                    << "; the picture is " << drawn_path << " in the folder of the test";
    }
    return drawn;
  }

  SceneFrame nearFork(StereoMode stereo = StereoMode::mono) {
    SceneFrame frame;
    frame.stereo = stereo;
    const auto tile = store_->load(0);
    workspace_.place(tile->position_W(5), workspace_.centre_D());
    workspace_.rotate(0.2, 0.3, tile->position_W(5));
    frame.workspace = &workspace_;
    frame.proxy_W = tile->position_W(5);
    junction_.p_W = tile->position_W(5) + Vector3d(6, 2, 0);
    const auto branch = [&](const Vector3d& to, bool own) {
      Branch b;
      b.points_W = {junction_.p_W, junction_.p_W + to / 2, junction_.p_W + to};
      b.own = own;
      junction_.branches.push_back(b);
    };
    junction_.branches.clear();
    branch({-12, -4, 2}, true);
    branch({10, 9, 0}, false);
    branch({13, -6, -4}, false);
    frame.junction = &junction_;
    return frame;
  }

  std::unique_ptr<GraphicsContext> context_ = makeOffscreenContext();
  std::unique_ptr<TileStore> store_;
  Workspace workspace_{WorkspaceOptions{.zoom_um = 90}};
  Junction junction_;
};

TEST_F(GoldenPictures, Overview) { check("overview", {}); }
TEST_F(GoldenPictures, NearAFork) { check("near", nearFork()); }
TEST_F(GoldenPictures, Anaglyph) { check("anaglyph", nearFork(StereoMode::anaglyph)); }

TEST_F(GoldenPictures, HighlightedCell) {
  SceneFrame frame;
  frame.cells = {1};
  frame.orthographic = true;
  check("highlight", std::move(frame));
}

// An archive whose cells all have their somata at the origin: the first picture inside shows the proxy's cell.
TEST_F(GoldenPictures, OwnCellInAPileAtTheOrigin) {
  std::vector<Cell> cells;
  for (std::uint64_t i = 0; i < 60; ++i) cells.push_back(neuron(100 + i, 400, Vector3d::Zero()));
  const std::unique_ptr<TileStore> pile = tilesInMemory(std::move(cells));
  workspace_.place(Vector3d::Zero(), workspace_.centre_D());
  workspace_.setZoom(300, Vector3d::Zero());
  SceneFrame frame;
  frame.workspace = &workspace_;
  frame.proxy_W = Vector3d::Zero();
  frame.cells = {7};
  check("pile", std::move(frame), *pile);
}

// The pictures differ so much that the comparison notices one in the place of another.
TEST_F(GoldenPictures, NoneStandsForAnother) {
  std::vector<Picture> all;
  for (const char* name : {"overview.png", "near.png", "anaglyph.png", "highlight.png", "pile.png"}) {
    std::string path = test::inSource("tests/viewer/golden/");
    path += name;
    all.push_back(test::readPng(path));
  }
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_FALSE(test::compare(all[i], all[j]).showsTheSame()) << i << ' ' << j;
}

}  // namespace
}  // namespace filiform
