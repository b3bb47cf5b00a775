// ByteStream: a connection that carries bytes both ways, with a clock. A WebSocket talks through one, so that tests can
// replace the network and its time. Thread rule: one thread at a time.
#pragma once

#include "device/haptic_device.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace filiform {

class ByteStream {
 public:
  virtual ~ByteStream() = default;

  // Writes all bytes. Returns false if the connection has ended, or if the peer does not take them within wait_s (s).
  // After false the connection is of no use, because a part may have been written. Does not allocate.
  virtual bool write(std::span<const char> bytes, double wait_s) noexcept = 0;
  // Reads what has come, and waits at most wait_s (s) for the first byte. Returns the number of bytes, 0 if none came,
  // or -1 if the connection has ended. Does not allocate.
  virtual long read(std::span<char> into, double wait_s) noexcept = 0;
  // Waits until time_s() has reached `until_s`.
  virtual void sleepUntil(double until_s) noexcept = 0;
  virtual double time_s() const noexcept = 0;  // monotonic
};

struct TcpOptions {
  double timeout_s = 5;   // until the connection is made, for all addresses of the host together
  int receive_bytes = 0;  // of the system's receive buffer, about; 0: as usual
  // Asked every 10 ms while the connection is made, a write waits or a read waits. True ends the wait as its time
  // limit does. Must not throw. Empty: no wait ends early.
  std::function<bool()> is_abandoned = {};
};

// Connects by TCP; messages are sent without delay. Throws DeviceError with the reason if the name is unknown, nothing
// listens, or the connection is not made in time. The name server's time is not limited.
std::unique_ptr<ByteStream> connectTcp(const std::string& host, std::uint16_t port, const TcpOptions& options);

}  // namespace filiform
