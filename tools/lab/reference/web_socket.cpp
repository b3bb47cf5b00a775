#include "tools/lab/reference/web_socket.h"

#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <cstdlib>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdexcept>
#include <sys/socket.h>
#include <unistd.h>

namespace filiform::tools {

WebSocketClient::WebSocketClient(std::uint16_t port, const std::vector<std::string>& headers, const std::string& target,
                                 int receive_bytes)
    : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  const int at_once = 1;
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &at_once, sizeof at_once);
  if (receive_bytes > 0) ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(socket_);
    throw std::runtime_error("nothing listens at port " + std::to_string(port));
  }
  std::string request = "GET " + target +
                        " HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: ZmlsaWZvcm0tZmlsaWZvcg==\r\n";
  for (const std::string& header : headers) request += header + "\r\n";
  sendRaw(request + "\r\n");
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  std::size_t end = std::string::npos;
  while ((end = pending_.find("\r\n\r\n")) == std::string::npos && fill(until)) {
  }
  if (end == std::string::npos) return;
  head_ = pending_.substr(0, end + 4);
  pending_.erase(0, end + 4);
  status_ = static_cast<unsigned>(std::atoi(head_.c_str() + std::min<std::size_t>(9, head_.size())));
}

WebSocketClient::~WebSocketClient() { ::close(socket_); }

bool WebSocketClient::sendRaw(const std::string& bytes) {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t n = ::send(socket_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) return false;
    sent += static_cast<std::size_t>(n);
  }
  return true;
}

bool WebSocketClient::send(unsigned opcode, const std::string& payload) {
  std::string frame{static_cast<char>(0x80 | opcode)};
  const std::size_t size = payload.size();
  const int extra = size < 126 ? 0 : size < 65536 ? 2 : 8;
  frame += static_cast<char>(0x80 | (extra == 0 ? size : extra == 2 ? 126 : 127));
  for (int i = extra - 1; i >= 0; --i) frame += static_cast<char>(size >> (8 * i));
  constexpr unsigned char kMask[4] = {0x11, 0x22, 0x33, 0x44};
  frame.append(reinterpret_cast<const char*>(kMask), 4);
  for (std::size_t i = 0; i < size; ++i)
    frame += static_cast<char>(static_cast<unsigned char>(payload[i]) ^ kMask[i % 4]);
  return sendRaw(frame);
}

// False at the end of the time or of the connection.
bool WebSocketClient::fill(std::chrono::steady_clock::time_point until) {
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
  pollfd ready{socket_, POLLIN, 0};
  if (ended_ || ::poll(&ready, 1, static_cast<int>(std::max<long>(0, left.count()))) <= 0) return false;
  char bytes[65536];
  const ssize_t n = ::recv(socket_, bytes, sizeof bytes, 0);
  if (n <= 0) {
    ended_ = true;
    return false;
  }
  pending_.append(bytes, static_cast<std::size_t>(n));
  return true;
}

WebSocketClient::Message WebSocketClient::read(std::chrono::milliseconds most) {
  const auto until = std::chrono::steady_clock::now() + most;
  for (;;) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(pending_[i]); };
    std::size_t head = 2, size = pending_.size() > 1 ? byte(1) & 127u : 0;
    if (pending_.size() > 1 && size > 125) {
      const std::size_t extra = size == 126 ? 2 : 8;
      head += extra;
      size = 0;
      for (std::size_t i = 2; i < head && i < pending_.size(); ++i) size = size << 8 | byte(i);
    }
    if (pending_.size() < 2 || pending_.size() < head || pending_.size() - head < size) {
      if (!fill(until)) return {ended_ ? Message::Kind::ended : Message::Kind::none, {}, 0};
      continue;
    }
    const unsigned opcode = byte(0) & 15u;
    std::string payload = pending_.substr(head, size);
    pending_.erase(0, head + size);
    if (opcode == 9) send(10, payload);
    if (opcode == 1) return {Message::Kind::text, std::move(payload), 0};
    if (opcode == 2) return {Message::Kind::binary, std::move(payload), 0};
    if (opcode == 8) {
      const unsigned code = payload.size() < 2 ? 1005
                                               : static_cast<unsigned>(static_cast<unsigned char>(payload[0])) << 8 |
                                                     static_cast<unsigned char>(payload[1]);
      send(8, payload.substr(0, 2));
      return {Message::Kind::close, payload.size() < 2 ? "" : payload.substr(2), code};
    }
  }
}

std::string WebSocketClient::text(std::chrono::milliseconds most) {
  const auto until = std::chrono::steady_clock::now() + most;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    Message message = read(std::max(left, std::chrono::milliseconds(0)));
    if (message.kind == Message::Kind::text) return std::move(message.bytes);
    if (message.kind != Message::Kind::binary)
      throw std::runtime_error("no text came; close code " + std::to_string(message.code) + " " + message.bytes);
  }
}

std::string WebSocketClient::ask(const std::string& method, const std::string& params) {
  const std::string id = std::to_string(next_id_++);
  sendText(R"({"jsonrpc":"2.0","id":)" + id + R"(,"method":")" + method + R"(","params":)" + params + "}");
  for (;;) {
    std::string answer = text();
    if (answer.find("\"id\":" + id + ",") != std::string::npos) return answer;
  }
}

}  // namespace filiform::tools
