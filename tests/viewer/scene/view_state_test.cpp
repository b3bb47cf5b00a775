#include "viewer/scene/view_state.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

ViewState someView() {
  ViewState v;
  v.set = "column.fil";
  v.revision = "3";
  v.place = {"cell, \"one\"", {1.0 / 3, -2e5, 0.1}, {0, 1e-9, 1}};
  v.centre_W = {0.1, 0.2, 0.3};
  v.rotation_WD = Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()));
  v.zoom_um = 123.456;
  v.overview = true;
  v.look = {true, 0.1, -0.2, 0.5, 0.01, 0.02};
  v.camera = lookAt({10, 20, 30}, {1, 2, 3});
  v.size = {640, 360};
  v.orthographic = true;
  v.theme = Theme::light;
  v.colour_by = "measure:length";
  v.shows_some = true;
  v.shown = {"a", "b"};
  v.dimmed = {"b"};
  v.chosen = {"a"};
  v.highlighted = {"b"};
  v.hidden_types = 4;
  v.bookmarks = {{"bouton", {1, 2, 3}}};
  return v;
}

TEST(ViewStates, ComeBackToTheBit) {
  const ViewState v = someView();
  std::vector<std::string> notes;
  const std::string json = toJson(v);
  const ViewState read = viewStateOf(json, "v.json", notes);
  EXPECT_TRUE(notes.empty()) << notes.front();
  EXPECT_EQ(toJson(read), json);
  EXPECT_EQ(read.place->p_W, v.place->p_W);
  EXPECT_EQ(read.camera->rotation_VW, v.camera->rotation_VW);
  EXPECT_EQ(read.camera->eye_W, v.camera->eye_W);
  EXPECT_EQ(read.rotation_WD.coeffs(), v.rotation_WD.coeffs());
  ViewState all = v;
  all.shows_some = false;
  EXPECT_FALSE(viewStateOf(toJson(all), "v.json", notes).shows_some);
}

TEST(ViewStates, WhatStillHoldsIsUsedAndTheRestIsNamed) {
  std::vector<std::string> notes;
  const ViewState v = viewStateOf(
      R"({"filiform_view": 2, "zoom": 1, "overview": "yes", "camera": {"eye_um": [1, 2]}, "theme": "light",
          "workspace": {"centre_um": [1, 2, 3], "rotation": [9, 0, 0, 0], "zoom_um": 50}})",
      "v.json", notes);
  EXPECT_EQ(v.theme, Theme::light);
  EXPECT_FALSE(v.camera);
  EXPECT_EQ(v.zoom_um, ViewState{}.zoom_um) << "of a part with another form nothing is used";
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_NE(notes[0].find("newer version"), std::string::npos) << notes[0];
  EXPECT_NE(notes[1].find("another form in workspace, overview, camera"), std::string::npos) << notes[1];
  for (const char* const no_view : {"", "[]", "{}", "{\"filiform_view\": \"1\"}", "\xff\xfe"})
    EXPECT_THROW(viewStateOf(no_view, "v.json", notes), InputError);
}

}  // namespace
}  // namespace filiform
