#include "solver/travel/session/internal/session_commands.h"

#include "index/errors.h"
#include "tests/support/scenes/memory_store.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

using Kind = NavigationCommand::Kind;

SessionCommands manyCommands() {
  SessionCommands session{
      .zoom_um = 0.1, .stiffness_N_m = 1.0 / 3, .rate_Hz = 500, .leap = 0.2, .method = SolverMethod::force};
  for (const Kind kind :
       {Kind::jump, Kind::constrain, Kind::free, Kind::zoom, Kind::rotate, Kind::centre, Kind::leap}) {
    SessionCommand one{session.commands.size() * 10, {}};
    one.command.kind = kind;
    one.command.place.segment = {3, 4};
    one.command.place.node = {3, 5};
    one.command.place.at_node = true;
    one.command.place.t = 0.7;
    one.command.place.tile = 2;
    one.command.place.p_W = {0.1, -2e9, 3};
    one.command.factor = 1.1;
    one.command.about_x_rad = 0.2;
    one.command.about_y_rad = -0.3;
    session.commands.push_back(one);
  }
  return session;
}

TEST(SessionCommands, AreReadBackToTheBit) {
  const test::TempFolder folder;
  const SessionCommands written = manyCommands();
  writeSessionCommands(folder / "a.json", written);
  const auto scene = test::storeOf(test::randomColumn(11, 4, 400, 200));
  const SessionCommands read = readSessionCommands(folder / "a.json", *scene);
  EXPECT_EQ(read.zoom_um, written.zoom_um);
  EXPECT_EQ(read.stiffness_N_m, written.stiffness_N_m);
  EXPECT_EQ(read.rate_Hz, written.rate_Hz);
  EXPECT_EQ(read.leap, written.leap);
  EXPECT_EQ(read.method, written.method);
  ASSERT_EQ(read.commands.size(), written.commands.size());
  for (std::size_t i = 0; i < read.commands.size(); ++i) {
    const NavigationCommand &got = read.commands[i].command, &expected = written.commands[i].command;
    EXPECT_EQ(read.commands[i].tick, written.commands[i].tick);
    ASSERT_EQ(got.kind, expected.kind);
    if (got.kind == Kind::jump || got.kind == Kind::constrain) {
      EXPECT_EQ(got.place.segment, expected.place.segment);
      EXPECT_EQ(got.place.node, expected.place.node);
      EXPECT_EQ(got.place.at_node, expected.place.at_node);
      EXPECT_EQ(got.place.t, expected.place.t);
      EXPECT_EQ(got.place.tile, expected.place.tile);
      EXPECT_EQ(got.place.p_W, expected.place.p_W);
    }
    if (got.kind == Kind::zoom || got.kind == Kind::leap) {
      EXPECT_EQ(got.factor, expected.factor);
    }
    if (got.kind == Kind::rotate) {
      EXPECT_EQ(got.about_x_rad, expected.about_x_rad);
      EXPECT_EQ(got.about_y_rad, expected.about_y_rad);
    }
  }
}

TEST(SessionCommands, OfALargerSceneAreRefused) {
  const test::TempFolder folder;
  writeSessionCommands(folder / "a.json", manyCommands());
  const auto few_cells = test::storeOf(test::randomColumn(11, 3, 400, 200)),
             one_tile = test::storeOf(test::randomColumn(11, 4, 4, 20), 4096);
  EXPECT_THROW(readSessionCommands(folder / "a.json", *few_cells), InputError);
  EXPECT_THROW(readSessionCommands(folder / "a.json", *one_tile), InputError);
}

}  // namespace
}  // namespace filiform::internal
