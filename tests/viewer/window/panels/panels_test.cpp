// Tests panels by Dear ImGui's lists of triangles, without a window.
#include "viewer/window/panels/panels.h"

#include "index/set/forwarding_store.h"
#include "tests/support/process.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/temp_folder.h"
#include "viewer/window/internal/letters.h"
#include "viewer/window/internal/system_fonts.h"
#include "viewer/window/panels/internal/cell_choice.h"
#include "viewer/window/panels/internal/cell_table.h"
#include "viewer/window/panels/internal/command_panel.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <imgui.h>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::Letters;

class Panels : public ::testing::Test {
 protected:
  Panels() {
    ImGui::CreateContext();
    ImGui::GetIO().IniFilename = nullptr;
    ImGui::GetIO().DeltaTime = 0.02F;
    letters_.build(1);
  }
  ~Panels() override { ImGui::DestroyContext(); }

  // Dear ImGui knows the size of a panel after one or two frames.
  void draw(const PictureSize& size, double scale = 1) {
    if (letters_.isStale()) letters_.build(scale);
    data_.size = size;
    data_.scale = scale;
    ImGui::GetIO().DisplaySize = {static_cast<float>(size.width), static_cast<float>(size.height)};
    ImGui::GetIO().MousePos = {static_cast<float>(pointer_x_), static_cast<float>(pointer_y_)};
    for (int frame = 0; frame < 4; ++frame) {
      ImGui::NewFrame();
      requests_ = drawPanels(data_, tiles_, open_, search_, settings_);
      ImGui::Render();
    }
  }
  const ImDrawList* listOf(const char* panel) const {
    const ImDrawData& drawn = *ImGui::GetDrawData();
    for (int i = 0; i < drawn.CmdListsCount; ++i)
      if (std::strcmp(drawn.CmdLists[i]->_OwnerName, panel) == 0) return drawn.CmdLists[i];
    return nullptr;
  }
  float leftOf(const char* panel) const {
    const ImDrawList* list = listOf(panel);
    if (list == nullptr) return -1;
    return std::min_element(list->VtxBuffer.begin(), list->VtxBuffer.end(),
                            [](const auto& a, const auto& b) { return a.pos.x < b.pos.x; })
        ->pos.x;
  }
  // The corners of letters, which are the triangles with a texture, and how far they reach.
  struct Written {
    int corners = 0;
    float left = 1e9F, right = 0;
    bool inside = true;  // all are inside the visible part of the panel
  };
  Written written(const char* panel) const {
    Written written;
    const ImDrawList* list = listOf(panel);
    if (list == nullptr) return written;
    const ImVec2 white = ImGui::GetIO().Fonts->TexUvWhitePixel;
    for (const ImDrawCmd& command : list->CmdBuffer)
      for (unsigned i = 0; i < command.ElemCount; ++i) {
        const ImDrawVert& corner = list->VtxBuffer[list->IdxBuffer[static_cast<int>(command.IdxOffset + i)]];
        if (corner.uv.x == white.x && corner.uv.y == white.y) continue;
        ++written.corners;
        written.left = std::min(written.left, corner.pos.x);
        written.right = std::max(written.right, std::min(corner.pos.x, command.ClipRect.z));
        written.inside &= corner.pos.x <= command.ClipRect.z + 1 && corner.pos.x >= command.ClipRect.x - 1;
      }
    return written;
  }

  // Of a panel and of the tables in it, which Dear ImGui draws as windows of their own.
  int lettersIn(const std::string& panel) const {
    int corners = 0;
    const ImDrawData& drawn = *ImGui::GetDrawData();
    for (int i = 0; i < drawn.CmdListsCount; ++i)
      if (const std::string name = drawn.CmdLists[i]->_OwnerName; name == panel || name.starts_with(panel + "/"))
        corners += written(name.c_str()).corners;
    return corners / 6;
  }

  Letters letters_{internal::findFonts(internal::fontFolders())};
  PanelData data_;
  TilePanel tiles_;
  OpenPanels open_;
  SearchPanel search_;
  Settings settings_;
  PanelRequests requests_;
  double pointer_x_ = -1, pointer_y_ = -1;
};

