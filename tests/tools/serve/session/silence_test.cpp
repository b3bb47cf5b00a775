#include "tools/serve/session/silence.h"

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using Due = Silence::Due;

// Calls at(now) 20 times a second until something other than a ping is due. Counts the pings.
struct Ending {
  Due due = Due::nothing;
  double at_s = 0;
  int pings = 0;
};
Ending endOf(double frames_until_s, double pongs_until_s, double most_s = 200) {
  Silence silence(0);
  Ending ending;
  for (int tick = 1; tick <= 20 * most_s; ++tick) {
    ending.at_s = tick / 20.0;
    if (ending.at_s <= frames_until_s) silence.frameCame(ending.at_s);
    ending.due = silence.at(ending.at_s);
    if (ending.due == Due::close || ending.due == Due::end) return ending;
    if (ending.due != Due::ping) continue;
    ++ending.pings;
    silence.pingSent(ending.at_s);
    if (ending.at_s <= pongs_until_s) silence.pongCame(ending.at_s);
  }
  return ending;
}

TEST(Silence, AClientWithoutFramesIsClosedAfterAMinute) {
  const Ending ending = endOf(0, 1e9);
  EXPECT_EQ(ending.due, Due::close);
  EXPECT_NEAR(ending.at_s, session_limits::kIdle_s, 0.1);
}

TEST(Silence, AClientWithoutPongsEndsAfterTwoPings) {
  const Ending ending = endOf(1e9, 0);
  EXPECT_EQ(ending.due, Due::end) << "frames that are already under way are no answer to a ping";
  EXPECT_NEAR(ending.at_s, 2 * session_limits::kPing_s, 0.1);
}

TEST(Silence, AClientThatAnswersStays) {
  const Ending ending = endOf(1e9, 1e9);
  EXPECT_EQ(ending.due, Due::nothing);
  EXPECT_NEAR(ending.pings, 200 / session_limits::kPing_s, 1.5);
}

}  // namespace
}  // namespace filiform::tools
