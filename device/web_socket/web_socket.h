// WebSocket: the client's side of a WebSocket (RFC 6455) over a ByteStream. Frames have no extension.
//
//   WebSocket socket(64 * 1024);
//   const WebSocket::Answer answer = socket.open(connectTcp("127.0.0.1", 7878, {}), {.host = "127.0.0.1:7878"}, 5);
//   if (!socket.isOpen()) throw DeviceError(answer.trouble);
//   socket.send(FrameKind::text, "hello", 1);
//   const WebSocket::Message message = socket.receive(socket.stream().time_s() + 1);
//
// Only the constructor and open() allocate. Thread rule: one thread at a time.
#pragma once

#include "device/web_socket/byte_stream.h"
#include "device/web_socket/frames.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

class WebSocket {
 public:
  static constexpr std::size_t kLeastCapacity = 1024;

  struct Request {
    std::string host;          // of the header Host
    std::string target = "/";  // path and query
    std::string headers = {};  // more of them: lines with their ends
  };
  struct Answer {
    unsigned status = 0;       // 0: none came
    std::string head, body;    // body: at most 16 KiB
    const char* trouble = "";  // why the WebSocket is not open: "it does not answer"; empty if it is open
  };
  struct Message {
    // none: nothing came in time. ended: the connection has ended, or the peer has broken the protocol.
    enum class Kind : std::uint8_t { none, text, binary, pong, close, ended };
    Kind kind = Kind::none;
    std::string_view bytes = {};  // of a close frame: the reason
    unsigned code = 0;            // of a close frame; 1005: it has none
  };

  // `capacity`: the longest message that is sent or received (bytes), at least kLeastCapacity. `reply_s`: the time (s)
  // in which the peer must take the answer to a ping or to a close frame.
  explicit WebSocket(std::size_t capacity, double reply_s = 1);

  // Asks for an upgrade, and waits at most timeout_s (s) for the answer. Ends the connection that was open before.
  Answer open(std::unique_ptr<ByteStream> stream, const Request& request, double timeout_s);
  // Sends a close frame with code 1000, which the peer must take within wait_s (s), and ends the connection. Any state.
  void close(double wait_s) noexcept;
  // False once the connection has ended, and after a close frame of the peer.
  bool isOpen() const noexcept { return open_; }
  // Requires that open() was called, and not close() since.
  ByteStream& stream() noexcept { return *stream_; }

  // Memory for the payload of the next message, `capacity` bytes. receive() writes there too.
  std::span<char> draft() noexcept { return std::span<char>(out_).subspan(kMostFrameHeader); }
  // Sends the first bytes of draft() as a message of one frame. False if the connection has ended, or if the peer does
  // not take the frame within wait_s (s); it then counts as ended.
  bool send(FrameKind kind, std::size_t bytes, double wait_s) noexcept;
  // The same for a payload elsewhere. False also if it is longer than the capacity.
  bool send(FrameKind kind, std::string_view payload, double wait_s) noexcept;
  // The next message that comes until `until_s` (time of the stream). Answers pings, and the close frame. The message
  // is valid until the next call.
  Message receive(double until_s) noexcept;

 private:
  std::unique_ptr<ByteStream> stream_;
  FrameParser parser_;
  std::vector<char> out_;
  std::uint64_t mask_state_;
  double reply_s_;
  bool open_ = false;
};

}  // namespace filiform
