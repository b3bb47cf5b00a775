// The opening handshake of the WebSocket protocol (RFC 6455, 4), for both sides, and the answers of HTTP. Allocates;
// not for the tick. Thread rule: functions without state.
#pragma once

#include "device/web_socket/byte_stream.h"

#include <string>
#include <string_view>

namespace filiform::internal {

// 16 random bytes in base64.
std::string webSocketKey();
// The value of Sec-WebSocket-Accept for a key: the base64 of its SHA-1 (RFC 3174) with the protocol's constant.
std::string acceptOf(std::string_view key);
// The value of a header field of an HTTP head, without blanks around it; empty if it has none. `name` in lower case.
std::string_view headerField(std::string_view head, std::string_view name);

struct HttpAnswer {
  unsigned status = 0;  // 0: no answer came, or what came is not HTTP/1.1
  std::string head;     // to the empty line
  // After status 101: what came behind the head, less than kHttpBlock. Otherwise the body, as far as it came.
  std::string rest;
  const char* trouble = "";  // of status 0
};
inline constexpr std::size_t kHttpBlock = 1024;  // bytes

// Sends a request and reads its answer: until it has the length that it states, or the peer ends the connection, or
// 16 KiB have come, or time_s() is until_s.
HttpAnswer askHttp(ByteStream& stream, const std::string& request, double until_s);

}  // namespace filiform::internal
