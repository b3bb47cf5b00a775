// The opening handshake of the WebSocket protocol (RFC 6455, 4), for both sides. Allocates; not for the tick. Thread
// rule: functions without state.
#pragma once

#include <string>
#include <string_view>

namespace filiform::internal {

// 16 random bytes in base64.
std::string webSocketKey();
std::string upgradeRequest(const std::string& host, const std::string& key);
// The value of Sec-WebSocket-Accept for a key: the base64 of its SHA-1 (RFC 3174) with the protocol's constant.
std::string acceptOf(std::string_view key);
// The value of a header field of an HTTP head, without blanks around it; empty if it has none. `name` in lower case.
std::string_view headerField(std::string_view head, std::string_view name);
// Whether this head of an answer opens the WebSocket that was asked for with `key`.
bool isUpgraded(std::string_view head, std::string_view key);

}  // namespace filiform::internal
