// Requests for a session: a WebSocket that speaks filiform.v1 (tools/serve/PROTOCOL.md). Functions without state.
#pragma once

#include "tools/serve/routes/request.h"

#include <string_view>

namespace filiform::tools {

// The request is for a session; the server then upgrades the connection, if the client asks for that.
bool isSession(const Request& request);
// The token among the subprotocols of an upgrade: browsers cannot send other headers. It is the part after
// `filiform.token.`; empty if there is none.
std::string_view tokenOfProtocols(std::string_view protocols);

}  // namespace filiform::tools
