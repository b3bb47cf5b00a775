// filiform view as a user runs it: in a window of a virtual display, with keys and mouse. Skipped without Xvfb or
// xdotool (tools/setup installs them). A short form runs always, except under sanitizers; the whole runs in the
// campaigns (tools/test --long). Screenshots stay in view-test/ beside the program.
#include "tests/support/golden.h"
#include "tests/viewer/display_fixture.h"
#include "viewer/scene/neurite_batches.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using Json = nlohmann::json;
using test::Display;
using test::kPatience_s;
using test::Outcome;
using test::refused;
using test::runFiliform;
using test::runFiliformInShell;
namespace fs = std::filesystem;

class View : public Display {
 protected:
  void SetUp() override {
    if (!test::wholeCampaign()) GTEST_SKIP() << "the whole of the window: set FILIFORM_CAMPAIGN";
    Display::SetUp();
  }
};
class ViewInShort : public Display {};

TEST_F(ViewInShort, ColoursAndSelectsCellsByAnAttribute) {
  const std::string circuit = *folder_ / "circuit", set = *folder_ / "circuit.fil";
  ASSERT_EQ(runFiliform({"synth", circuit, "--format", "sonata", "--cells", "8", "--library", "8"}).exit_code, 0);
  ASSERT_EQ(runFiliform({"ingest", circuit + "/circuit_config.json", "-o", set}).exit_code, 0);
  view("'" + set + "' --size 640x480 --segments 5000 --reset");
  await("a proxy on a neurite",
        [](const Json& s) { return s.at("open") == true && !s.at("cell").get<std::string>().empty(); });
  for (const ColourBy colouring : kColourings) {
    EXPECT_EQ(state().at("colour_by"), toString(colouring));
    EXPECT_EQ(state().at("attribute"), "");
    act("c");
  }
  await("the first attribute", [](const Json& s) { return s.at("attribute") == "layer"; });
  EXPECT_GT(state().at("legend_values"), 2);
  act("slash");
  sendAndDraw("type --delay 60 synapse_class=EXC");
  await("the condition", [](const Json& s) { return s.at("search_text") == "synapse_class=EXC"; });
  sendAndDraw("keydown Return");
  sendAndDraw("keyup Return");
  await("the selection", [](const Json& s) { return s.at("selected_cells") > 0 && s.at("search") == false; });
  EXPECT_EQ(state().at("selection"), "synapse_class=EXC");
  EXPECT_LT(state().at("selected_cells"), 8);
  act("w");
  await("a picture", [](const Json& s) { return s.at("pictures") == 1; });
  send("key q");
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
}

