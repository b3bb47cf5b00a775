// HaplyLink: one session with the Haply service: a WebSocket on which each message of ours is answered by one message.
// Thread rule: one thread at a time.
#pragma once

#include "device/haply/byte_stream.h"
#include "device/haply/internal/haply_messages.h"
#include "device/haply/internal/web_socket_frames.h"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace filiform::internal {

using MakeStream = std::function<std::unique_ptr<ByteStream>()>;

// The body of the service's answer to GET /version, for dialectFor() and for people. Empty if it gives none within
// timeout_s (s). Throws what `connect` throws.
std::string askVersion(const MakeStream& connect, const std::string& host, double timeout_s);

class HaplyLink {
 public:
  static constexpr std::size_t kMostMessage = 64 * 1024;  // bytes

  HaplyLink();

  // Connects, and reads the inventory, the first message of a session. Throws DeviceError, with the reason, if the peer
  // is not such a service or is silent for timeout_s (s), and what `connect` throws.
  HaplyInventory open(const MakeStream& connect, const std::string& host, double timeout_s);
  // Sends a close frame and closes the connection. Any state.
  void close() noexcept;
  bool isOpen() const noexcept { return stream_ != nullptr && !lost_; }
  double time_s() const noexcept { return stream_->time_s(); }
  void sleepUntil(double until_s) noexcept { stream_->sleepUntil(until_s); }

  // Sends a command; see writeCommand(). Returns false if the session has ended, or if the service does not take the
  // message within wait_s. Does not allocate.
  bool send(const HaplyCommand& command, double wait_s) noexcept;
  // The next message that comes until `until_s` (time_s()); answers pings. Valid until the next call. Empty if none
  // comes, or if the session has ended. Does not allocate.
  std::string_view receive(double until_s) noexcept;

 private:
  bool put(FrameKind kind, std::size_t payload_bytes, double wait_s) noexcept;
  FrameMask nextMask() noexcept;
  void readHead(const std::string& key, double until_s);

  std::unique_ptr<ByteStream> stream_;
  FrameParser parser_{kMostMessage, false};
  std::array<char, kMostFrameHeader + kMostCommand> out_{};
  std::uint64_t mask_state_ = 1;
  bool first_ = true, lost_ = false;
};

}  // namespace filiform::internal
