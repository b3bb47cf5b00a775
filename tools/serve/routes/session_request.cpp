#include "tools/serve/routes/session_request.h"

#include <algorithm>

namespace filiform::tools {

bool isSession(const Request& request) {
  return request.method == "GET" && request.parts.size() == 2 && request.parts[0] == "v1" &&
         request.parts[1] == "session";
}

std::string_view tokenOfProtocols(std::string_view protocols) {
  constexpr std::string_view kPrefix = "filiform.token.";
  while (!protocols.empty()) {
    std::string_view name = protocols.substr(0, protocols.find(','));
    protocols.remove_prefix(std::min(protocols.size(), name.size() + 1));
    while (!name.empty() && (name.front() == ' ' || name.front() == '\t')) name.remove_prefix(1);
    while (!name.empty() && (name.back() == ' ' || name.back() == '\t')) name.remove_suffix(1);
    if (name.size() > kPrefix.size() && name.starts_with(kPrefix)) return name.substr(kPrefix.size());
  }
  return {};
}

}  // namespace filiform::tools
