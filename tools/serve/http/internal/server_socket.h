// ServerSocket: a WebSocket of the server, for a SessionSocket or a DeskSocket. It answers the upgrade, sends one
// message at a time, pings, watches the client's silence, and closes with a code. Included by server.cpp alone, because
// it needs Boost.Asio. Thread rule: the thread of the server's io_context.
#pragma once

#include "device/web_socket/frames.h"
#include "device/web_socket/handshake.h"
#include "index/text.h"
#include "tools/serve/http/internal/tcp_wire.h"
#include "tools/serve/people/person.h"
#include "tools/serve/session/silence.h"

#include <chrono>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace filiform::tools::internal {

class ServerSocket;

// The sockets of one kind.
struct SocketSet {
  explicit SocketSet(boost::asio::io_context& i) : io(i) {}
  boost::asio::io_context& io;
  std::function<void(const ServerSocket& socket)> log = {};  // at the end of a socket
  std::set<std::shared_ptr<ServerSocket>> sockets = {};
};

// A connection whose client asks for an upgrade.
struct SocketOrigin {
  TcpWire wire;
  std::string key;  // Sec-WebSocket-Key
  std::string client_address, target;
  PersonPointer person;  // who asked
};

class ServerSocket : public std::enable_shared_from_this<ServerSocket> {
 public:
  using ErrorCode = TcpWire::ErrorCode;
  using Clock = TcpWire::Clock;

  // `most_bytes`: of a message of the client.
  ServerSocket(SocketOrigin origin, SocketSet& set, std::size_t most_bytes)
      : client_address_(std::move(origin.client_address)),
        target_(std::move(origin.target)),
        key_(std::move(origin.key)),
        person_(std::move(origin.person)),
        set_(set),
        wire_(std::move(origin.wire)),
        parser_(most_bytes, true) {
    wire_.expireNever();  // watch() keeps the limits of time
  }
  virtual ~ServerSocket() = default;

  // Answers the upgrade. `protocol`: the subprotocol that the answer names; empty: none.
  void begin(const std::string& protocol = "") {
    set_.sockets.insert(shared_from_this());
    out_ =
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: upgrade\r\nServer: filiform\r\n"
        "Sec-WebSocket-Accept: " +
        filiform::internal::acceptOf(key_) + "\r\n" +
        (protocol.empty() ? "" : "Sec-WebSocket-Protocol: " + protocol + "\r\n") + "\r\n";
    wire_.write(out_, {}, [self = shared_from_this()](ErrorCode error, std::size_t) {
      if (error) return self->end();
      if (self->ended_) return;
      self->silence_ = Silence(now_s());
      self->accepted_ = true;
      self->accepted();
      self->parse();
    });
  }

  // Sends what may be sent now.
  virtual void pump() = 0;

  // Every 50 ms or so: pings, and the client's silence.
  void watch() {
    if (closing_) {
      if (Clock::now() - closing_since_ > kClosing) end();
      return;
    }
    const Silence::Due due = silence_.at(now_s());
    if (due == Silence::Due::end) return end();
    if (due == Silence::Due::close) return silent();
    if (due == Silence::Due::ping && accepted_ && control_.empty()) {
      silence_.pingSent(now_s());
      control_ = frameOf(FrameKind::ping, {});
      write();
    }
    tend();
  }

  // Closes the WebSocket with a code; the client may answer for kClosing.
  void close(unsigned code, const std::string& reason) {
    if (std::exchange(closing_, true)) return;
    closing_since_ = Clock::now();
    leave();
    if (!accepted_) return end();
    const std::string said{static_cast<char>(code >> 8), static_cast<char>(code & 0xff)};
    last_ = frameOf(FrameKind::close, said + reason.substr(0, 120));
    write();
  }

  // Ends at once.
  void end() {
    if (std::exchange(ended_, true)) return;
    if (!std::exchange(closing_, true)) leave();
    wire_.close();
    if (set_.log) set_.log(*this);
    ended();
    set_.sockets.erase(shared_from_this());
  }

  const std::string& clientAddress() const { return client_address_; }
  const std::string& target() const { return target_; }
  const PersonPointer& person() const { return person_; }
  std::uint64_t sentBytes() const { return sent_bytes_; }
  std::uint64_t receivedBytes() const { return received_bytes_; }
  double seconds() const { return std::chrono::duration<double>(Clock::now() - began_).count(); }

 protected:
  static double now_s() { return std::chrono::duration<double>(Clock::now().time_since_epoch()).count(); }

  virtual void accepted() = 0;                                    // the upgrade is answered
  virtual void take(std::string_view message, bool is_text) = 0;  // not while the socket closes
  virtual void silent() = 0;  // no message came for session_limits::kIdle_s, but pongs do
  virtual void tend() {}      // each watch() of a socket that neither closes nor is silent
  virtual void leave() {}     // once, when the socket begins to close or ends
  virtual void ended() {}     // once

  TcpWire& wire() { return wire_; }
  bool isSending() const { return sending_; }
  bool isClosing() const { return closing_; }  // from the first close() or end() on
  bool hasEnded() const { return ended_; }
  void forgetSilence() { silence_.frameCame(now_s()); }