TEST_F(Panels, TheHelpIsWholeInWindowsOfAnySize) {
  open_.help = true;
  draw({5000, 4000});
  const Written whole = written("keys and mouse");
  EXPECT_GT(whole.corners, 5000);
  EXPECT_TRUE(whole.inside);
  draw({1280, 800});
  EXPECT_EQ(written("keys and mouse").corners, whole.corners);
  EXPECT_TRUE(written("keys and mouse").inside);
  // In smaller windows the help scrolls vertically, never horizontally.
  for (const PictureSize& size : {PictureSize{900, 700}, {640, 480}, {400, 300}}) {
    draw(size);
    EXPECT_TRUE(written("keys and mouse").inside) << size.width;
    EXPECT_GT(written("keys and mouse").corners, 500) << size.width;
  }
}

TEST_F(Panels, LongNamesEndBeforeTheNextPanelAndAreWholeUnderThePointer) {
  const std::vector<float> forces(100, 1);
  data_.force.last_N = &forces;
  data_.force.shown = true;
  data_.status.scene = data_.status.cell = std::string(400, 'w');
  data_.status.device = "mouse";
  draw({1000, 700});
  EXPECT_LT(written("status").right, leftOf("force"));
  EXPECT_GT(written("status").right, 500);
  EXPECT_EQ(written("##Tooltip_00").corners, 0);
  pointer_x_ = 200;
  pointer_y_ = 22;  // on the scene's name
  draw({1000, 700});
  EXPECT_GE(written("##Tooltip_00").corners, 400 * 6);
  EXPECT_TRUE(written("##Tooltip_00").inside);
}

TEST_F(Panels, TypesHaveALegendWithoutAttributesToo) {
  draw({1000, 700});
  EXPECT_EQ(listOf("attributes"), nullptr);
  data_.colours.legend = &legendOfTypes();
  draw({1000, 700});
  EXPECT_GT(written("attributes").corners, 6 * 40);
}

TEST_F(Panels, ForceAndHandAreShownOnDemand) {
  const std::vector<float> forces(100, 1);
  data_.force.last_N = &forces;
  data_.status.device = "mouse";
  data_.status.mode = "constrained";
  draw({1000, 700});
  EXPECT_EQ(listOf("force"), nullptr);
  const int corners = written("status").corners;
  data_.force.shown = true;
  draw({1000, 700});
  EXPECT_NE(listOf("force"), nullptr);
  EXPECT_GT(written("status").corners, corners + 6 * 20);
}

TEST_F(Panels, MessagesEndBeforeTheMinimapAndTheScaleBar) {
  data_.map.lo_W = Vector3d::Zero();
  data_.map.hi_W = Vector3d(300, 300, 300);
  data_.map.zoom_um = 100;
  data_.um_px = 1;
  data_.lines.messages = {"a"};
  draw({900, 600});
  const auto background = [&] { return written("##Background"); };
  const Written one = background();
  data_.lines.messages = {std::string("a word ") + std::string(300, 'm') + " and more words"};
  draw({900, 600});
  EXPECT_GT(background().corners, one.corners + 300 * 6);
  EXPECT_GT(background().left, written("minimap").right);
  EXPECT_GT(written("minimap").right, 150);
}

TEST_F(Panels, ACompanionIsShownByNameAndPull) {
  data_.companion.name = "anna";
  draw({900, 600});
  const int none = written("##Background").corners;
  data_.companion.proxy = ScreenPoint{400, 300, 50};
  draw({900, 600});
  const int named = written("##Background").corners;
  EXPECT_GT(named, none);
  data_.companion.hand = ScreenPoint{460, 300, 50};
  data_.companion.force_N = 1.5;
  draw({900, 600});
  EXPECT_GT(written("##Background").corners, named) << "the force";
  data_.companion.proxy->depth_um = -1;
  draw({900, 600});
  EXPECT_EQ(written("##Background").corners, none) << "behind the eye";
}

TEST_F(Panels, NamesAreShownAsTheyAreAndChosenWhole) {
  open_.search = true;
  const auto cornersOf = [&](const std::string& name) {
    search_.names = {name};
    draw({1000, 700});
    return written("go to").corners;
  };
  const int none = cornersOf("");
  EXPECT_EQ(cornersOf("axon##2"), none + 7 * 6);
  EXPECT_EQ(cornersOf("100%s%n"), none + 7 * 6);
  EXPECT_EQ(cornersOf("##"), none + 2 * 6);
  // A long name is cut at the rim.
  const int cut = cornersOf(std::string(300, '#')) - none;
  EXPECT_GT(cut, 20 * 6);
  EXPECT_LT(cut, 200 * 6);
  EXPECT_TRUE(written("go to").inside);
}

