#include "device/web_socket/frames.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace filiform {
namespace {

constexpr std::uint8_t kFinal = 0x80, kReserved = 0x70, kKind = 0x0f, kMasked = 0x80, kLength = 0x7f;
constexpr std::size_t kShort = 125, kTwoBytes = 126, kEightBytes = 127;

std::uint8_t byteOf(char c) noexcept { return static_cast<std::uint8_t>(c); }
char charOf(std::uint64_t byte) noexcept { return static_cast<char>(static_cast<std::uint8_t>(byte)); }

}  // namespace

std::span<const char> frameAround(std::span<char> buffer, std::size_t payload_bytes, FrameKind kind,
                                  const FrameMask* mask) noexcept {
  const std::size_t length_bytes = payload_bytes <= kShort ? 0 : payload_bytes <= 0xffff ? 2 : 8;
  const std::size_t header = 2 + length_bytes + (mask != nullptr ? mask->size() : 0);
  char* at = buffer.data() + kMostFrameHeader - header;
  const std::span<const char> frame(at, header + payload_bytes);
  *at++ = charOf(kFinal | static_cast<std::uint8_t>(kind));
  const std::size_t length = length_bytes == 0 ? payload_bytes : length_bytes == 2 ? kTwoBytes : kEightBytes;
  *at++ = charOf(length | (mask != nullptr ? kMasked : 0));
  for (std::size_t i = length_bytes; i-- > 0;) *at++ = charOf(std::uint64_t{payload_bytes} >> (8 * i));
  if (mask == nullptr) return frame;
  for (const std::uint8_t byte : *mask) *at++ = charOf(byte);
  for (std::size_t i = 0; i < payload_bytes; ++i) at[i] = charOf(byteOf(at[i]) ^ (*mask)[i % 4]);
  return frame;
}

FrameParser::FrameParser(std::size_t capacity, bool masked)
    : bytes_(capacity + kMostFrameHeader), message_(capacity), masked_(masked) {}

void FrameParser::reset() noexcept {
  begin_ = end_ = message_bytes_ = 0;
  message_event_ = Event::none;
  message_taken_ = broken_ = too_long_ = false;
}

std::span<char> FrameParser::space() noexcept {
  if (begin_ == end_) {
    begin_ = end_ = 0;
  } else if (end_ == bytes_.size()) {
    std::memmove(bytes_.data(), bytes_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  return std::span<char>(bytes_).subspan(end_);
}

FrameParser::Event FrameParser::broken(bool too_long) noexcept {
  broken_ = true;
  too_long_ = too_long;
  return Event::broken;
}

FrameParser::Event FrameParser::next(std::string_view& payload) noexcept {
  if (message_taken_) message_bytes_ = 0;
  message_taken_ = false;
  while (!broken_) {
    const std::size_t have = end_ - begin_;
    if (have < 2) return Event::none;
    char* const frame = bytes_.data() + begin_;
    const std::uint8_t first = byteOf(frame[0]), second = byteOf(frame[1]);
    const bool is_final = (first & kFinal) != 0;
    const auto kind = static_cast<FrameKind>(first & kKind);
    const bool is_control = (first & 0x08) != 0;
    if ((first & kReserved) != 0 || ((second & kMasked) != 0) != masked_) return broken();
    std::uint64_t length = second & kLength;
    if (is_control && (!is_final || length > kShort)) return broken();
    const std::size_t length_bytes = length == kTwoBytes ? 2 : length == kEightBytes ? 8 : 0;
    const std::size_t header = 2 + length_bytes + (masked_ ? 4 : 0);
    if (have < header) return Event::none;
    if (length_bytes > 0) {
      length = 0;
      for (std::size_t i = 0; i < length_bytes; ++i) length = length << 8 | byteOf(frame[2 + i]);
      if (length <= (length_bytes == 2 ? kShort : 0xffff)) return broken();  // not the shortest form
    }
    if (length > message_.size()) return broken(true);
    const auto bytes = static_cast<std::size_t>(length);
    if (have - header < bytes) return Event::none;

    char* const data = frame + header;
    if (masked_)
      for (std::size_t i = 0; i < bytes; ++i) data[i] = charOf(byteOf(data[i]) ^ byteOf(frame[header - 4 + i % 4]));
    begin_ += header + bytes;
    payload = {data, bytes};
    switch (kind) {
      case FrameKind::close:
        return Event::close;
      case FrameKind::ping:
        return Event::ping;
      case FrameKind::pong:
        return Event::pong;
      case FrameKind::text:
      case FrameKind::binary:
        if (message_event_ != Event::none) return broken();
        message_event_ = kind == FrameKind::text ? Event::text : Event::binary;
        if (is_final) return std::exchange(message_event_, Event::none);
        break;
      case FrameKind::continuation:
        if (message_event_ == Event::none) return broken();
        break;
      default:
        return broken();
    }
    if (message_.size() - message_bytes_ < bytes) return broken(true);
    std::copy_n(data, bytes, message_.data() + message_bytes_);
    message_bytes_ += bytes;
    if (!is_final) continue;
    message_taken_ = true;
    payload = {message_.data(), message_bytes_};
    return std::exchange(message_event_, Event::none);
  }
  return Event::broken;
}

}  // namespace filiform
