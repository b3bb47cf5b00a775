#include "device/haply/internal/haply_peer.h"

#include "device/web_socket/handshake.h"

#include <algorithm>
#include <vector>

namespace filiform::internal {

HaplyPeer::~HaplyPeer() {
  if (is_open_) service_.endSession();
}

void HaplyPeer::put(std::string_view payload, FrameKind kind, std::string& out) {
  std::vector<char> buffer(kMostFrameHeader);
  buffer.insert(buffer.end(), payload.begin(), payload.end());
  const std::span<const char> frame = frameAround(buffer, payload.size(), kind, nullptr);
  out.append(frame.data(), frame.size());
}

bool HaplyPeer::takeHead(std::string& out) {
  const std::size_t end = head_.find("\r\n\r\n");
  if (end == std::string::npos) return head_.size() < 16 * 1024;
  const std::string rest = head_.substr(end + 4);
  head_.resize(end + 2);
  const std::string_view key = headerField(head_, "sec-websocket-key");
  std::string body;
  if (head_.starts_with("GET /version ")) body = "{\"version\":\"" + service_.options().version + "\"}";
  for (const auto& [name, value] : service_.options().settings)
    for (const std::string& id : service_.options().devices)
      if (head_.starts_with("GET /inverse3/" + id + "/config/" + name + " ")) body = value;
  if (!body.empty()) {
    out += "HTTP/1.1 200 OK\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
           "\r\n\r\n" + body;
    return false;
  }
  if (key.empty()) {
    out += "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n";
    return false;
  }
  out += "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: " +
         acceptOf(key) + "\r\n\r\n";
  is_open_ = true;
  put(service_.inventory(), FrameKind::text, out);
  return take(rest, out);
}

bool HaplyPeer::take(std::span<const char> bytes, std::string& out) {
  if (service_.faults().ends) return false;
  if (!is_open_) {
    head_.append(bytes.data(), bytes.size());
    return takeHead(out);
  }
  while (!bytes.empty()) {
    const std::span<char> space = parser_.space();
    if (space.empty()) return false;
    const std::size_t part = std::min(space.size(), bytes.size());
    std::copy_n(bytes.begin(), part, space.begin());
    parser_.wrote(part);
    bytes = bytes.subspan(part);
    if (!goOn(out)) return false;
  }
  return true;
}

bool HaplyPeer::goOn(std::string& out) {
  if (service_.faults().ends) return false;
  if (!is_open_ || service_.faults().holds) return true;
  for (;;) {
    std::string_view payload;
    switch (parser_.next(payload)) {
      case FrameParser::Event::text:
      case FrameParser::Event::binary: {
        const std::string answer = service_.answer(payload);
        if (!answer.empty()) put(answer, FrameKind::text, out);
        if (!answer.empty() && service_.faults().sends_twice) put(answer, FrameKind::text, out);
        break;
      }
      case FrameParser::Event::ping:
        put(payload, FrameKind::pong, out);
        break;
      case FrameParser::Event::pong:
        break;
      case FrameParser::Event::close:
        put(payload, FrameKind::close, out);
        return false;
      case FrameParser::Event::broken:
        return false;
      case FrameParser::Event::none:
        return true;
    }
  }
}

}  // namespace filiform::internal
