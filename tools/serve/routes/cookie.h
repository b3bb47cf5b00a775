// The cookie of a log-in. Its name holds the port, because browsers send cookies to all ports of a host. Functions
// without state.
#pragma once

#include "tools/serve/routes/request.h"

#include <string>
#include <string_view>

namespace filiform::tools {

// The value of the server's cookie in a request; empty if it is absent.
std::string_view cookieOf(const Request& request);
// The header Set-Cookie. Over TLS, as a stated proxy says, the cookie is for this host and TLS alone.
std::string setCookie(const Request& request, const std::string& value);

}  // namespace filiform::tools
