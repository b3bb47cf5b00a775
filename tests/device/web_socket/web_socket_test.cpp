#include "device/web_socket/web_socket.h"

#include "device/haptic_device.h"
#include "device/web_socket/handshake.h"

#include <algorithm>
#include <chrono>
#include <netinet/in.h>
#include <string>
#include <sys/socket.h>
#include <tuple>
#include <unistd.h>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Got = WebSocket::Message::Kind;

struct Peer {
  std::string sent{};              // by the client
  std::string answer{}, coming{};  // answer: with KEY for the value of Sec-WebSocket-Accept
  std::size_t piece = 7;           // bytes of a read
  bool ends = false;               // after what is coming
  double now_s = 0;
};

class PeerStream : public ByteStream {
 public:
  explicit PeerStream(Peer& peer) : peer_(peer) {}
  bool write(std::span<const char> bytes, double) noexcept override {
    constexpr std::string_view kKey = "Sec-WebSocket-Key: ";
    peer_.sent.append(bytes.data(), bytes.size());
    std::string answer = std::exchange(peer_.answer, "");
    if (const std::size_t at = answer.find("KEY"); at != std::string::npos)
      answer.replace(at, 3,
                     internal::acceptOf(std::string_view(peer_.sent).substr(peer_.sent.rfind(kKey) + kKey.size(), 24)));
    peer_.coming = answer + peer_.coming;
    return true;
  }
  long read(std::span<char> into, double wait_s) noexcept override {
    const std::size_t part = std::min({into.size(), peer_.coming.size(), peer_.piece});
    if (part == 0 && peer_.ends) return -1;
    if (part == 0) peer_.now_s += wait_s;
    std::copy_n(peer_.coming.begin(), part, into.begin());
    peer_.coming.erase(0, part);
    return static_cast<long>(part);
  }
  void sleepUntil(double until_s) noexcept override { peer_.now_s = until_s; }
  double time_s() const noexcept override { return peer_.now_s; }

 private:
  Peer& peer_;
};

constexpr const char* kUpgraded =
    "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nSEC-websocket-ACCEPT:  KEY \r\n\r\n";

WebSocket::Answer open(WebSocket& socket, Peer& peer, const std::string& answer) {
  peer.answer = answer;
  return socket.open(std::make_unique<PeerStream>(peer),
                     {.host = "lab:80", .target = "/a?b=c", .headers = "X-Y: z\r\n"}, 2);
}

// The next frame of the client.
std::pair<FrameParser::Event, std::string> frameOf(Peer& peer) {
  FrameParser parser(2000, true);
  const std::span<char> space = parser.space();
  std::copy(peer.sent.begin(), peer.sent.end(), space.begin());
  parser.wrote(peer.sent.size());
  peer.sent.clear();
  std::string_view payload;
  const FrameParser::Event event = parser.next(payload);
  return {event, std::string(payload)};
}

TEST(WebSocket, OpensAndReadsWhatComesBehindTheHead) {
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, std::size_t{5000}}) {
    Peer peer{.coming = "\x81\x05Hello\x82\x02me", .piece = piece};
    WebSocket socket(1024);
    const WebSocket::Answer answer = open(socket, peer, kUpgraded);
    ASSERT_TRUE(socket.isOpen()) << answer.trouble;
    EXPECT_EQ(answer.status, 101U);
    EXPECT_TRUE(peer.sent.starts_with("GET /a?b=c HTTP/1.1\r\nHost: lab:80\r\n")) << peer.sent;
    EXPECT_TRUE(peer.sent.ends_with("\r\nX-Y: z\r\n\r\n")) << peer.sent;
    const WebSocket::Message first = socket.receive(0);
    EXPECT_EQ(first.kind, Got::text);
    EXPECT_EQ(first.bytes, "Hello");
    EXPECT_EQ(socket.receive(0).kind, Got::binary);
    EXPECT_EQ(socket.receive(3).kind, Got::none);
    EXPECT_EQ(peer.now_s, 3);
    peer.sent.clear();
    EXPECT_TRUE(socket.send(FrameKind::text, std::string(1024, 'x'), 1));
    EXPECT_EQ(frameOf(peer), std::pair(FrameParser::Event::text, std::string(1024, 'x')));
    EXPECT_FALSE(socket.send(FrameKind::text, std::string(1025, 'x'), 1));
    EXPECT_TRUE(socket.isOpen());
  }
}

TEST(WebSocket, SaysWhyItIsNotOpen) {
  const std::string other =
      "HTTP/1.1 101 Switching Protocols\r\nSec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n\r\n";
  for (const auto& [answer, ends, status, body, trouble] :
       {std::tuple{std::string("HTTP/1.1 403 Forbidden\r\nContent-Length: 5\r\n\r\nno, never"), false, 403U, "no, n",
                   "WebSocket"},
        {"HTTP/1.1 404 Not Found\r\n\r\nnowhere", true, 404U, "nowhere", "WebSocket"},
        {other, false, 101U, "", "WebSocket"},
        {"HTTP/1.1 101 ", false, 0U, "", "does not answer"},
        {"HTTP/1.1 101 ", true, 0U, "", "ends the connection"},
        {"SSH-2.0-OpenSSH_9.2\r\n\r\n", false, 0U, "", "speak HTTP"},
        {std::string(20000, 'x'), false, 0U, "", "speak HTTP"}}) {
    Peer peer{.piece = 700, .ends = ends};
    WebSocket socket(1024);
    const WebSocket::Answer got = open(socket, peer, answer);
    EXPECT_FALSE(socket.isOpen());
    EXPECT_EQ(got.status, status) << answer;
    EXPECT_EQ(got.body.substr(0, 7), body) << answer;
    EXPECT_NE(std::string(got.trouble).find(trouble), std::string::npos) << got.trouble;
    EXPECT_EQ(socket.receive(1).kind, Got::ended);
    EXPECT_FALSE(socket.send(FrameKind::text, "x", 1));
  }
}

