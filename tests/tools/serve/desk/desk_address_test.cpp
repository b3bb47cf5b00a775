#include "tools/serve/desk/desk_address.h"

#include "index/errors.h"

#include <string>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

TEST(DeskAddress, HasHostPortAndPath) {
  const DeskAddress address = DeskAddress::parse("ws://lab.example:7878/v1/sets/column/desks/anna");
  EXPECT_EQ(address.host, "lab.example");
  EXPECT_EQ(address.port, "7878");
  EXPECT_EQ(address.path, "/v1/sets/column/desks/anna");
  EXPECT_EQ(address.authority(), "lab.example:7878");
  EXPECT_EQ(DeskAddress::parse("ws://[::1]:80/v1/sets/a%20b/desks/x").authority(), "[::1]");
  EXPECT_EQ(DeskAddress::parse("ws://127.0.0.1/v1/sets/a/desks/x").port, "80");
}

TEST(DeskAddress, WrongOnesSayWhatToGive) {
  const auto line = [](const std::string& text) -> std::string {
    try {
      DeskAddress::parse(text);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  for (const char* const text :
       {"", "column", "http://127.0.0.1:7878/travel/column", "ws://", "ws:///v1/sets/c/desks/a", "ws://h/v1/session",
        "ws://h:7878", "ws://h/v1/sets/desks/a", "ws://h/v1/sets//desks/a", "ws://h/v1/sets/c/desks/a?token=x",
        "ws://u:p@h/v1/sets/c/desks/a", "ws://h/v1/sets/c c/desks/a"})
    EXPECT_NE(line(text).find("give ws://HOST:PORT/v1/sets/SET/desks/NAME"), std::string::npos) << text << line(text);
  EXPECT_NE(line("wss://h/v1/sets/c/desks/a").find("ssh -L"), std::string::npos);
  for (const char* const port : {"0", "70000", "x", "", "123456"})
    EXPECT_NE(line("ws://h:" + std::string(port) + "/v1/sets/c/desks/a").find("1 to 65535"), std::string::npos) << port;
  EXPECT_NE(line("ws://h/v1/sets/c/desks/").find("1 to 32"), std::string::npos);
  EXPECT_NE(line("ws://h/v1/sets/c/desks/" + std::string(33, 'a')).find("1 to 32"), std::string::npos);
}

}  // namespace
}  // namespace filiform::tools
