#include "device/web_socket/web_socket.h"

#include "device/web_socket/handshake.h"

#include <algorithm>
#include <random>
#include <utility>

namespace filiform {
namespace {

unsigned byteAt(std::string_view bytes, std::size_t at) { return static_cast<std::uint8_t>(bytes[at]); }

}  // namespace

WebSocket::WebSocket(std::size_t capacity, double reply_s)
    : parser_(std::max(capacity, kLeastCapacity), false),
      out_(kMostFrameHeader + std::max(capacity, kLeastCapacity)),
      mask_state_(std::random_device()() | 1u),
      reply_s_(reply_s) {
  static_assert(kLeastCapacity >= internal::kHttpBlock);
}

WebSocket::Answer WebSocket::open(std::unique_ptr<ByteStream> stream, const Request& request, double timeout_s) {
  stream_ = std::move(stream);
  const std::string key = internal::webSocketKey();
  internal::HttpAnswer got =
      internal::askHttp(*stream_,
                        "GET " + request.target + " HTTP/1.1\r\nHost: " + request.host +
                            "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                            "Sec-WebSocket-Key: " +
                            key + "\r\n" + request.headers + "\r\n",
                        stream_->time_s() + timeout_s);
  open_ = got.status == 101 && internal::headerField(got.head, "sec-websocket-accept") == internal::acceptOf(key);
  if (!open_)
    return {got.status, std::move(got.head), std::move(got.rest),
            got.status == 0 ? got.trouble : "it does not speak the WebSocket protocol"};
  parser_.reset();
  std::copy(got.rest.begin(), got.rest.end(), parser_.space().begin());
  parser_.wrote(got.rest.size());
  return {got.status, std::move(got.head), {}, ""};
}

void WebSocket::close(double wait_s) noexcept {
  send(FrameKind::close, "\x03\xe8", wait_s);
  open_ = false;
  stream_.reset();
}

bool WebSocket::send(FrameKind kind, std::string_view payload, double wait_s) noexcept {
  if (payload.size() > draft().size()) return false;
  std::copy(payload.begin(), payload.end(), draft().begin());
  return send(kind, payload.size(), wait_s);
}

bool WebSocket::send(FrameKind kind, std::size_t bytes, double wait_s) noexcept {
  if (!open_) return false;
  mask_state_ ^= mask_state_ << 13;
  mask_state_ ^= mask_state_ >> 7;
  mask_state_ ^= mask_state_ << 17;
  FrameMask mask{};
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = static_cast<std::uint8_t>(mask_state_ >> (16 + 8 * i));
  open_ = stream_->write(frameAround(out_, bytes, kind, &mask), wait_s);
  return open_;
}

WebSocket::Message WebSocket::receive(double until_s) noexcept {
  while (open_) {
    std::string_view payload;
    switch (parser_.next(payload)) {
      case FrameParser::Event::text:
        return {Message::Kind::text, payload};
      case FrameParser::Event::binary:
        return {Message::Kind::binary, payload};
      case FrameParser::Event::pong:
        return {Message::Kind::pong, payload};
      case FrameParser::Event::ping:
        send(FrameKind::pong, payload, reply_s_);
        if (stream_->time_s() >= until_s) return {};  // a flood of pings does not hold the caller
        break;
      case FrameParser::Event::close: {
        const bool has_code = payload.size() >= 2;
        send(FrameKind::close, payload.substr(0, has_code ? 2 : 0), reply_s_);
        open_ = false;
        if (!has_code) return {Message::Kind::close, {}, 1005};
        return {Message::Kind::close, payload.substr(2), byteAt(payload, 0) << 8 | byteAt(payload, 1)};
      }
      case FrameParser::Event::broken:
        open_ = false;
        break;
      case FrameParser::Event::none: {
        const long got = stream_->read(parser_.space(), std::max(0.0, until_s - stream_->time_s()));
        if (got == 0) return {};
        open_ = got > 0;
        if (open_) parser_.wrote(static_cast<std::size_t>(got));
        break;
      }
    }
  }
  return {Message::Kind::ended};
}

}  // namespace filiform