TEST(WebSocket, AnswersPingsAndTheClosingFrame) {
  Peer peer;
  WebSocket socket(1024);
  open(socket, peer, kUpgraded);
  peer.sent.clear();
  peer.coming = "\x89\x02hi";
  EXPECT_EQ(socket.receive(0).kind, Got::none);
  EXPECT_EQ(frameOf(peer), std::pair(FrameParser::Event::pong, std::string("hi")));
  peer.coming = std::string("\x8a\x00", 2);
  EXPECT_EQ(socket.receive(0).kind, Got::pong);
  peer.coming = "\x88\x05\x0f\xa9off\x81\x01x";
  const WebSocket::Message closing = socket.receive(0);
  EXPECT_EQ(closing.kind, Got::close);
  EXPECT_EQ(closing.code, 4009U);
  EXPECT_EQ(closing.bytes, "off");
  EXPECT_EQ(frameOf(peer), std::pair(FrameParser::Event::close, std::string("\x0f\xa9")));
  EXPECT_FALSE(socket.isOpen());
  EXPECT_EQ(socket.receive(9).kind, Got::ended);

  peer.coming.clear();
  open(socket, peer, kUpgraded);  // again, with the same memory
  ASSERT_TRUE(socket.isOpen());
  peer.coming = std::string("\x88\x00", 2);
  EXPECT_EQ(socket.receive(0).code, 1005U);
  open(socket, peer, kUpgraded);
  peer.sent.clear();
  socket.close(1);
  EXPECT_EQ(frameOf(peer), std::pair(FrameParser::Event::close, std::string("\x03\xe8")));
  EXPECT_FALSE(socket.isOpen());
}

TEST(WebSocket, EndsWithItsConnectionAndAfterWrongFrames) {
  for (const std::string& wrong : {std::string("\x81\x81\x01\x02\x03\x04y"), std::string("\x83\x01y"), std::string()}) {
    Peer peer{.ends = true};
    WebSocket socket(1024);
    open(socket, peer, kUpgraded);
    peer.coming = "\x81\x01x" + wrong;
    EXPECT_EQ(socket.receive(9).kind, Got::text);
    EXPECT_EQ(socket.receive(9).kind, Got::ended);
    EXPECT_EQ(peer.now_s, 0);
  }
}

TEST(WebSocket, AFloodOfPingsDoesNotHoldItsCaller) {
  Peer peer{.piece = 1000};
  WebSocket socket(1024);
  open(socket, peer, kUpgraded);
  for (int i = 0; i < 100; ++i) peer.coming += std::string("\x89\x00", 2);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(socket.receive(0).kind, Got::none);
  peer.sent.clear();
  EXPECT_EQ(socket.receive(0).kind, Got::none);
  EXPECT_EQ(peer.sent, "");
}

// The example of RFC 6455, 1.3.
TEST(WebSocketHandshake, AcceptsAsTheProtocolsExample) {
  EXPECT_EQ(internal::acceptOf("dGhlIHNhbXBsZSBub25jZQ=="), "s3pPLMBiTxaQ9kYGzzhZRbK+xOo=");
  EXPECT_EQ(internal::webSocketKey().size(), 24U);
  EXPECT_NE(internal::webSocketKey(), internal::webSocketKey());
}

// A peer that accepts, and then neither reads nor writes.
class SilentPeer {
 public:
  SilentPeer() : listening_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    ::bind(listening_, reinterpret_cast<const sockaddr*>(&address), size);
    ::listen(listening_, 1);
    ::getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &size);
    port = ntohs(address.sin_port);
  }
  ~SilentPeer() { ::close(listening_); }
  SilentPeer(const SilentPeer&) = delete;
  SilentPeer& operator=(const SilentPeer&) = delete;
  std::uint16_t port = 0;

 private:
  int listening_;
};

TEST(ConnectTcp, AWaitThatIsAbandonedEndsEarly) {
  SilentPeer peer;
  int asked = 0;
  const auto stream = connectTcp("127.0.0.1", peer.port, {.is_abandoned = [&asked] { return ++asked > 3; }});
  std::array<char, 100> bytes{};
  const double begin_s = stream->time_s();
  EXPECT_EQ(stream->read(bytes, 60), 0);
  asked = 0;
  EXPECT_FALSE(stream->write(std::string(64 << 20, 'x'), 60));
  EXPECT_LT(stream->time_s() - begin_s, 30);
}

TEST(ConnectTcp, AConnectionThatIsNotMadeInTimeIsAnError) {
  SilentPeer peer;
  std::vector<std::unique_ptr<ByteStream>> streams;
  try {
    for (int i = 0; i < 20; ++i) streams.push_back(connectTcp("127.0.0.1", peer.port, {.timeout_s = 0.1}));
    ADD_FAILURE() << "the system took 20 connections for a queue of 1";
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("timed out"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace filiform
