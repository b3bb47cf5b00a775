#include "viewer/window/settings/settings.h"

#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(SettingsFile, ComesBackAsItWasSaved) {
  const test::TempFolder folder;
  Settings saved;
  saved.colouring = ColourBy::radius;
  saved.stereo = StereoMode::top_bottom;
  saved.orthographic = saved.orange_blue = saved.reduced_motion = saved.show_tiles = true;
  saved.show_minimap = saved.own_cell = false;
  saved.separation = 1.25;
  saved.width = 640;
  saved.save(folder / "a/b/view.json");
  std::string warning;
  const Settings read = Settings::load(folder / "a/b/view.json", warning);
  EXPECT_EQ(warning, "");
  EXPECT_EQ(read.colouring, ColourBy::radius);
  EXPECT_EQ(read.stereo, StereoMode::top_bottom);
  EXPECT_TRUE(read.orthographic && read.orange_blue && read.reduced_motion && read.show_tiles && !read.show_minimap &&
              !read.own_cell);
  EXPECT_EQ(read.separation, 1.25);
  EXPECT_EQ(read.width, 640);
}

TEST(SettingsFile, WhatMakesNoSenseIsTheDefault) {
  const test::TempFolder folder;
  std::string warning;
  EXPECT_EQ(Settings::load(folder / "none.json", warning).width, 1280);
  EXPECT_EQ(warning, "");
  test::writeBytes(folder / "odd.json",
                   R"({"separation": 99, "width": "wide", "stereo": "4d", "orange_blue": 3, "widening": 1.5})");
  const Settings odd = Settings::load(folder / "odd.json", warning);
  EXPECT_EQ(warning, "");
  EXPECT_EQ(odd.separation, 1);
  EXPECT_EQ(odd.width, 1280);
  EXPECT_EQ(odd.stereo, StereoMode::mono);
  EXPECT_FALSE(odd.orange_blue);
  EXPECT_EQ(odd.widening, 1.5);
  test::writeBytes(folder / "torn.json", "{\"width\": 1");
  EXPECT_EQ(Settings::load(folder / "torn.json", warning).width, 1280);
  EXPECT_NE(warning.find("torn.json"), std::string::npos);
}

}  // namespace
}  // namespace filiform
