// The address of a tile set on an HTTP server.
#pragma once

#include <string>
#include <string_view>

namespace filiform::internal {

// Thread rule: values.
struct RemoteAddress {
  // `http://HOST/v1/sets/NAME`, as filiform serves sets, or the address of a set's folder on any server. Throws
  // UsageError if it is malformed, or contains a password, a query or a fragment.
  explicit RemoteAddress(const std::string& text);

  std::string set;     // without a slash at the end
  std::string files;   // begins the address of each file: `SET/files/` for a set of a service, else `SET/`
  std::string origin;  // scheme, host and port
};

// Scheme, host and port of a URL, in lower case; empty if it is malformed or neither http nor https.
std::string originOf(const std::string& url);

}  // namespace filiform::internal
