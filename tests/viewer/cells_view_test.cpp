// Cells, bookmarks, commands and views in the window of filiform view, by keys and mouse, as a user has them.
#include "tests/support/golden.h"
#include "tests/viewer/display_fixture.h"

#include <cmath>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::Display;
using test::refused;
using test::runFiliform;
using test::runFiliformInShell;

class CellsInWindow : public Display {
 protected:
  void SetUp() override {
    Display::SetUp();
    if (IsSkipped()) return;
    test::writeBytes(*folder_ / "a.swc", "1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 90 0 0 1 3\n");
    test::writeBytes(*folder_ / "b.swc", "1 1 20 40 0 5 -1\n2 2 20 20 1 1 1\n3 2 20 -30 1 1 2\n");
    test::writeBytes(*folder_ / "c.swc", "1 1 50 40 0 5 -1\n2 2 50 20 1 1 1\n3 2 50 -30 1 1 2\n");
    set_ = *folder_ / (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".fil");
    ASSERT_EQ(runFiliform({"ingest", *folder_ / "a.swc", *folder_ / "b.swc", *folder_ / "c.swc", "-o", set_}).exit_code,
              0);
  }
  void begin(const std::string& options) {
    view("'" + set_ + "' --size 700x500 --segments 5000 " + options);
    await("a proxy on a neurite",
          [](const test::Json& s) { return s.at("open") == true && !s.at("cell").get<std::string>().empty(); });
  }
  void end() {
    send("key q");
    EXPECT_EQ(ended(), 0) << test::readBytes(*folder_ / "err");
  }
  void awaitCells(std::uint64_t hidden, std::uint64_t dimmed) {
    await("cells", [&](const test::Json& s) {
      return s.at("hidden_cells") == hidden && s.at("dimmed_cells") == dimmed && s.at("complete") == true;
    });
  }
  std::string set_;
};

TEST_F(CellsInWindow, AreIsolatedHiddenDimmedInvertedAndShown) {
  begin("--reset --only a --only b --highlight b");
  awaitCells(1, 0);
  EXPECT_EQ(state().at("chosen_cells"), test::Json({1}));
  EXPECT_EQ(state().at("segments"), 5) << "of a and b alone";
  act("I");
  awaitCells(2, 0);
  EXPECT_EQ(state().at("segments"), 2);
  act("exclam");
  awaitCells(1, 0);
  act("A");
  awaitCells(0, 0);
  EXPECT_EQ(state().at("segments"), 7);
  act("D");
  awaitCells(0, 1);
  act("A");
  awaitCells(0, 0);
  // By the words of a command.
  act("ctrl+p");
  sendAndDraw("type --delay 60 isolate");
  await("the words", [](const test::Json& s) { return s.at("commands") == "isolate"; });
  sendAndDraw("keydown Return");
  sendAndDraw("keyup Return");
  awaitCells(2, 0);
  EXPECT_EQ(state().at("commands_open"), false);
  end();
  refused(runFiliformInShell(environment() + "exec \"$@\"", {"view", set_, "--only", "no_such_cell"}), 2,
          "no_such_cell");
  refused(runFiliformInShell(environment() + "exec \"$@\"", {"view", *folder_ / "a.swc", "--only", "a"}), 2, "a file");
}

TEST_F(CellsInWindow, AClickChoosesAndARightClickTellsWhatIsThere) {
  begin("--reset --theme light");
  act("u");
  act("v");
  await("rest", [](const test::Json& s) { return s.at("jumping") == false && s.at("moving") == false; });
  const auto at = [&](const std::string& what) {
    const test::Json px = state().at("proxy_px");
    sendAndDraw("mousemove " + std::to_string(px.at(0).get<int>()) + " " + std::to_string(px.at(1).get<int>()));
    sendAndDraw(what);
  };
  at("click 1");
  await("the choice", [](const test::Json& s) { return s.at("chosen_cells").size() == 1; });
  at("click 3");
  await("the menu", [](const test::Json& s) { return !s.at("neurite_menu").get<std::string>().empty(); });
  const std::string menu = state().at("neurite_menu");
  EXPECT_NE(menu.find("\u00b5m from the soma"), std::string::npos) << menu;
  EXPECT_NE(menu.find("radius 1 "), std::string::npos) << menu;
  EXPECT_NE(state().at("neurite").get<std::string>().find("from the soma"), std::string::npos);
  act("Escape");
  EXPECT_EQ(state().at("neurite_menu"), "");
  end();
}

TEST_F(CellsInWindow, AViewAndBookmarksComeBack) {
  const std::string file = pictures_ + "/view.json";
  std::filesystem::remove(file);
  begin("--reset --colour-by type");
  act("B");
  sendAndDraw("type --delay 60 bouton");
  sendAndDraw("keydown Return");
  sendAndDraw("keyup Return");
  await("the bookmark", [](const test::Json& s) { return s.at("bookmarks") == test::Json({"bouton"}); });
  act("Escape");
  act("H");
  act("ctrl+Left");
  act("ctrl+Up");
  awaitCells(1, 0);
  await("rest", [](const test::Json& s) { return s.at("moving") == false && s.at("pending") == 0; });
  act("p");
  await("a picture", [](const test::Json& s) { return s.at("pictures") == 1; });
  const test::Json before = state();
  act("V");
  await("the file", [&](const test::Json&) { return std::filesystem::exists(file); });
  end();
  const std::string drawn = *folder_ / "drawn.png";
  const auto rendered = runFiliform({"render", set_, "--view", file, "-o", drawn});
  ASSERT_EQ(rendered.exit_code, 0) << rendered.err;
  EXPECT_TRUE(test::compare(test::readPng(before.at("last_picture")), test::readPng(drawn)).showsTheSame());
  std::filesystem::remove_all(*folder_ / "config/filiform/places");
  begin("--view '" + file + "'");
  awaitCells(1, 0);
  await("the turn", [&](const test::Json& s) {
    double off = 0;
    for (std::size_t i = 0; i < 4; ++i)
      off += std::abs(s.at("rotation").at(i).get<double>() - before.at("rotation").at(i).get<double>());
    return off < 1e-6 && s.at("zoom_um") == before.at("zoom_um") && s.at("bookmarks") == test::Json({"bouton"});
  });
  EXPECT_EQ(state().at("colour_by"), "type");
  end();
  refused(runFiliform({"render", set_, "--view", *folder_ / "a.swc", "-o", drawn}), 1, "no view");
}

}  // namespace
}  // namespace filiform