// A set of very many cells, of which only the table of cells is read.
class ManyCells : public ForwardingStore {
 public:
  explicit ManyCells(const TileStore& empty) : ForwardingStore(empty), records_(100'000) {
    const std::string scripts[] = {"n", "\u03B1", "\u0416", "\u4E2D"};
    for (std::size_t i = 0; i < records_.size(); ++i) {
      for (int letter = 0; letter < 200; ++letter) records_[i].name += scripts[i % 4];
      records_[i].name += "##" + std::to_string(i);
    }
  }
  bool isRemote() const override { return true; }  // then it is not measured unasked
  std::uint32_t cell_count() const override { return static_cast<std::uint32_t>(records_.size()); }
  const CellRecord& cell(std::uint32_t id) const override { return records_[id]; }

 private:
  std::vector<CellRecord> records_;
};

TEST_F(Panels, TheTableOfCellsWritesOnlyTheRowsInView) {
  draw({1000, 700});
  EXPECT_EQ(listOf("cells"), nullptr);
  const auto nothing = test::storeOf({});
  const ManyCells many(*nothing);
  internal::CellTable table(many, nullptr);
  internal::CellChoice choice(many.cell_count());
  data_.cells.table = &table;
  data_.cells.choice = &choice;
  open_.cells.open = true;
  table.open();
  draw({1000, 700});
  for (table.serve(); table.isListing(); table.serve()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ASSERT_EQ(table.rows().size(), 100'000U);
  for (const PictureSize& size : {PictureSize{1000, 700}, {400, 300}, {2000, 1400}}) {
    draw(size, size.width == 2000 ? 2 : 1);
    EXPECT_GT(open_.cells.seen.size(), 1U);
    EXPECT_LT(open_.cells.seen.size(), 200U);
    for (const std::uint32_t cell : open_.cells.seen) letters_.want(table.text(cell, 0));
    draw(size, size.width == 2000 ? 2 : 1);
    EXPECT_GT(lettersIn("cells"), 100) << size.width;
    EXPECT_LT(lettersIn("cells"), 200 * 60) << "names are cut where the column ends";
  }
  EXPECT_FALSE(requests_.choose_cells);
  EXPECT_EQ(requests_.act, Action::none);
}

// All that a press of a key does can be found by its words.
TEST_F(Panels, TheCommandsHaveEveryActionOfAKey) {
  std::size_t keys = 0;
  for (const Binding& binding : bindings()) {
    if (binding.first.code == Key::kNone || binding.held == Held::pushes || binding.action == Action::commands)
      continue;
    ++keys;
    const std::vector<const Binding*> found = internal::commandsFor(binding.what);
    ASSERT_FALSE(found.empty()) << binding.what;
    EXPECT_NE(std::find(found.begin(), found.end(), &binding), found.end()) << binding.what;
  }
  EXPECT_EQ(internal::commandsFor("").size(), keys);
  ASSERT_EQ(internal::commandsFor("HIDE chosen").size(), 1u);
  EXPECT_EQ(internal::commandsFor("HIDE chosen").front()->action, Action::hide_cells);
  EXPECT_TRUE(internal::commandsFor("ide").empty()) << "words begin so";
  EXPECT_TRUE(internal::commandsFor(std::string(60'000, 'x')).empty());
  draw({1000, 700});
  EXPECT_EQ(listOf("commands"), nullptr);
  open_.commands.open = open_.commands.focus = true;
  for (const PictureSize& size : {PictureSize{1000, 700}, {300, 200}}) {
    draw(size);
    EXPECT_GT(lettersIn("commands") + listOf("commands")->VtxBuffer.Size, 10);
    EXPECT_EQ(requests_.act, Action::none);
  }
}

TEST_F(Panels, BookmarksAreListedAndAMenuStaysInTheWindow) {
  data_.map.bookmark_names = {"a", std::string(300, 'w'), "##c"};
  data_.map.bookmarks_W.assign(3, Vector3d(1, 2, 3));
  open_.bookmarks.open = true;
  draw({1000, 700});
  EXPECT_GT(lettersIn("bookmarks"), 20);
  open_.menu = {
      .open = true, .x = 990, .y = 690, .title = std::string(300, 'w'), .text = "axon", .copied = {}, .place = {}};
  draw({1000, 700});
  EXPECT_GT(lettersIn("neurite"), 60);
  EXPECT_LT(written("neurite").right, 1000);
  EXPECT_TRUE(open_.menu.open);
}

TEST_F(Panels, APictureThatIsDrawnTellsHowFarItIsAndOneThatIsWrittenCannotBeCancelled) {
  draw({1000, 700});
  EXPECT_EQ(listOf("picture"), nullptr);
  data_.picture.text = "picture of 3000 x 2100 pixels";
  data_.picture.part = 0.5;
  draw({1000, 700});
  const int drawn = written("picture").corners;
  EXPECT_FALSE(requests_.cancel_picture);
  data_.picture.part = -1;
  draw({1000, 700});
  EXPECT_LT(written("picture").corners, drawn);
}

// With the fonts of Debian (tools/setup installs them).
TEST_F(Panels, LettersOfOtherScriptsAreThere) {
  if (internal::findFonts(internal::fontFolders()).empty()) GTEST_SKIP() << "no font that is known: run tools/setup";
  const ImFont* font = ImGui::GetIO().Fonts->Fonts[0];
  for (const int character : {0x61, 0xB5, 0x131, 0x3BC, 0x3A9, 0x416, 0x2190, 0x2192, 0x2264, 0x2026})
    EXPECT_NE(font->FindGlyphNoFallback(static_cast<ImWchar>(character)), nullptr) << std::hex << character;
  ASSERT_NE(font->FallbackGlyph, nullptr);
  EXPECT_GT(font->FallbackGlyph->X1, font->FallbackGlyph->X0);  // visible

  // Other characters are added when they are wanted, if a font has them. DejaVu Sans has U+10A0 (Georgian).
  EXPECT_EQ(font->FindGlyphNoFallback(0x10A0), nullptr);
  letters_.want("cell");
  EXPECT_FALSE(letters_.isStale());
  letters_.want("\u10A0");
  EXPECT_TRUE(letters_.isStale());
  letters_.want("\U0001F9E0 \xFF\xE4");  // above U+FFFF, and invalid UTF-8
  letters_.build(1);
  EXPECT_FALSE(letters_.isStale());
  font = ImGui::GetIO().Fonts->Fonts[0];
  const bool dejavu = internal::findFonts(internal::fontFolders()).front().filename() == "DejaVuSans.ttf";
  EXPECT_TRUE(!dejavu || font->FindGlyphNoFallback(0x10A0) != nullptr);
  // A character that no font has is drawn as one replacement sign.
  data_.status.scene = "\U0001F9E0\uE123";
  draw({1000, 700});
  const int two = written("status").corners;
  data_.status.scene = "ab";
  draw({1000, 700});
  EXPECT_EQ(written("status").corners, two);
}

TEST_F(Panels, AFontIsReadOnce) {
  const auto fonts = internal::findFonts(internal::fontFolders());
  if (fonts.empty() || fonts.front().filename() != "DejaVuSans.ttf") GTEST_SKIP() << "no DejaVu Sans: run tools/setup";
  test::TempFolder folder;
  std::filesystem::copy_file(fonts.front(), folder / "DejaVuSans.ttf");
  letters_ = Letters({folder / "DejaVuSans.ttf"});
  letters_.build(1);
  std::filesystem::remove(folder / "DejaVuSans.ttf");
  letters_.want("\u10A0");
  letters_.build(1);
  EXPECT_NE(ImGui::GetIO().Fonts->Fonts[0]->FindGlyphNoFallback(0x10A0), nullptr);
}

TEST_F(Panels, LettersWithoutAFontAreTheBuiltInOnes) {
  test::TempFolder folder;
  test::writeBytes(folder / "DejaVuSans.ttf", "no font");
  std::filesystem::create_directories(folder / "deeper");
  test::writeBytes(folder / "deeper/wqy-zenhei.ttc", "nor this");
  const auto fonts = internal::findFonts({folder / "none", std::filesystem::path(folder / "deeper").parent_path()});
  ASSERT_EQ(fonts.size(), 2u);
  EXPECT_EQ(fonts[1].filename(), "wqy-zenhei.ttc");
  EXPECT_TRUE(internal::findFonts({folder / "deeper"}).empty());  // no main font
  letters_ = Letters(fonts);
  letters_.want("\u4E2D");
  letters_.build(2);
  EXPECT_NE(ImGui::GetIO().Fonts->Fonts[0]->FindGlyphNoFallback('a'), nullptr);
  data_.status.scene = "\u4E2D";
  draw({1000, 700}, 2);
  EXPECT_GT(written("status").corners, 6);
}

}  // namespace
}  // namespace filiform
