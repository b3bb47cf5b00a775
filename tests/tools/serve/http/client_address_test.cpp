#include "tools/serve/http/client_address.h"

#include "index/errors.h"
#include "tools/serve/people/person.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

using tools::Proxies;

TEST(ClientAddress, OnlyStatedProxiesAreBelieved) {
  const Proxies proxies({"10.0.0.0/8", "127.0.0.1", "2001:db8::/33"});
  EXPECT_EQ(proxies.clientOf("192.0.2.7", "198.51.100.7"), "192.0.2.7");
  EXPECT_EQ(proxies.clientOf("10.1.2.3", "198.51.100.7"), "198.51.100.7");
  EXPECT_EQ(proxies.clientOf("10.1.2.3", ""), "10.1.2.3");
  EXPECT_EQ(proxies.clientOf("127.0.0.1", "203.0.113.9, 198.51.100.7 ,10.9.9.9"), "198.51.100.7")
      << "the client can send the rest of the header itself";
  EXPECT_EQ(proxies.clientOf("127.0.0.1", "10.0.0.1, 10.0.0.2"), "10.0.0.1");
  EXPECT_EQ(proxies.clientOf("127.0.0.1", "198.51.100.7, nonsense"), "127.0.0.1");
  EXPECT_EQ(proxies.clientOf("::ffff:10.0.0.1", "2001:db8::5, 2001:db9::5"), "2001:db9::5");
  EXPECT_TRUE(proxies.has("2001:db8:7fff::1"));
  EXPECT_FALSE(proxies.has("2001:db8:8000::1"));
  EXPECT_FALSE(proxies.has("unix"));
  EXPECT_EQ(Proxies().clientOf("127.0.0.1", "198.51.100.7"), "127.0.0.1");
}

TEST(ClientAddress, WrongNetworksAreRefused) {
  for (const char* wrong : {"", "10.0.0.0/33", "10.0.0.0/", "10.0.0.0/x", "proxy.example", "::1/129", "1.2.3"})
    EXPECT_THROW(Proxies({wrong}), UsageError) << wrong;
}

TEST(ClientAddress, ANetworkOfIPv6IsOneClient) {
  EXPECT_EQ(tools::shareOf("192.0.2.7"), "192.0.2.7");
  EXPECT_EQ(tools::shareOf("::ffff:192.0.2.7"), "192.0.2.7");
  EXPECT_EQ(tools::shareOf("2001:db8:1:2:3:4:5:6"), tools::shareOf("2001:db8:1:2::9"));
  EXPECT_NE(tools::shareOf("2001:db8:1:2::9"), tools::shareOf("2001:db8:1:3::9"));
}

TEST(ClientAddress, ANamedPersonHasAShareOfTheirOwn) {
  const tools::Person ann{.name = "ann", .key = "token 1"}, anonymous{.name = "anonymous"}, unnamed{.key = "token 2"};
  EXPECT_EQ(tools::workShareOf("192.0.2.7", &ann), tools::workShareOf("192.0.2.8", &ann));
  EXPECT_NE(tools::workShareOf("192.0.2.7", &ann), tools::workShareOf("192.0.2.7", nullptr));
  for (const tools::Person* const person : {&anonymous, &unnamed})
    EXPECT_EQ(tools::workShareOf("192.0.2.7", person), tools::shareOf("192.0.2.7"));
}

}  // namespace
}  // namespace filiform
