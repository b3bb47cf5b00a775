#include "tools/serve/desk/desk_address.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>

namespace filiform::tools {

namespace {

[[noreturn]] void refuseAddressOf(const std::string& text, const std::string& why) {
  throw UsageError("--follow " + escaped(text, 120) + ": " + why);
}

bool isDigit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

bool isDeskName(std::string_view name) {
  constexpr std::size_t kMost = 32;
  return !name.empty() && name.size() <= kMost && std::all_of(name.begin(), name.end(), [](char c) {
    return isDigit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_' || c == '.';
  });
}

DeskAddress DeskAddress::parse(const std::string& text) {
  static const std::string kForm = "give ws://HOST:PORT/v1/sets/SET/desks/NAME, as the page shows it";
  constexpr std::string_view kScheme = "ws://";
  if (text.starts_with("wss://"))
    refuseAddressOf(text,
                    "wss:// is not supported; forward a port of the server by ssh -L, and use ws://127.0.0.1:PORT");
  if (!text.starts_with(kScheme)) refuseAddressOf(text, kForm);
  const bool plain = std::all_of(text.begin(), text.end(), [](char c) { return c > 0x20 && c < 0x7F; });
  const std::size_t slash = text.find('/', kScheme.size());
  if (!plain || text.find_first_of("?#@") != std::string::npos || slash == std::string::npos)
    refuseAddressOf(text, kForm);
  DeskAddress address;
  address.text = text;
  address.path = text.substr(slash);
  std::string authority = text.substr(kScheme.size(), slash - kScheme.size());
  const std::size_t bracket = authority.find(']'),
                    colon = authority.find(':', bracket == std::string::npos ? 0 : bracket);
  if (colon != std::string::npos) {
    address.port = authority.substr(colon + 1);
    authority.resize(colon);
    const bool is_number = !address.port.empty() && address.port.size() <= 5 &&
                           std::all_of(address.port.begin(), address.port.end(), isDigit);
    if (!is_number || std::stoul(address.port) == 0 || std::stoul(address.port) > 65535)
      refuseAddressOf(text, "the port is a number from 1 to 65535");
  }
  if (authority.starts_with('[') && authority.ends_with(']')) authority = authority.substr(1, authority.size() - 2);
  address.host = authority;
  if (address.host.empty()) refuseAddressOf(text, kForm);
  const std::size_t desks = address.path.rfind("/desks/");
  if (!address.path.starts_with("/v1/sets/") || desks == std::string::npos || desks <= std::string("/v1/sets/").size())
    refuseAddressOf(text, kForm);
  if (!isDeskName(address.path.substr(desks + std::string("/desks/").size())))
    refuseAddressOf(text, "the name of a desk is 1 to 32 letters, digits, '-', '_' or '.'");
  return address;
}

std::string DeskAddress::authority() const {
  const std::string name = host.find(':') == std::string::npos ? host : "[" + host + "]";
  return port == "80" ? name : name + ":" + port;
}

}  // namespace filiform::tools
