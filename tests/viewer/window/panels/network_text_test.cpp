#include "viewer/window/panels/internal/network_text.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(NetworkText, SaysNothingOfAnswersThatCome) {
  EXPECT_EQ(networkText({}), "");
  EXPECT_EQ(networkText({.silent_s = 1.9}), "");
}

TEST(NetworkText, TellsALostNetworkFromASlowOne) {
  EXPECT_EQ(networkText({.silent_s = 3.2}), "the network is slow: no answer for 3 s; missing parts are on their way");
  EXPECT_EQ(networkText({.lost = true, .silent_s = 0.4}),
            "the network is lost: no answer for 0 s; missing parts are asked for again until they come");
}

}  // namespace
}  // namespace filiform::internal
