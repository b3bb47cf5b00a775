#include "tools/lab/reference/service_socket.h"

#include <stdexcept>

namespace filiform::tools {

ServiceSocket::ServiceSocket(std::uint16_t port, const ServiceRequest& request)
    : socket_(80 * 1024),
      answer_(socket_.open(connectTcp("127.0.0.1", port, {.receive_bytes = request.receive_bytes}),
                           {.host = "127.0.0.1", .target = request.target, .headers = request.headers}, kPatience_s)) {}

std::string ServiceSocket::text() {
  for (;;) {
    const Message message = read(std::chrono::duration<double>(kPatience_s));
    if (message.kind == Message::Kind::text) return std::string(message.bytes);
    if (message.kind != Message::Kind::binary)
      throw std::runtime_error("no text came; close code " + std::to_string(message.code) + " " +
                               std::string(message.bytes));
  }
}

std::string ServiceSocket::ask(const std::string& method, const std::string& params) {
  const std::string id = std::to_string(next_id_++);
  sendText(R"({"jsonrpc":"2.0","id":)" + id + R"(,"method":")" + method + R"(","params":)" + params + "}");
  for (;;) {
    std::string answer = text();
    if (answer.find("\"id\":" + id + ",") != std::string::npos) return answer;
  }
}

}  // namespace filiform::tools
