#include "device/haply/internal/web_socket_frames.h"

#include "device/haply/internal/web_socket_handshake.h"

#include <algorithm>
#include <random>
#include <string>

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

using Event = FrameParser::Event;

std::string frame(const std::string& payload, FrameKind kind, bool masked) {
  std::vector<char> buffer(kMostFrameHeader + payload.size());
  std::copy(payload.begin(), payload.end(), buffer.begin() + kMostFrameHeader);
  const FrameMask mask{1, 200, 3, 77};
  const auto bytes = frameAround(buffer, payload.size(), kind, masked ? &mask : nullptr);
  return {bytes.begin(), bytes.end()};
}

// Feeds as many bytes as there is space for. Returns how many.
std::size_t feed(FrameParser& parser, std::string_view bytes, std::size_t most) {
  const std::span<char> space = parser.space();
  const std::size_t part = std::min({space.size(), bytes.size(), most});
  std::copy_n(bytes.begin(), part, space.begin());
  parser.wrote(part);
  return part;
}

TEST(FrameParser, ReadsFramesOfEveryLengthCutAnywhere) {
  std::mt19937 random(2);
  for (const bool masked : {false, true}) {
    FrameParser parser(70'000, masked);
    for (const std::size_t length : {0, 1, 125, 126, 127, 65535, 65536, 70'000}) {
      std::string payload(length, ' ');
      for (char& c : payload) c = static_cast<char>(random());
      const std::string bytes = frame(payload, FrameKind::text, masked) + frame("next", FrameKind::text, masked);
      std::size_t at = 0;
      std::vector<std::string> got;
      while (at < bytes.size()) {
        at += feed(parser, std::string_view(bytes).substr(at), 1 + random() % 9000);
        std::string_view read;
        for (Event event; (event = parser.next(read)) != Event::none;) {
          ASSERT_EQ(event, Event::message) << length;
          got.emplace_back(read);
        }
      }
      ASSERT_EQ(got.size(), 2U) << length;
      EXPECT_EQ(got[0], payload);
      EXPECT_EQ(got[1], "next");
    }
  }
}

TEST(FrameParser, JoinsPartsWithAPingBetweenThem) {
  FrameParser parser(100, false);
  std::string first = frame("one ", FrameKind::text, false), last = frame("two", FrameKind::continuation, false);
  first[0] = '\x01';
  feed(parser, first + frame("here", FrameKind::ping, false) + last, 1000);
  std::string_view read;
  EXPECT_EQ(parser.next(read), Event::ping);
  EXPECT_EQ(read, "here");
  EXPECT_EQ(parser.next(read), Event::message);
  EXPECT_EQ(read, "one two");
  EXPECT_EQ(parser.next(read), Event::none);
}

TEST(FrameParser, RefusesWhatBreaksTheProtocol) {
  std::string open_ping = frame("x", FrameKind::ping, false), reserved = frame("x", FrameKind::text, false),
              part = frame("x", FrameKind::text, false);
  open_ping[0] = '\x09';
  reserved[0] = '\xc1';
  part[0] = '\x01';
  for (const std::string& bytes :
       {frame("x", FrameKind::text, true), open_ping, reserved, frame("x", FrameKind::continuation, false),
        part + frame("y", FrameKind::text, false), frame(std::string(101, 'x'), FrameKind::text, false),
        frame(std::string(126, 'x'), FrameKind::ping, false), frame("x", static_cast<FrameKind>(3), false),
        std::string("\x81\x7f\xff\xff\xff\xff\xff\xff\xff\xff", 10)}) {
    FrameParser parser(100, false);
    feed(parser, bytes, 1000);
    std::string_view read;
    EXPECT_EQ(parser.next(read), Event::broken);
    EXPECT_EQ(parser.next(read), Event::broken);
    parser.reset();
    feed(parser, frame("again", FrameKind::text, false), 1000);
    EXPECT_EQ(parser.next(read), Event::message);
  }
}

// The example of RFC 6455, 1.3.
TEST(WebSocketHandshake, AcceptsAsTheProtocolsExample) {
  EXPECT_EQ(acceptOf("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  const std::string head =
      "HTTP/1.1 101 Switching Protocols\r\nSEC-websocket-ACCEPT:  s3pPLMBiTxaQ9kYGzzhZRbK+xOo= \r\n\r\n";
  EXPECT_TRUE(isUpgraded(head, "dGhlIHNhbXBsZSBub25jZQ=="));
  EXPECT_FALSE(isUpgraded(head, "dGhlIHNhbXBsZSBub25jZQ=?"));
  EXPECT_EQ(webSocketKey().size(), 24U);
  EXPECT_NE(webSocketKey(), webSocketKey());
}

}  // namespace
}  // namespace filiform::internal
