#include "viewer/window/settings/bindings.h"

#include "tests/support/folders.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(Bindings, EveryInputDoesOneThing) {
  std::vector<Key> keys;
  std::set<Action> actions;
  std::set<std::string> names, gestures;
  for (const Binding& binding : bindings()) {
    EXPECT_TRUE(actions.insert(binding.action).second) << binding.name;
    EXPECT_TRUE(names.insert(binding.name).second) << binding.name;
    EXPECT_FALSE(inputsOf(binding).empty()) << binding.name;
    EXPECT_NE(*binding.what, 0) << binding.name;
    for (const Key& key : {binding.first, binding.second}) {
      if (key.code == Key::kNone) continue;
      for (const Key& other : keys) EXPECT_FALSE(other == key) << toString(key);
      keys.push_back(key);
      EXPECT_EQ(actionOf(key), binding.action);
    }
    EXPECT_TRUE(*binding.mouse == 0 || gestures.insert(binding.mouse).second) << binding.mouse;
  }
  EXPECT_EQ(actionOf(Key{}), Action::none);
  EXPECT_EQ(actionOf(Key{'y', 0}), Action::none);
}

TEST(Bindings, KeysAreNamedAsPeopleWriteThem) {
  EXPECT_EQ(toString(Key{'v', 0}), "v");
  EXPECT_EQ(toString(Key{' ', 0}), "Space");
  EXPECT_EQ(toString(Key{Key::kLeft, Key::kAlt}), "Alt+Left");
  EXPECT_EQ(toString(Key{'q', Key::kControl}), "Ctrl+q");
  EXPECT_EQ(inputsOf(bindingOf(Action::help)), "h, F1");
}

TEST(Bindings, AHeldKeyRepeatsMovesOfTheViewAndStepsAlone) {
  EXPECT_EQ(actionOf(Key{'p', 0}, false), Action::screenshot);
  EXPECT_EQ(actionOf(Key{'p', 0}, true), Action::none);
  EXPECT_EQ(actionOf(Key{'m', 0}, true), Action::none);
  EXPECT_EQ(actionOf(Key{'q', Key::kControl}, true), Action::none);
  EXPECT_EQ(actionOf(Key{Key::kBackspace, 0}, true), Action::none);
  EXPECT_EQ(actionOf(Key{'z', 0}, true), Action::none);
  EXPECT_EQ(actionOf(Key{'+', 0}, true), Action::zoom_in);
  EXPECT_EQ(actionOf(Key{Key::kLeft, Key::kControl}, true), Action::turn_left);
  EXPECT_EQ(actionOf(Key{']', 0}, true), Action::next_sample);
  EXPECT_EQ(bindingOf(Action::push_left).held, Held::pushes);
  // Panels must not open and close while their key is held.
  for (const Binding& binding : bindings())
    EXPECT_TRUE(std::string(binding.group) != "Window" || binding.held == Held::once) << binding.name;
}

// The README shows the table of the program.
TEST(Bindings, TheReadmeHasThisTable) {
  const std::string readme = test::readBytes(test::inSource("viewer/README.md"));
  EXPECT_NE(readme.find(bindingsInMarkdown()), std::string::npos)
      << "put the output of `filiform view --keys` into viewer/README.md";
}

TEST(Bindings, TheProgramPrintsIt) {
  const test::Outcome outcome = test::runFiliform({"view", "--keys"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, bindingsInMarkdown());
}

}  // namespace
}  // namespace filiform
