#include "tools/serve/session/outbox.h"

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

v1::Proxy proxyOfHand(std::uint32_t hand) {
  v1::Proxy proxy;
  proxy.hand = hand;
  return proxy;
}

TEST(Outbox, EightAreUnacknowledgedThenTheNewestReplacesTheOldest) {
  Outbox outbox;
  for (std::uint32_t i = 1; i <= 8; ++i) {
    outbox.put(proxyOfHand(i));
    const auto sent = outbox.next();
    ASSERT_TRUE(sent);
    EXPECT_EQ(sent->seq, i);
  }
  for (std::uint32_t i = 9; i <= 12; ++i) {
    outbox.put(proxyOfHand(i));
    EXPECT_FALSE(outbox.next());
  }
  outbox.acknowledge(1);
  const auto sent = outbox.next();
  ASSERT_TRUE(sent);
  EXPECT_EQ(sent->hand, 12u);
  EXPECT_EQ(sent->seq, 9u);
  EXPECT_EQ(sent->replaced, 3u);
  EXPECT_FALSE(outbox.next());
}

TEST(Outbox, NumbersThatWereNeverSentAcknowledgeNothing) {
  Outbox outbox;
  for (std::uint32_t i = 1; i <= 8; ++i) {
    outbox.put(proxyOfHand(i));
    outbox.next();
  }
  for (const std::uint32_t wrong : {0u, 9u, 4000000000u}) {
    outbox.acknowledge(wrong);
    EXPECT_FALSE(outbox.maySend()) << wrong;
  }
  outbox.acknowledge(8);
  outbox.acknowledge(3);  // late
  for (std::uint32_t i = 1; i <= 8; ++i) {
    outbox.put(proxyOfHand(i));
    EXPECT_TRUE(outbox.next());
  }
}

}  // namespace
}  // namespace filiform::tools