// By keys alone: the table sorts, measures and colours; contacts are found, and jumped across and back.
TEST_F(ViewInShort, ListsCellsColoursByAMeasureAndJumpsAcrossContacts) {
  test::writeBytes(*folder_ / "a.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 0 0 1 3\n");
  test::writeBytes(*folder_ / "b.swc", "1 1 20 40 0 5 -1\n2 2 20 20 1 1 1\n3 2 20 -30 1 1 2\n");
  const std::string set = *folder_ / "two.fil";
  ASSERT_EQ(runFiliform({"ingest", *folder_ / "a.swc", *folder_ / "b.swc", "-o", set}).exit_code, 0);
  view("'" + set + "' --size 900x600 --segments 5000 --reset --colour-by measure:length");
  await("the colours", [](const Json& s) { return s.at("attribute") == "measure:length"; });
  EXPECT_EQ(state().at("legend_values"), 2);
  await("a proxy on a neurite", [](const Json& s) { return !s.at("cell").get<std::string>().empty(); });
  act("n");
  await("the table", [](const Json& s) { return s.at("cells_listed") == 2 && s.at("cells_measured") == true; });
  EXPECT_EQ(state().at("first_cell_listed"), "a");
  sendAndDraw("type --delay 60 b");
  await("the filter", [](const Json& s) { return s.at("cells_listed") == 1; });
  EXPECT_EQ(state().at("first_cell_listed"), "b");
  sendAndDraw("keydown Return");
  sendAndDraw("keyup Return");
  await("the other cell", [](const Json& s) { return s.at("cell") == "b" && s.at("jumping") == false; });
  EXPECT_EQ(state().at("chosen_cell"), 1);
  act("Escape");
  EXPECT_EQ(state().at("cells_panel"), false);
  act("i");
  await("the contact", [](const Json& s) { return s.at("contacts") == 1 && s.at("contacts_of") == 1; });
  act("w");
  act("j");
  await("across", [](const Json& s) { return s.at("cell") == "a" && s.at("jumping") == false; });
  EXPECT_NEAR(state().at("p_um").at(0).get<double>(), 20, 0.01);
  act("j");
  await("back", [](const Json& s) { return s.at("cell") == "b" && s.at("jumping") == false; });
  EXPECT_NEAR(state().at("p_um").at(1).get<double>(), 0, 0.01);
  act("i");
  EXPECT_EQ(state().at("contacts"), 0);
  act("j");
  await("why not", [](const Json& s) { return s.at("message") == "no contact of this cell is marked (i)"; });
  send("key q");
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
  refused(runFiliformInShell(environment() + "exec \"$@\"", {"view", set, "--colour-by", "measure:lenght"}), 2,
          "did you mean 'length'");
  refused(runFiliformInShell(environment() + "exec \"$@\"", {"view", set, "--colour-by", "mood"}), 2, "mood");
}

// Without kept settings the scene is shown from afar, and no notes. The mouse needs no force plot.
TEST_F(ViewInShort, TheFirstStartShowsTheScene) {
  fs::remove(settings());
  const auto start = [&](bool overview) {
    view("'" + (*folder_ / "c.fil") + "' --size 640x480 --segments 5000 --theme light");
    await("a proxy on a neurite",
          [](const Json& s) { return s.at("open") == true && !s.at("cell").get<std::string>().empty(); });
    EXPECT_EQ(state().at("overview"), overview);
    EXPECT_EQ(state().at("force_panel"), false);
    EXPECT_EQ(state().at("theme"), "light");
    EXPECT_EQ(state().at("messages"), 0) << state().at("message");
  };
  start(true);
  act("w");
  await("a picture", [](const Json& s) { return s.at("pictures") == 1; });
  act("o");
  await("the workspace", [](const Json& s) { return s.at("overview") == false; });
  send("key q");
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
  start(false);
  send("key q");
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
}

TEST_F(ViewInShort, StartsShowsHelpTurnsZoomsSearchesJumpsTakesAPictureAndQuits) {
  view("'" + (*folder_ / "c.fil") + "' --size 480x320 --segments 5000 --reset");
  await("a proxy on a neurite",
        [](const Json& s) { return s.at("open") == true && !s.at("cell").get<std::string>().empty(); });
  act("h");
  EXPECT_EQ(state().at("help"), true);
  act("Escape");
  EXPECT_EQ(state().at("help"), false);

  const Json before = state();
  sendAndDraw("mousemove 300 120");
  sendAndDraw("mousedown 1");
  sendAndDraw("mousemove 360 140");
  sendAndDraw("mouseup 1");
  await("turned", [&](const Json& s) { return s.at("rotation") != before.at("rotation"); });
  sendAndDraw("mousedown 2");
  sendAndDraw("mousemove 330 130");
  sendAndDraw("mouseup 2");
  await("shifted", [](const Json& s) { return s.at("shift").at(0) > 0; });
  send("click 4");
  await("zoomed in", [&](const Json& s) { return s.at("zoom_um").get<double>() < before.at("zoom_um").get<double>(); });

  act("a");
  EXPECT_EQ(state().at("orthographic"), true);
  act("a");
  EXPECT_EQ(state().at("orthographic"), false);

  act("slash");
  sendAndDraw("type --delay 60 cell_00002");
  await("the name", [](const Json& s) { return s.at("search_text") == "cell_00002"; });
  sendAndDraw("keydown Return");
  sendAndDraw("keyup Return");
  await("the cell", [](const Json& s) {
    return s.at("cell") == "cell_00002" && s.at("search") == false && s.at("jumping") == false;
  });
  EXPECT_EQ(state().at("shift"), Json::array({0.0, 0.0}));
  const Json soma = state();
  act("v");
  await("the next fork", [&](const Json& s) { return s.at("p_um") != soma.at("p_um") && s.at("jumping") == false; });
  act("w");
  await("a picture", [](const Json& s) { return s.at("pictures") == 1; });
  EXPECT_EQ(test::readBytes(state()["last_picture"].get<std::string>()).substr(1, 3), "PNG");
  send("key q");
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
  EXPECT_EQ(test::readBytes(*folder_ / "err"), "");
}

