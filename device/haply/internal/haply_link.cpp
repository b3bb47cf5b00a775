#include "device/haply/internal/haply_link.h"

#include "device/haptic_device.h"
#include "device/web_socket/handshake.h"

#include <utility>

namespace filiform::internal {

std::string askService(const MakeStream& connect, const std::string& host, const std::string& path, double timeout_s) {
  const std::unique_ptr<ByteStream> stream = connect();
  HttpAnswer answer = askHttp(*stream, "GET " + path + " HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n",
                              stream->time_s() + timeout_s);
  return answer.status == 200 ? std::move(answer.rest) : "";
}

HaplyInventory HaplyLink::open(const MakeStream& connect, const std::string& host, double timeout_s) {
  close();
  first_ = true;
  std::unique_ptr<ByteStream> stream = connect();
  const double until_s = stream->time_s() + timeout_s;
  const char* trouble = socket_.open(std::move(stream), {.host = host}, timeout_s).trouble;
  if (isOpen()) {
    const std::string_view message = receive(until_s);
    HaplyInventory inventory;
    if (!message.empty() && readInventory(message, inventory)) return inventory;
    trouble = isOpen() ? "it sends no list of its devices" : "it ends the connection";
    if (!message.empty()) trouble = "its list of devices is not JSON";
  }
  close();
  throw DeviceError(trouble);
}

void HaplyLink::close() noexcept {
  constexpr double kGoodbyeTime_s = 0.01;
  socket_.close(kGoodbyeTime_s);
}

bool HaplyLink::send(const HaplyCommand& command, double wait_s) noexcept {
  if (!isOpen()) return false;
  const std::size_t bytes = writeCommand(socket_.draft(), command, std::exchange(first_, false));
  return socket_.send(FrameKind::text, bytes, wait_s);
}

std::string_view HaplyLink::receive(double until_s) noexcept {
  for (;;) {
    using Kind = WebSocket::Message::Kind;
    const WebSocket::Message message = socket_.receive(until_s);
    const bool is_data = message.kind == Kind::text || message.kind == Kind::binary;
    if (is_data && !message.bytes.empty()) return message.bytes;
    if ((!is_data && message.kind != Kind::pong) || time_s() >= until_s) return {};
  }
}

}  // namespace filiform::internal
