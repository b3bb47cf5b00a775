#include "tools/serve/session/protocol.h"

#include <array>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using Bytes = std::array<unsigned char, v1::kModelHeadBytes>;

v1::Hand someHand() {
  v1::Hand hand;
  hand.seq = 0x01020304;
  hand.t_client_ns = -5;
  hand.h_D[0] = 0.005, hand.h_D[1] = -1e-9, hand.h_D[2] = 3;
  hand.ack = 77;
  hand.flags = v1::kLetGo;
  hand.twist_D[2] = -0.5F;
  return hand;
}

TEST(Protocol, FramesComeBackAsTheyWere) {
  Bytes bytes{};
  const v1::Hand hand = someHand();
  v1::encode(hand, bytes.data());
  v1::Hand back;
  ASSERT_TRUE(v1::decode(bytes.data(), v1::kHandBytes, back));
  EXPECT_EQ(back.seq, hand.seq);
  EXPECT_EQ(back.t_client_ns, hand.t_client_ns);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(back.h_D[i], hand.h_D[i]);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(back.twist_D[i], hand.twist_D[i]);
  EXPECT_EQ(back.ack, 77u);
  EXPECT_EQ(back.flags, v1::kLetGo);

  v1::Proxy proxy;
  proxy.seq = 9, proxy.hand = 8, proxy.mode = 1, proxy.flags = v1::kSilent;
  proxy.t_client_ns = 1ll << 60;
  proxy.p_W[1] = -123.456;
  proxy.p_D[2] = 0.01F, proxy.force_N[0] = -8;
  proxy.cell = 5, proxy.segment = 6, proxy.t = 0.25F, proxy.visited = 256, proxy.replaced = 3;
  proxy.t_server_ns = 42;
  v1::encode(proxy, bytes.data());
  v1::Proxy again;
  ASSERT_TRUE(v1::decode(bytes.data(), v1::kProxyBytes, again));
  Bytes twice{};
  v1::encode(again, twice.data());
  EXPECT_TRUE(std::equal(bytes.begin(), bytes.begin() + v1::kProxyBytes, twice.begin()));
  EXPECT_EQ(again.p_W[1], -123.456);
  EXPECT_EQ(again.t_server_ns, 42);
}

TEST(Protocol, FieldsLieWhereTheDocumentSays) {
  Bytes bytes{};
  v1::encode(someHand(), bytes.data());
  EXPECT_EQ(bytes[0], 1);
  EXPECT_EQ(bytes[2], 1);
  EXPECT_EQ(bytes[4], 4);
  EXPECT_EQ(v1::getDouble(bytes.data() + 16), 0.005);
  EXPECT_EQ(bytes[40], 77);
  EXPECT_EQ(v1::getFloat(bytes.data() + 56), -0.5F);
  v1::ModelHead model;
  model.radius_m = 0.01F, model.ttl_s = 0.1F, model.most_N = 8, model.um_m = 2500;
  model.cell = 3, model.segment = 4;
  v1::encode(model, bytes.data());
  EXPECT_EQ(v1::getFloat(bytes.data() + 76), 0.01F);
  EXPECT_EQ(v1::getFloat(bytes.data() + 88), 2500);
  EXPECT_EQ(bytes[92], 3);
  EXPECT_EQ(v1::getFloat(bytes.data() + 144), 1);  // the quaternion's w
  EXPECT_EQ(bytes[148], 4);
}

TEST(Protocol, WrongBytesAreRefused) {
  Bytes bytes{};
  v1::Hand hand;
  v1::Proxy proxy;
  v1::encode(someHand(), bytes.data());
  EXPECT_FALSE(v1::decode(bytes.data(), 63, hand));
  EXPECT_FALSE(v1::decode(bytes.data(), 65, hand));
  EXPECT_FALSE(v1::decode(bytes.data(), v1::kProxyBytes, proxy));
  bytes[2] = 2;  // the version
  EXPECT_FALSE(v1::decode(bytes.data(), 64, hand));
}

TEST(Protocol, LinksOfAModelAreInRange) {
  v1::ModelHead model;
  model.nodes = 2, model.links = 1;
  std::string bytes(v1::modelBytes(model), '\0');
  auto* const at = reinterpret_cast<unsigned char*>(bytes.data());
  v1::encode(model, at);
  v1::put(at + 192 + 24, 0, 2);
  v1::put(at + 192 + 26, 1, 2);
  v1::ModelHead back;
  EXPECT_TRUE(v1::decode(at, bytes.size(), back));
  v1::put(at + 192 + 26, 2, 2);
  EXPECT_FALSE(v1::decode(at, bytes.size(), back));
  EXPECT_FALSE(v1::decode(at, bytes.size() - 1, back));
}

}  // namespace
}  // namespace filiform::tools