// Apart from panels and messages, the window shows the pixels that `filiform render` draws.
TEST_F(ViewInShort, TheWindowAndRenderDrawTheSamePixels) {
  view("'" + (*folder_ / "c.fil") + "' --size 239x300 --segments 5000 --reset");  // too narrow for panels
  await("a proxy on a neurite",
        [](const Json& s) { return s.at("open") == true && !s.at("cell").get<std::string>().empty(); });
  act("o");
  await("everything at rest",
        [](const Json& s) { return s.at("overview") == true && s.at("complete") == true && s.at("moving") == false; });
  act("w");
  await("a picture", [](const Json& s) { return s.at("pictures") == 1; });
  Picture window = test::readPng(state()["last_picture"].get<std::string>());
  const std::string path = *folder_ / "same.png";
  ASSERT_EQ(
      runFiliform({"render", *folder_ / "c.fil", "-o", path, "--size", "239x300", "--segments", "5000"}).exit_code, 0);
  Picture rendered = test::readPng(path);
  ASSERT_EQ(window.rgb.size(), rendered.rgb.size());
  // Compare the upper half: it shows a cell. Messages and the ring around the proxy are in the lower half.
  const std::size_t part = window.rgb.size() / 2;
  window.rgb.resize(part);
  rendered.rgb.resize(part);
  window.height = rendered.height = 150;
  const auto lit = [](const Picture& picture) {
    return std::count_if(picture.rgb.begin(), picture.rgb.end(), [](std::uint8_t c) { return c > 60; });
  };
  EXPECT_GT(lit(rendered), 500);
  EXPECT_NEAR(static_cast<double>(lit(window)) / static_cast<double>(lit(rendered)), 1, 0.02);
  EXPECT_TRUE(test::compare(window, rendered).showsTheSame());
  send("key q");
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
}

// A held key repeats: a key that toggles acts once, a key that turns or zooms acts again.
TEST_F(ViewInShort, AHeldKeyRepeatsWhatTurnsAndZoomsAndNothingElse) {
  view("'" + (*folder_ / "y.swc") + "' --size 300x200 --reset");
  await("the file", [](const Json& s) { return s.at("cell") == "y" && s.at("tick") > 0; });
  const auto hold = [&](const std::string& key, const std::function<bool(const Json&)>& done) {
    send("keydown " + key);
    await(key + " held", done);
    send("keyup " + key);
  };
  for (const char* key : {"m", "p", "F1", "slash"}) {
    const Json before = state();
    hold(key, [&](const Json& s) { return s.at("key_repeats").get<int>() >= before.at("key_repeats").get<int>() + 5; });
    EXPECT_EQ(state()["actions"], before.at("actions").get<int>() + 1) << key;
  }
  EXPECT_EQ(state()["search_text"], "");
  act("Escape");  // the help
  act("Escape");  // the search
  await("one picture", [](const Json& s) { return s.at("pictures") == 1; });

  const Json before = state();
  hold("equal",
       [&](const Json& s) { return s.at("zoom_um").get<double>() < 0.5 * before.at("zoom_um").get<double>(); });
  hold("ctrl+Left", [&](const Json& s) { return s.at("actions").get<int>() >= before.at("actions").get<int>() + 12; });
  EXPECT_NE(state()["rotation"], before.at("rotation"));
  send("key q");
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
}

