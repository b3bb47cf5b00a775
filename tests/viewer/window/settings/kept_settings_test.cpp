#include "viewer/window/settings/internal/kept_settings.h"

#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <filesystem>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

class KeptSettingsTest : public testing::Test {
 protected:
  const test::TempFolder folder;
  const test::Variable home{"XDG_CONFIG_HOME", folder / "config"};
  const std::string file = folder / "config/filiform/view.json";
  Messages messages;
};

TEST_F(KeptSettingsTest, AreThereAgainWithoutReset) {
  KeptSettings kept(false, messages);
  kept.now.orthographic = true;
  kept.save();
  EXPECT_TRUE(KeptSettings(false, messages).now.orthographic);
  EXPECT_FALSE(KeptSettings(true, messages).now.orthographic);
  EXPECT_EQ(messages.count(), 0u);
}

TEST_F(KeptSettingsTest, AreWrittenOnlyIfTheyChanged) {
  KeptSettings kept(false, messages);
  kept.save();
  std::filesystem::remove(file);
  kept.save();
  EXPECT_FALSE(std::filesystem::exists(file));
  kept.now.separation = 1.5;
  kept.save();
  EXPECT_TRUE(std::filesystem::exists(file));
}

TEST_F(KeptSettingsTest, SayThatTheirFileIsDamaged) {
  KeptSettings(false, messages).save();
  test::writeBytes(file, "{\"separation\": 1");
  EXPECT_EQ(KeptSettings(false, messages).now, Settings{});
  EXPECT_NE(messages.last().find("not a settings file"), std::string::npos);
}

}  // namespace
}  // namespace filiform::internal
