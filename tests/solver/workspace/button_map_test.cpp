#include "solver/workspace/button_map.h"

#include "index/errors.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"
#include "tests/support/what_of.h"

#include <fstream>
#include <string>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(ButtonMap, IsReadFromTextAndWritten) {
  using enum ButtonAction;
  const ButtonMap map = parseButtons("0=mode,1=turn,2=zoom-in,7=mode-turn");
  EXPECT_EQ(map, (ButtonMap{toggle_mode, turn, zoom_in, none, none, none, none, mode_turn}));
  EXPECT_EQ(buttonsText(map), "0=mode,1=turn,2=zoom-in,7=mode-turn");
  EXPECT_EQ(parseButtons(buttonsText({})), ButtonMap{});
}

TEST(ButtonMap, WrongTextIsRefusedInOneLine) {
  const auto refusal = [](const std::string& text) { return test::whatOf<UsageError>([&] { parseButtons(text); }); };
  for (const char* const text : {"", "0", "0=", "8=mode", "-1=mode", "mode", "0=mode,", "0 = mode", "00=mode"})
    EXPECT_NE(refusal(text).find("write BUTTON=ACTION with a button 0 to 7, as in 0=mode,1=turn"), std::string::npos)
        << text << ": " << refusal(text);
  EXPECT_NE(refusal("0=fly").find("--buttons '0=fly': no such action; choose one of mode, centre, zoom-in"),
            std::string::npos);
  EXPECT_EQ(refusal("0=mode,0=turn"), "--buttons '0=turn': the button has two actions: leave one out");
}

TEST(ButtonMap, EachNumberOfButtonsReachesTheClutchAndBothZooms) {
  using enum ButtonAction;
  for (int buttons = 1; buttons <= 8; ++buttons) {
    DeviceCapabilities can;
    can.buttons = buttons;
    can.senses_orientation = true;
    const ButtonMap map = defaultButtons(can);
    const auto has = [&map](ButtonAction action) { return std::find(map.begin(), map.end(), action) != map.end(); };
    EXPECT_TRUE(has(turn) || has(mode_turn)) << buttons;
    EXPECT_TRUE(has(toggle_mode) || has(mode_turn)) << buttons;
    EXPECT_TRUE(has(zoom) || has(mode_turn) || (has(zoom_in) && has(zoom_out))) << buttons;
    EXPECT_NO_THROW(requireButtons(map, can)) << buttons;
  }
}

TEST(ButtonMap, AButtonThatTheDeviceLacksIsRefused) {
  using enum ButtonAction;
  DeviceCapabilities can;
  can.name = "a grip";
  const auto refusal = [&] { return test::whatOf<UsageError>([&] { requireButtons({none, turn}, can); }); };
  EXPECT_NE(refusal().find("button 1=turn: a grip has no buttons; change --buttons"), std::string::npos) << refusal();
  can.buttons = 1;
  EXPECT_NE(refusal().find("a grip has one button, 0; "), std::string::npos) << refusal();
  can.buttons = 2;
  EXPECT_NO_THROW(requireButtons({none, turn}, can));
}

TEST(ButtonMap, IsSavedForEachDevice) {
  using enum ButtonAction;
  const test::TempFolder folder;
  const test::Variable config("XDG_CONFIG_HOME", folder.path());
  EXPECT_EQ(savedButtons("a"), std::nullopt);
  saveButtons("a", {turn});
  saveButtons("b \"c\"", {none, zoom});
  saveButtons("a", {carry});
  EXPECT_EQ(savedButtons("a"), (ButtonMap{carry}));
  EXPECT_EQ(savedButtons("b \"c\""), (ButtonMap{none, zoom}));
  EXPECT_EQ(savedButtons("d"), std::nullopt);
}

TEST(ButtonMap, ADamagedFileIsRefusedInOneLine) {
  using enum ButtonAction;
  const test::TempFolder folder;
  const test::Variable config("XDG_CONFIG_HOME", folder.path());
  saveButtons("a", {turn});
  for (const char* const text : {"", "{", "[]", "7", "\xff\xfe"}) {
    std::ofstream(buttonsFile()) << text;
    const std::string refusal = test::whatOf<InputError>([] { savedButtons("a"); });
    EXPECT_NE(refusal.find("buttons.json: is damaged: remove it, then run filiform devices --setup again"),
              std::string::npos)
        << refusal;
    EXPECT_THROW(saveButtons("a", {turn}), InputError);
  }
  for (const char* const text : {R"({"a": 3})", R"({"a": "0=fly"})", R"({"a": "0=mode,0=turn"})"}) {
    std::ofstream(buttonsFile()) << text;
    const std::string refusal = test::whatOf<InputError>([] { savedButtons("a"); });
    EXPECT_NE(refusal.find("run filiform devices --setup again"), std::string::npos) << refusal;
    EXPECT_EQ(refusal.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace filiform