TEST_F(ViewInShort, ALargePictureIsDrawnBesideTheFramesAndCanBeCancelled) {
  view("'" + (*folder_ / "c.fil") + "' --size 480x320 --segments 5000 --reset");
  await("a proxy on a neurite",
        [](const Json& s) { return s.at("open") == true && !s.at("cell").get<std::string>().empty(); });
  act("o");
  await("everything", [](const Json& s) { return s.at("overview") == true && s.at("complete") == true; });
  act("P");
  await("the picture", [](const Json& s) { return s.at("pictures") == 1; });
  const Picture large = test::readPng(state()["last_picture"].get<std::string>());
  EXPECT_EQ(large.width, 3 * 480);
  EXPECT_EQ(large.height, 3 * 320);
  act("P");
  send("key Escape");
  await("cancelled, if Esc came in time", [](const Json& s) {
    return s.at("picture_part") == -1 && (s.at("message") == "the picture is cancelled" || s.at("pictures") == 2);
  });
  // Quitting does not wait for a picture that is being drawn.
  act("P");
  send("key --delay 3 q q");  // asks, then quits
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
}

// A file lease makes the opener wait, as a disk that does not answer.
TEST_F(ViewInShort, AFileThatNeverAnswersDoesNotKeepItFromEnding) {
  test::writeBytes(*folder_ / "silent.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n");
  std::signal(SIGIO, SIG_IGN);  // the signal that another process waits for the lease
  const int file = ::open((*folder_ / "silent.swc").c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_GE(file, 0);
  if (::fcntl(file, F_SETLEASE, F_WRLCK) != 0) GTEST_SKIP() << "this kernel or file system has no leases";
  view("'" + (*folder_ / "silent.swc") + "' --size 200x150");
  await("a window", [](const Json& s) { return s.at("frames") > 2; });
  send("key q");
  EXPECT_EQ(ended(), 3);
  const std::string said = test::readBytes(*folder_ / "err");
  EXPECT_NE(said.find("do not respond"), std::string::npos) << said;
  EXPECT_EQ(said.find('\n'), said.size() - 1);
  ::close(file);
}

TEST_F(ViewInShort, AStateThatCannotBeWrittenIsSaidAndEndsWithThree) {
  test::writeBytes(*folder_ / "state.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n");
  refused(runFiliformInShell(environment() + "exec \"$@\"", {"view", *folder_ / "state.swc", "--size", "200x150",
                                                             "--seconds", "0.5", "--state", "/dev/full"}),
          3, "/dev/full: cannot write: No space left");
}

TEST_F(ViewInShort, WithoutLevelsOfDetailItSaysWhatIsLeftOut) {
  ASSERT_EQ(runFiliform({"ingest", *folder_ / "c.zip", "-o", *folder_ / "flat.fil", "--capacity", "128", "--no-levels"})
                .exit_code,
            0);
  view("'" + (*folder_ / "flat.fil") + "' --size 300x200 --segments 1000");
  await("the advice",
        [](const Json& s) { return s.at("message").get<std::string>().find("--no-levels") != std::string::npos; });
  send("key q");
  EXPECT_EQ(ended(), 0);
}

TEST_F(ViewInShort, PicturesGoWhereALinkLeadsAndTheirFolderIsMade) {
  fs::create_directory(*folder_ / "shots");
  fs::create_directory_symlink("shots", *folder_ / "to_shots");
  test::writeBytes(*folder_ / "shot.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n");
  for (const std::string& place : {*folder_ / "to_shots", *folder_ / "made/new"}) {
    pictures_ = place;
    view("'" + (*folder_ / "shot.swc") + "' --size 200x150");
    await("the file", [](const Json& s) { return s.at("cell") == "shot"; });
    act("p");
    await("a picture", [](const Json& s) { return s.at("pictures") == 1; });
    EXPECT_EQ(std::distance(fs::directory_iterator(place), fs::directory_iterator()), 1);
    send("key q");
    EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
  }
  EXPECT_TRUE(fs::is_symlink(*folder_ / "to_shots"));
}

TEST_F(View, TravelsByKeysAndMouse) {
  view("'" + (*folder_ / "c.fil") + "' --size 900x600 --segments 20000 --reset");
  await("a proxy on a neurite",
        [](const Json& s) { return s.at("open") == true && !s.at("cell").get<std::string>().empty(); });

  type("key h");
  await("help", [](const Json& s) { return s.at("help") == true; });
  type("key w");
  await("a picture of the help", [](const Json& s) { return s.at("pictures") == 1; });
  type("key Escape");
  await("no help", [](const Json& s) { return s.at("help") == false; });

  const Json before = state();
  type("mousemove 600 200");
  type("mousedown 1");
  for (int x = 620; x <= 760; x += 35) type("mousemove " + std::to_string(x) + " 220");
  type("mouseup 1");
  await("turned", [&](const Json& s) { return s.at("rotation") != before.at("rotation"); });
  EXPECT_EQ(state()["p_um"], before.at("p_um"));
  type("click 4");
  await("zoomed in", [&](const Json& s) { return s.at("zoom_um").get<double>() < before.at("zoom_um").get<double>(); });

  type("key slash");
  await("search", [](const Json& s) { return s.at("search") == true; });
  type("type --delay 80 cell_00002");
  type("keydown Return");  // held for some frames, because the search ignores shorter strokes
  type("keyup Return");
  await("the cell", [](const Json& s) { return s.at("cell") == "cell_00002" && s.at("search") == false; });
  const Json soma = state();

  type("key x");
  type("key v");
  await("the next fork", [&](const Json& s) { return s.at("p_um") != soma.at("p_um") && s.at("jumping") == false; });
  await("a measured path", [](const Json& s) { return s.at("measured_um").get<double>() > 0; });
  type("key semicolon");
  type("key a");
  await("a bookmark", [](const Json& s) { return s.at("bookmarks") == Json::array({"a"}); });
  const Json marked = state();
  type("key BackSpace");
  await("back", [&](const Json& s) { return s.at("p_um") == soma.at("p_um"); });
  type("key apostrophe");
  type("key a");
  await("the bookmark", [&](const Json& s) { return s.at("p_um") == marked.at("p_um"); });

  // The hand pulls, and the proxy moves along its neurite.
  type("keydown Down");
  await("travelled by force",
        [&](const Json& s) { return s.at("p_um") != marked.at("p_um") && s.at("force_N") > 0.01; });
  type("keyup Down");
  type("key f");
  await("free", [](const Json& s) { return s.at("mode") == "free"; });
  type("key f");
  await("on a neurite again", [](const Json& s) { return s.at("mode") == "constrained"; });

  type("key s");
  await("stereo", [](const Json& s) { return s.at("stereo") == "anaglyph"; });
  type("key w");
  await("a picture of it", [](const Json& s) { return s.at("pictures") == 2; });
  type("key o");
  await("everything", [](const Json& s) { return s.at("overview") == true; });
  type("key p");
  await("a screenshot", [](const Json& s) { return s.at("pictures") == 3; });
  EXPECT_EQ(test::readBytes(state()["last_picture"].get<std::string>()).substr(1, 3), "PNG");
  type("key q");
  await("a question",
        [](const Json& s) { return s.at("message") == "the measurement would be lost: press q again to quit"; });
  type("key q");
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
  EXPECT_EQ(test::readBytes(*folder_ / "err"), "");

  // Settings, bookmarks and history are kept for the next start.
  view("'" + (*folder_ / "c.fil") + "' --segments 20000");
  await("the same again", [](const Json& s) {
    return s.at("stereo") == "anaglyph" && s.at("bookmarks") == Json::array({"a"}) && s.at("history") > 1;
  });
  type("key ctrl+q");
  EXPECT_EQ(ended(), 0);
}

// Damages all tile files, then removes the whole folder.
TEST_F(View, GoesOnWhenTheSetBreaksAndVanishesWhileOpen) {
  const std::string set = *folder_ / "breaks.fil";
  fs::copy(*folder_ / "c.fil", set, fs::copy_options::recursive);
  view("'" + set + "' --size 480x320 --segments 5000 --reset --budget 600KiB");
  await("a proxy on a neurite",
        [](const Json& s) { return s.at("open") == true && !s.at("cell").get<std::string>().empty(); });
  const Json before = state();
  for (const auto& entry : fs::recursive_directory_iterator(set)) {
    if (entry.path().extension() != ".pack" && entry.path().filename().string().find("pack") == std::string::npos)
      continue;
    std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(16);
    const std::string noise(static_cast<std::size_t>(entry.file_size()) - 16, '\x5a');
    file.write(noise.data(), static_cast<std::streamsize>(noise.size()));
  }
  for (const char* name : {"cell_00000", "cell_00001", "cell_00002", "cell_00003"}) {
    act("slash");
    sendAndDraw(std::string("type --delay 80 ") + name);
    sendAndDraw("keydown Return");
    sendAndDraw("keyup Return");
    act("Escape");
  }
  await("a word of it", [&](const Json& s) { return s.at("messages") > before.at("messages"); });
  EXPECT_NE(state().at("search_error"), "") << state();
  fs::remove_all(set);
  const auto tick = state().at("tick").get<std::uint64_t>();
  act("o");
  sendAndDraw("click 4");
  await("the hand goes on", [&](const Json& s) { return s.at("tick") > tick + 200; });
  send("key q");
  EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
  EXPECT_EQ(test::readBytes(*folder_ / "err"), "");
}

TEST_F(View, OpensAFileAtOnceAndReplaysWhatWasDone) {
  view("'" + (*folder_ / "y.swc") + "' --size 300x200 --record '" + (*folder_ / "y.rec") + "'");
  await("the file", [](const Json& s) { return s.at("cell") == "y" && s.at("tick") > 0; });
  type("key v");
  await("the fork", [](const Json& s) { return s.at("sample") == 3 && s.at("jumping") == false; });
  type("keydown Right");
  await("travelled on", [](const Json& s) { return s.at("p_um").at(0) > 21; });
  type("keyup Right");
  type("key q");
  ASSERT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
  const Json done = state();
  view("'" + (*folder_ / "y.swc") + "' --size 300x200 --device 'replay:" + (*folder_ / "y.rec") + "'");
  await("the end of the recording", [](const Json& s) { return s.at("replay_ended") == true; });
  type("key q");
  ASSERT_EQ(ended(), 0);
  for (const char* field : {"tick", "p_um", "h_um", "zoom_um", "centre_um", "rotation", "segment", "t", "force_N"})
    EXPECT_EQ(state()[field], done.at(field)) << field;
}

TEST(ViewWithout, ADisplayItSaysWhatToDo) {
  const Outcome outcome = runFiliformInShell("unset DISPLAY; exec \"$@\"", {"view", "none.fil"});
  refused(outcome, 3, "filiform render");
  EXPECT_NE(outcome.err.find("xvfb-run"), std::string::npos) << outcome.err;
}

TEST_F(View, WhatCannotBeIsOneClearLine) {
  const std::string file = *folder_ / "y.swc";
  const std::string shell = environment() + "exec \"$@\"";
  refused(runFiliformInShell(shell, {"view", *folder_ / "none.fil"}), 3, "none.fil");
  refused(runFiliformInShell(shell, {"view", file, "--device", "trackball"}), 2, "mouse");
  refused(runFiliformInShell(shell, {"view", file, "--size", "wide"}), 2, "WIDTHxHEIGHT");
  refused(runFiliformInShell(shell, {"view", file, "--method", "magic"}), 2, "climb");
  refused(runFiliformInShell("MESA_GL_VERSION_OVERRIDE=2.1 " + shell, {"view", file}), 3, "OpenGL 3.3");
}

}  // namespace
}  // namespace filiform
