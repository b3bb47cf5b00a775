// Frames of the WebSocket protocol (RFC 6455, 5): written into the caller's memory, and parsed from a buffer of fixed
// size. No extension is asked for, so the reserved bits must be zero. Thread rule: one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace filiform {

enum class FrameKind : std::uint8_t { continuation = 0, text = 1, binary = 2, close = 8, ping = 9, pong = 10 };
inline constexpr std::size_t kMostFrameHeader = 14;  // bytes
using FrameMask = std::array<std::uint8_t, 4>;

// Turns the payload, which lies kMostFrameHeader bytes behind the begin of `buffer`, into a whole frame of a message of
// one frame. Returns the frame, which is a part of the buffer. `mask`: nullptr for a frame of a server.
std::span<const char> frameAround(std::span<char> buffer, std::size_t payload_bytes, FrameKind kind,
                                  const FrameMask* mask) noexcept;

class FrameParser {
 public:
  enum class Event : std::uint8_t { none, text, binary, ping, pong, close, broken };

  // `capacity`: the longest frame and the longest message (bytes). `masked`: frames of a client, which must have a
  // mask; otherwise none may have one. Allocates here only.
  FrameParser(std::size_t capacity, bool masked);

  // Forgets everything, also an error.
  void reset() noexcept;
  // Free memory for bytes that have come; never empty unless the parser is broken. Ends the life of all payloads.
  std::span<char> space() noexcept;
  // Says how many bytes were written to space().
  void wrote(std::size_t bytes) noexcept { end_ += bytes; }
  // The next event of the bytes that have come. `payload` is valid until the next call. `broken`: the bytes are not
  // frames, or longer than the capacity; it stays so until reset().
  Event next(std::string_view& payload) noexcept;
  // The close code for `broken`: 1009 if a frame or a message is longer than the capacity, otherwise 1002.
  unsigned closeCode() const noexcept { return too_long_ ? 1009 : 1002; }

 private:
  Event broken(bool too_long = false) noexcept;

  std::vector<char> bytes_, message_;  // message_: the parts of a message of several frames
  std::size_t begin_ = 0, end_ = 0;    // of the bytes that are not parsed
  std::size_t message_bytes_ = 0;
  Event message_event_ = Event::none;  // of the message whose parts come; none: no message has begun
  bool masked_, message_taken_ = false, broken_ = false, too_long_ = false;
};

}  // namespace filiform
