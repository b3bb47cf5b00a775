// HaplyLink: one session with the Haply service: a WebSocket on which each message of ours is answered by one message.
// Thread rule: one thread at a time.
#pragma once

#include "device/haply/internal/haply_messages.h"
#include "device/web_socket/web_socket.h"

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace filiform::internal {

using MakeStream = std::function<std::unique_ptr<ByteStream>()>;

// The body of the service's answer to GET PATH, such as /version, for dialectFor() and for people. Empty if it gives
// none within timeout_s (s). Throws what `connect` throws.
std::string askService(const MakeStream& connect, const std::string& host, const std::string& path, double timeout_s);

class HaplyLink {
 public:
  static constexpr std::size_t kMostMessage = 64 * 1024;  // bytes

  // Connects, and reads the inventory, the first message of a session. Throws DeviceError, with the reason, if the peer
  // is not such a service or is silent for timeout_s (s), and what `connect` throws.
  HaplyInventory open(const MakeStream& connect, const std::string& host, double timeout_s);
  // Sends a close frame and closes the connection. Any state.
  void close() noexcept;
  bool isOpen() const noexcept { return socket_.isOpen(); }
  double time_s() noexcept { return socket_.stream().time_s(); }
  void sleepUntil(double until_s) noexcept { socket_.stream().sleepUntil(until_s); }

  // Sends a command; see writeCommand(). Returns false if the session has ended, or if the service does not take the
  // message within wait_s. Does not allocate.
  bool send(const HaplyCommand& command, double wait_s) noexcept;
  // The next message that comes until `until_s` (time_s()); answers pings. Valid until the next call. Empty if none
  // comes, or if the session has ended. Does not allocate.
  std::string_view receive(double until_s) noexcept;

 private:
  WebSocket socket_{kMostMessage, 0.001};
  bool first_ = true;
};

}  // namespace filiform::internal
