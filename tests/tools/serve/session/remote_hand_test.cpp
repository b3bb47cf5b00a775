#include "tools/serve/session/remote_hand.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

v1::Hand handAt(double x_m, std::uint32_t seq = 1) {
  v1::Hand hand;
  hand.seq = seq;
  hand.h_D[0] = x_m;
  return hand;
}

double xAt(RemoteHand& hand, std::uint64_t period) {
  hand.beginPeriod(period);
  return hand.exchange({}).p_D.x();
}

TEST(RemoteHand, InterpolatesThenHolds) {
  RemoteHand hand({});
  hand.open();
  hand.receive(handAt(0.01));
  EXPECT_EQ(xAt(hand, 100), 0.01);  // the first position at once
  for (std::uint64_t period = 101; period < 110; ++period) EXPECT_EQ(xAt(hand, period), 0.01);
  hand.receive(handAt(0.02));
  for (std::uint64_t i = 0; i < 10; ++i)
    EXPECT_NEAR(xAt(hand, 110 + i), 0.01 + 0.001 * static_cast<double>(i + 1), 1e-15);
  EXPECT_EQ(xAt(hand, 120), 0.02);
  EXPECT_EQ(xAt(hand, 150), 0.02);
}

TEST(RemoteHand, TheNewestWins) {
  RemoteHand hand({});
  hand.open();
  for (std::uint32_t seq = 1; seq <= 5; ++seq) hand.receive(handAt(0.001 * seq, seq));
  EXPECT_EQ(xAt(hand, 1), 0.005);
  EXPECT_EQ(hand.used().hand.seq, 5u);
  EXPECT_TRUE(hand.isFresh());
  xAt(hand, 2);
  EXPECT_FALSE(hand.isFresh());
}

TEST(RemoteHand, IsNotReadyInSilenceAndReadyAgain) {
  RemoteHand hand({.hold_s = 0.05});
  hand.open();
  hand.beginPeriod(1);
  EXPECT_NE(hand.exchange({}).status, DeviceStatus::ready);  // no HAND yet
  hand.receive(handAt(0.01));
  hand.beginPeriod(2);
  EXPECT_EQ(hand.exchange({}).status, DeviceStatus::ready);
  hand.beginPeriod(51);
  EXPECT_EQ(hand.exchange({}).status, DeviceStatus::ready);
  hand.beginPeriod(52);
  EXPECT_NE(hand.exchange({}).status, DeviceStatus::ready);
  EXPECT_TRUE(hand.isSilent());
  hand.receive(handAt(0.03));
  EXPECT_EQ(xAt(hand, 90), 0.03);  // at once: the server knows no earlier position
  hand.block(true);
  hand.beginPeriod(91);
  EXPECT_NE(hand.exchange({}).status, DeviceStatus::ready);
  hand.block(false);
  v1::Hand let_go = handAt(0.03);
  let_go.flags = v1::kLetGo;
  hand.receive(let_go);
  hand.beginPeriod(92);
  EXPECT_NE(hand.exchange({}).status, DeviceStatus::ready);
}

TEST(RemoteHand, RefusesValuesThatAreNotFinite) {
  RemoteHand hand({});
  hand.open();
  hand.receive(handAt(0.01));
  xAt(hand, 1);
  const double nan = std::nan(""), infinite = std::numeric_limits<double>::infinity();
  for (const double wrong : {nan, infinite, -infinite, 10.5, -1e300}) EXPECT_FALSE(hand.receive(handAt(wrong)));
  v1::Hand turning = handAt(0.02);
  turning.twist_D[1] = std::nanf("");
  EXPECT_FALSE(hand.receive(turning));
  EXPECT_EQ(hand.refused(), 6u);
  EXPECT_EQ(xAt(hand, 2), 0.01);
  EXPECT_FALSE(hand.isFresh());
}

}  // namespace
}  // namespace filiform::tools
