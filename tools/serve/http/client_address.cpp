#include "tools/serve/http/client_address.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/serve/people/person.h"

#include <algorithm>
#include <arpa/inet.h>
#include <charconv>
#include <optional>

namespace filiform::tools {

namespace {

using AddressBytes = std::array<std::uint8_t, 16>;

// IPv4 addresses as those of IPv6 that stand for them.
std::optional<AddressBytes> addressBytes(std::string_view text) {
  const std::string address(text);
  AddressBytes bytes{};
  if (::inet_pton(AF_INET6, address.c_str(), bytes.data()) == 1) return bytes;
  bytes = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff};
  if (::inet_pton(AF_INET, address.c_str(), bytes.data() + 12) == 1) return bytes;
  return std::nullopt;
}

bool isMapped(const AddressBytes& bytes) {
  return std::all_of(bytes.begin(), bytes.begin() + 10, [](std::uint8_t b) { return b == 0; }) && bytes[10] == 0xff &&
         bytes[11] == 0xff;
}

std::string_view withoutSpaces(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

}  // namespace

Proxies::Proxies(const std::vector<std::string>& networks) {
  for (const std::string& text : networks) {
    const std::size_t slash = text.find('/');
    const auto address = addressBytes(std::string_view(text).substr(0, slash));
    const bool is_v4 = text.find(':') == std::string::npos;
    unsigned bits = is_v4 ? 32 : 128;
    bool right = address.has_value();
    if (slash != std::string::npos) {
      const char* const end = text.data() + text.size();
      unsigned given = 0;
      const auto read = std::from_chars(text.data() + slash + 1, end, given);
      right = right && read.ec == std::errc() && read.ptr == end && given <= bits;
      bits = given;
    }
    if (!right)
      throw UsageError("--proxy " + escaped(text, 80) + ": give an address or a network, such as 10.0.0.0/8 or ::1");
    networks_.push_back({*address, bits + (is_v4 ? 96 : 0)});
  }
}

bool Proxies::has(std::string_view address) const {
  const auto bytes = addressBytes(address);
  return bytes && std::any_of(networks_.begin(), networks_.end(), [&](const Network& network) {
           for (unsigned bit = 0; bit < network.bits; bit += 8) {
             const auto mask = static_cast<std::uint8_t>(0xff00u >> std::min(8u, network.bits - bit));
             if ((((*bytes)[bit / 8] ^ network.address[bit / 8]) & mask) != 0) return false;
           }
           return true;
         });
}

std::string Proxies::clientOf(const std::string& peer, std::string_view forwarded_for) const {
  std::string client = peer;
  while (!forwarded_for.empty() && has(client)) {
    const std::size_t comma = forwarded_for.rfind(',');
    const std::string_view last =
        withoutSpaces(comma == std::string_view::npos ? forwarded_for : forwarded_for.substr(comma + 1));
    if (!addressBytes(last)) break;
    client = last;
    forwarded_for = comma == std::string_view::npos ? std::string_view() : forwarded_for.substr(0, comma);
  }
  return client;
}

std::string shareOf(const std::string& address) {
  const auto bytes = addressBytes(address);
  if (!bytes || isMapped(*bytes)) return address.substr(address.rfind(':') + 1);
  AddressBytes network = *bytes;
  std::fill(network.begin() + 8, network.end(), std::uint8_t{0});
  std::array<char, INET6_ADDRSTRLEN> text{};
  return std::string(::inet_ntop(AF_INET6, network.data(), text.data(), text.size())) + "/64";
}

std::string workShareOf(const std::string& address, const Person* person) {
  const bool is_known = person != nullptr && !person->key.empty() && !person->name.empty();
  return is_known ? "person " + person->name : shareOf(address);
}

}  // namespace filiform::tools
