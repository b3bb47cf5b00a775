// WebSocketClient: a client of the service's sessions, for tests and benchmarks. Thread rule: thread-compatible; one
// thread may send while another reads.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace filiform::tools {

class WebSocketClient {
 public:
  // Asks 127.0.0.1:`port` for an upgrade of `target`; see status(). `headers`: whole lines without their ends, in
  // addition to those that an upgrade needs. `receive_bytes`: the size of the system's receive buffer, about; 0: as
  // usual. Throws std::runtime_error if nothing listens.
  explicit WebSocketClient(std::uint16_t port, const std::vector<std::string>& headers = {},
                           const std::string& target = "/v1/session", int receive_bytes = 0);
  ~WebSocketClient();  // without a close frame
  WebSocketClient(const WebSocketClient&) = delete;
  WebSocketClient& operator=(const WebSocketClient&) = delete;

  unsigned status() const { return status_; }        // 101: the WebSocket is open
  const std::string& head() const { return head_; }  // of the answer to the upgrade

  // False if the server has closed the connection.
  bool sendText(const std::string& text) { return send(1, text); }
  bool sendBinary(std::span<const unsigned char> bytes) {
    return send(2, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  }
  bool send(unsigned opcode, const std::string& payload);
  bool sendRaw(const std::string& bytes);
  void sendClose() { send(8, std::string("\x03\xe8", 2)); }

  struct Message {
    enum class Kind : std::uint8_t { none, text, binary, close, ended };  // none: nothing came within the time
    Kind kind = Kind::none;
    std::string bytes;
    unsigned code = 0;  // of a close frame
  };
  // The next message. Answers pings.
  Message read(std::chrono::milliseconds most);
  // The next text. Skips binary frames. Throws std::runtime_error if none comes.
  std::string text(std::chrono::milliseconds most = std::chrono::seconds(20));
  // Sends a request and returns the text that comes next, other than notifications.
  std::string ask(const std::string& method, const std::string& params);

 private:
  bool fill(std::chrono::steady_clock::time_point until);

  int socket_ = -1, next_id_ = 1;
  unsigned status_ = 0;
  std::string head_, pending_;
  bool ended_ = false;
};

}  // namespace filiform::tools
