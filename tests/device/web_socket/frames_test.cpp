#include "device/web_socket/frames.h"

#include <algorithm>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Event = FrameParser::Event;

std::string frame(const std::string& payload, FrameKind kind, bool masked, const FrameMask& mask = {1, 200, 3, 77}) {
  std::vector<char> buffer(kMostFrameHeader + payload.size());
  std::copy(payload.begin(), payload.end(), buffer.begin() + kMostFrameHeader);
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
          ASSERT_EQ(event, Event::text) << length;
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
  EXPECT_EQ(parser.next(read), Event::text);
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
        std::string("\x81\x7e\x00\x01x", 5), std::string("\x81\x7f\xff\xff\xff\xff\xff\xff\xff\xff", 10)}) {
    FrameParser parser(100, false);
    feed(parser, bytes, 1000);
    std::string_view read;
    EXPECT_EQ(parser.next(read), Event::broken);
    EXPECT_EQ(parser.next(read), Event::broken);
    parser.reset();
    feed(parser, frame("again", FrameKind::text, false), 1000);
    EXPECT_EQ(parser.next(read), Event::text);
  }
}

TEST(FrameParser, TellsTooLongFromWrong) {
  const std::string half(60, 'x');
  std::string part = frame(half, FrameKind::text, false);
  part[0] = '\x01';
  for (const auto& [bytes, code] : {std::tuple{frame(std::string(101, 'x'), FrameKind::text, false), 1009U},
                                    {part + frame(half, FrameKind::continuation, false), 1009U},
                                    {frame("x", FrameKind::continuation, false), 1002U},
                                    {frame("x", FrameKind::text, true), 1002U}}) {
    FrameParser parser(100, false);
    std::string_view read;
    Event event = Event::none;
    for (std::size_t at = 0; at < bytes.size() && event == Event::none; event = parser.next(read))
      at += feed(parser, std::string_view(bytes).substr(at), 50);
    EXPECT_EQ(event, Event::broken);
    EXPECT_EQ(parser.closeCode(), code);
  }
}

// The examples of RFC 6455, 5.7, which prove both directions by bytes that this project did not write.
TEST(FrameParser, ReadsAndWritesTheProtocolsExamples) {
  const std::string zeros(65536, '\0');
  using namespace std::string_literals;
  for (const auto& [bytes, payload, kind, event, is_masked] :
       {std::tuple{"\x81\x05Hello"s, "Hello"s, FrameKind::text, Event::text, false},
        {"\x81\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58"s, "Hello"s, FrameKind::text, Event::text, true},
        {"\x89\x05Hello"s, "Hello"s, FrameKind::ping, Event::ping, false},
        {"\x8a\x85\x37\xfa\x21\x3d\x7f\x9f\x4d\x51\x58"s, "Hello"s, FrameKind::pong, Event::pong, true},
        {"\x82\x7e\x01\x00"s + zeros.substr(0, 256), zeros.substr(0, 256), FrameKind::binary, Event::binary, false},
        {"\x82\x7f\0\0\0\0\0\x01\0\0"s + zeros, zeros, FrameKind::binary, Event::binary, false}}) {
    EXPECT_EQ(frame(payload, kind, is_masked, {0x37, 0xfa, 0x21, 0x3d}), bytes);
    FrameParser parser(70'000, is_masked);
    feed(parser, bytes, bytes.size());
    std::string_view read;
    EXPECT_EQ(parser.next(read), event);
    EXPECT_EQ(read, payload);
  }
  FrameParser parser(100, false);
  feed(parser, "\x01\x03Hel\x80\x02lo"s, 100);
  std::string_view read;
  EXPECT_EQ(parser.next(read), Event::text);
  EXPECT_EQ(read, "Hello");
}

}  // namespace
}  // namespace filiform
