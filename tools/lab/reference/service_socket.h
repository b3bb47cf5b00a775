// ServiceSocket: a WebSocket to `filiform serve` on this machine, for tests and benchmarks. Thread rule: one thread.
#pragma once

#include "device/web_socket/web_socket.h"

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace filiform::tools {

struct ServiceRequest {
  std::string target = "/v1/session";
  std::string headers = {};  // more of them: lines with their ends
  int receive_bytes = 0;     // of the system's receive buffer, about; 0: as usual
};

class ServiceSocket {
 public:
  using Message = WebSocket::Message;

  // Asks 127.0.0.1:`port` for an upgrade; see status(). Throws DeviceError if nothing listens.
  explicit ServiceSocket(std::uint16_t port, const ServiceRequest& request = {});

  unsigned status() const { return answer_.status; }  // 101: the WebSocket is open
  const std::string& head() const { return answer_.head; }

  // False if the server has closed the connection.
  bool send(FrameKind kind, std::string_view payload) { return socket_.send(kind, payload, kPatience_s); }
  bool sendText(std::string_view text) { return send(FrameKind::text, text); }
  bool sendBinary(std::span<const unsigned char> bytes) {
    return send(FrameKind::binary, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  bool sendRaw(std::string_view bytes) { return socket_.stream().write(bytes, kPatience_s); }
  void sendClose() { send(FrameKind::close, "\x03\xe8"); }

  // The next message. Answers pings.
  Message read(std::chrono::duration<double> most) { return socket_.receive(socket_.stream().time_s() + most.count()); }
  // The next text. Skips binary frames. Throws std::runtime_error if none comes.
  std::string text();
  // Sends a request and returns the text that comes next, other than notifications.
  std::string ask(const std::string& method, const std::string& params);

 private:
  static constexpr double kPatience_s = 20;

  WebSocket socket_;
  WebSocket::Answer answer_;
  int next_id_ = 1;
};

}  // namespace filiform::tools