  // Sends one message, then calls pump(). Requires !isSending().
  void send(const std::string& message, bool is_text) {
    sending_ = true;
    message_bytes_ = message.size();
    message_ = frameOf(is_text ? FrameKind::text : FrameKind::binary, message);
    write();
  }

 private:
  static constexpr std::chrono::seconds kClosing{10};
  static constexpr unsigned kNormal = 1000, kProtocol = 1002, kNotUtf8 = 1007;  // close codes

  static std::string frameOf(FrameKind kind, std::string_view payload) {
    std::string buffer(kMostFrameHeader, '\0');
    buffer += payload;
    const auto frame = frameAround(buffer, payload.size(), kind, nullptr);
    return {frame.begin(), frame.end()};
  }

  // The code that answers a close frame.
  static unsigned answerTo(std::string_view payload) {
    if (payload.empty()) return kNormal;
    if (payload.size() == 1 || !isUtf8(payload.substr(2))) return kProtocol;
    const unsigned code = static_cast<unsigned char>(payload[0]) * 256u + static_cast<unsigned char>(payload[1]);
    const bool reserved = code < 1000 || (code >= 1004 && code <= 1006) || (code >= 1014 && code < 3000);
    return reserved ? kProtocol : code;
  }

  // Writes the frames that wait, unless others are being written. The close frame is the last one.
  void write() {
    if (writing_ || ended_ || (control_.empty() && message_.empty() && last_.empty())) return;
    writing_ = true;
    const bool has_message = !message_.empty(), is_last = !last_.empty();
    out_ = std::exchange(control_, {}) + std::exchange(message_, {}) + std::exchange(last_, {});
    wire_.write(out_, {}, [self = shared_from_this(), has_message, is_last](ErrorCode error, std::size_t) {
      self->writing_ = false;
      error ? self->end() : self->wrote(has_message, is_last);
    });
  }

  void wrote(bool has_message, bool is_last) {
    if (ended_) return;
    if (has_message) {
      sending_ = false;
      sent_bytes_ += message_bytes_;
    }
    if (is_last) said_last_ = true;
    shutDownIfDone();
    write();
    if (std::exchange(parser_waits_, false)) parse();
    if (has_message) pump();
  }

  // Takes the messages that have come, one at a time in turn with the other clients, then reads on. Takes nothing while
  // a control frame waits, so that a client that does not read cannot fill the memory with answers to its pings.
  void parse() {
    while (!ended_ && !heard_last_) {
      if (!control_.empty()) {
        parser_waits_ = true;
        return;
      }
      std::string_view payload;
      const FrameParser::Event event = parser_.next(payload);
      switch (event) {
        case FrameParser::Event::none:
          return read();
        case FrameParser::Event::text:
        case FrameParser::Event::binary: {
          if (closing_) break;
          const bool is_text = event == FrameParser::Event::text;
          if (is_text && !isUtf8(payload)) {
            hearLast(kNotUtf8);
            break;
          }
          received_bytes_ += payload.size();
          forgetSilence();
          take(payload, is_text);
          return post(set_.io, [self = shared_from_this()] { self->parse(); });
        }
        case FrameParser::Event::ping:
          if (closing_) break;
          control_ = frameOf(FrameKind::pong, payload);
          write();
          break;
        case FrameParser::Event::pong:
          silence_.pongCame(now_s());
          break;
        case FrameParser::Event::close:
          hearLast(answerTo(payload));
          break;
        case FrameParser::Event::broken:
          hearLast(parser_.closeCode());
          break;
      }
    }
    if (!ended_) read();
  }

  // What the client sends from now on is discarded until it ends the connection. An end before that could make the
  // client lose the close frame.
  void hearLast(unsigned code) {
    heard_last_ = true;
    close(code, "");
    shutDownIfDone();
  }

  void shutDownIfDone() {
    if (!heard_last_ || !said_last_) return;
    ErrorCode ignored;
    wire_.socket().shutdown(boost::asio::socket_base::shutdown_send, ignored);
  }

  void read() {
    if (heard_last_) parser_.reset();
    const auto space = parser_.space();
    wire_.read({space.data(), space.size()}, [self = shared_from_this()](ErrorCode error, std::size_t bytes) {
      if (error) return self->end();
      self->parser_.wrote(bytes);
      self->parse();
    });
  }

  const std::string client_address_, target_, key_;
  const PersonPointer person_;
  SocketSet& set_;
  TcpWire wire_;
  FrameParser parser_;
  std::string control_, message_, last_;  // frames that wait: a ping or a pong, a message, the close frame
  std::string out_;                       // what is being written
  std::size_t message_bytes_ = 0;
  bool sending_ = false, writing_ = false, parser_waits_ = false, accepted_ = false, closing_ = false, ended_ = false;
  bool said_last_ = false, heard_last_ = false;  // the close frame is written; the client's came, or it broke the rules
  Clock::time_point began_ = Clock::now(), closing_since_;
  Silence silence_{now_s()};
  std::uint64_t sent_bytes_ = 0, received_bytes_ = 0;  // of messages
};

}  // namespace filiform::tools::internal
