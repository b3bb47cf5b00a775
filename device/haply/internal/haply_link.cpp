#include "device/haply/internal/haply_link.h"

#include "device/haply/internal/web_socket_handshake.h"
#include "device/haptic_device.h"

#include <algorithm>
#include <random>
#include <span>

namespace filiform::internal {
namespace {

constexpr std::size_t kMostHead = 16 * 1024;  // bytes of an HTTP answer
constexpr double kRequestTime_s = 1, kPongTime_s = 0.001, kGoodbyeTime_s = 0.01;

bool writeText(ByteStream& stream, const std::string& text) noexcept {
  return stream.write(std::span<const char>(text), kRequestTime_s);
}

}  // namespace

std::string askVersion(const MakeStream& connect, const std::string& host, double timeout_s) {
  const std::unique_ptr<ByteStream> stream = connect();
  const double until_s = stream->time_s() + timeout_s;
  if (!writeText(*stream, "GET /version HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n")) return {};
  std::string answer;
  std::array<char, 1024> bytes{};
  while (answer.size() < kMostHead && stream->time_s() < until_s) {
    const long got = stream->read(bytes, until_s - stream->time_s());
    if (got <= 0) break;
    answer.append(bytes.data(), static_cast<std::size_t>(got));
    // A server that keeps the connection open states the length.
    const std::size_t head = answer.find("\r\n\r\n");
    if (head == std::string::npos) continue;
    const std::string length(headerField(std::string_view(answer).substr(0, head), "content-length"));
    if (!length.empty() && length.size() < 6 && length.find_first_not_of("0123456789") == std::string::npos &&
        answer.size() >= head + 4 + std::stoul(length))
      break;
  }
  const std::size_t head = answer.find("\r\n\r\n");
  if (!answer.starts_with("HTTP/1.1 200") || head == std::string::npos) return {};
  return answer.substr(head + 4);
}

HaplyLink::HaplyLink() : mask_state_(std::random_device()() | 1u) {}

// Bytes behind the head are the begin of the inventory: they go to the parser.
void HaplyLink::readHead(const std::string& key, double until_s) {
  std::string head;
  std::array<char, 1024> bytes{};
  while (head.find("\r\n\r\n") == std::string::npos) {
    const long got = head.size() < kMostHead ? stream_->read(bytes, until_s - stream_->time_s()) : -1;
    if (got <= 0) throw DeviceError(got < 0 ? "it ends the connection" : "it does not answer");
    head.append(bytes.data(), static_cast<std::size_t>(got));
  }
  const std::size_t end = head.find("\r\n\r\n") + 4;
  if (!isUpgraded(std::string_view(head).substr(0, end), key))
    throw DeviceError("it does not speak the WebSocket protocol");
  const std::span<char> space = parser_.space();
  std::copy(head.begin() + static_cast<std::ptrdiff_t>(end), head.end(), space.begin());
  parser_.wrote(head.size() - end);
}

HaplyInventory HaplyLink::open(const MakeStream& connect, const std::string& host, double timeout_s) {
  close();
  stream_ = connect();
  lost_ = false;
  first_ = true;
  parser_.reset();
  try {
    const double until_s = stream_->time_s() + timeout_s;
    const std::string key = webSocketKey();
    if (!writeText(*stream_, upgradeRequest(host, key))) throw DeviceError("it ends the connection");
    readHead(key, until_s);
    const std::string_view message = receive(until_s);
    HaplyInventory inventory;
    if (message.empty()) throw DeviceError(lost_ ? "it ends the connection" : "it sends no list of its devices");
    if (!readInventory(message, inventory)) throw DeviceError("its list of devices is not JSON");
    return inventory;
  } catch (...) {
    stream_.reset();
    throw;
  }
}

void HaplyLink::close() noexcept {
  if (isOpen()) {
    constexpr std::array<char, 2> kNormal{'\x03', '\xe8'};
    std::copy(kNormal.begin(), kNormal.end(), out_.begin() + kMostFrameHeader);
    put(FrameKind::close, kNormal.size(), kGoodbyeTime_s);
  }
  stream_.reset();
}

FrameMask HaplyLink::nextMask() noexcept {
  mask_state_ ^= mask_state_ << 13;
  mask_state_ ^= mask_state_ >> 7;
  mask_state_ ^= mask_state_ << 17;
  FrameMask mask{};
  for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = static_cast<std::uint8_t>(mask_state_ >> (16 + 8 * i));
  return mask;
}

bool HaplyLink::put(FrameKind kind, std::size_t payload_bytes, double wait_s) noexcept {
  const FrameMask mask = nextMask();
  if (!stream_->write(frameAround(out_, payload_bytes, kind, &mask), wait_s)) lost_ = true;
  return !lost_;
}

bool HaplyLink::send(const HaplyCommand& command, double wait_s) noexcept {
  if (!isOpen()) return false;
  const std::size_t bytes = writeCommand(std::span<char>(out_).subspan(kMostFrameHeader), command, first_);
  first_ = false;
  return put(FrameKind::text, bytes, wait_s);
}

std::string_view HaplyLink::receive(double until_s) noexcept {
  while (isOpen()) {
    std::string_view payload;
    switch (parser_.next(payload)) {
      case FrameParser::Event::message:
        if (!payload.empty()) return payload;
        break;
      case FrameParser::Event::ping:
        std::copy(payload.begin(), payload.end(), out_.begin() + kMostFrameHeader);
        put(FrameKind::pong, payload.size(), kPongTime_s);
        if (stream_->time_s() >= until_s) return {};  // a flood of pings does not hold the caller
        break;
      case FrameParser::Event::pong:
        if (stream_->time_s() >= until_s) return {};
        break;
      case FrameParser::Event::close:
      case FrameParser::Event::broken:
        lost_ = true;
        break;
      case FrameParser::Event::none: {
        const double left_s = until_s - stream_->time_s();
        const long got = stream_->read(parser_.space(), std::max(0.0, left_s));
        if (got < 0) lost_ = true;
        if (got == 0) return {};
        if (got > 0) parser_.wrote(static_cast<std::size_t>(got));
        break;
      }
    }
  }
  return {};
}

}  // namespace filiform::internal
