#include "tools/serve/routes/cookie.h"

#include <algorithm>

namespace filiform::tools {

namespace {

std::string cookieName(const Request& request) {
  if (request.is_tls) return "__Host-filiform";  // browsers accept this name over TLS only
  const std::string_view host = request.header("host");
  const std::size_t colon = host.rfind(':');
  const bool has_port = colon != std::string_view::npos && host.find(']', colon) == std::string_view::npos;
  return "filiform" + (has_port ? '_' + std::string(host.substr(colon + 1)) : std::string());
}

}  // namespace

std::string_view cookieOf(const Request& request) {
  const std::string name = cookieName(request);
  std::string_view header = request.header("cookie");
  while (!header.empty()) {
    const std::string_view pair = header.substr(0, header.find(';'));
    header.remove_prefix(std::min(header.size(), pair.size() + 1));
    const std::size_t begin = pair.find_first_not_of(' ');
    if (begin == std::string_view::npos) continue;
    const std::string_view trimmed = pair.substr(begin);
    if (trimmed.size() > name.size() && trimmed.starts_with(name) && trimmed[name.size()] == '=')
      return trimmed.substr(name.size() + 1);
  }
  return {};
}

std::string setCookie(const Request& request, const std::string& value) {
  return cookieName(request) + '=' + value + "; HttpOnly; SameSite=Strict; Path=/" + (request.is_tls ? "; Secure" : "");
}

}  // namespace filiform::tools
